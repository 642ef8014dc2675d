//! Hands the memory map to the linker of the firmware images, and tells the library whether the
//! processor has the DSP extension: a stable compiler does not show that feature to `cfg`.

use std::{env, fs, path::PathBuf};

/// The part's memory regions.
const REGIONS: &str = "src/bin/stm32f405/regions.x";
/// Memory maps of the boards without the DSP extension, by the feature that chooses one.
const SMALL: [(&str, &str); 2] = [
    ("CARGO_FEATURE_MICROBIT", "src/bin/small_core/microbit.x"),
    ("CARGO_FEATURE_LM3S6965EVB", "src/bin/small_core/lm3s6965evb.x"),
];
/// Limits of the image that is flashed.
const SLOTS: &str = "src/bin/stm32f405/slots.x";
/// Start of its code (`store::layout::CODE`).
const CODE: &str = "0x08080000";

fn main() {
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed={REGIONS}");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={SLOTS}");
    println!("cargo:rustc-check-cfg=cfg(gyronet_dsp, gyronet_armv8m)");
    if env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv8m.main")) {
        println!("cargo:rustc-cfg=gyronet_armv8m");
    }
    if has_dsp() {
        println!("cargo:rustc-cfg=gyronet_dsp");
    }
    for (feature, map) in SMALL {
        println!("cargo:rerun-if-changed={map}");
        if env::var_os(feature).is_some() && env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
            let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
            fs::copy(map, out.join("regions.x")).expect("the board's map stands with the image");
            println!("cargo:rustc-link-search={}", out.display());
        }
    }
    // Not for the firmware of others that use the library: it has a memory map of its own.
    let image = env::var_os("CARGO_FEATURE_STM32F405").is_some();
    if image && env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        // cortex-m-rt's link.x includes memory.x, and that regions.x, from the search path.
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
        fs::copy("memory.x", out.join("memory.x")).expect("memory.x stands in the package root");
        fs::copy(REGIONS, out.join("regions.x")).expect("the part's regions stand with its code");
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rustc-link-arg-bin=coprocessor=-T{SLOTS}");
        for flashed in ["coprocessor", "bringup"] {
            println!("cargo:rustc-link-arg-bin={flashed}=--defsym=_flashed_code={CODE}");
        }
        if env::var_os("CARGO_FEATURE_RTT").is_some() {
            println!("cargo:rustc-link-arg-bin=coprocessor=-Tdefmt.x");
        }
    }
}

/// ARMv7E-M always has it; ARMv8-M mainline where the flags name it or a core that has it.
fn has_dsp() -> bool {
    let target = env::var("TARGET").unwrap_or_default();
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let named = ["+dsp", "cortex-m33", "cortex-m35p", "cortex-m55", "cortex-m85"];
    target.starts_with("thumbv7em")
        || target.starts_with("thumbv8m.main") && named.iter().any(|name| flags.contains(name))
}

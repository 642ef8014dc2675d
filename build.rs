//! Build script. It passes the memory map of an image to the linker, and tells the library whether the processor has
//! the DSP extension, which a stable compiler does not expose to `cfg`.

use std::{env, fs, path::PathBuf};

/// Memory regions of the STM32F405.
const REGIONS: &str = "src/bin/stm32f405/regions.x";
/// Memory maps of the boards without the DSP extension, each with the Cargo feature that selects it.
const SMALL: [(&str, &str); 2] = [
    ("CARGO_FEATURE_MICROBIT", "src/bin/small_core/microbit.x"),
    ("CARGO_FEATURE_LM3S6965EVB", "src/bin/small_core/lm3s6965evb.x"),
];
/// Linker script with the flash limits of the `coprocessor` image.
const SLOTS: &str = "src/bin/stm32f405/slots.x";
/// Start address of the code of `coprocessor` and `bringup` (`store::layout::FIRMWARE_A`).
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
            fs::copy(map, out.join("regions.x")).expect("cannot copy the memory map of the board");
            println!("cargo:rustc-link-search={}", out.display());
        }
    }
    // Only for the images of this package: firmware that uses the library has its own memory map.
    let image = env::var_os("CARGO_FEATURE_STM32F405").is_some();
    if image && env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        // cortex-m-rt's link.x includes memory.x from the search path, and memory.x includes regions.x.
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
        fs::copy("memory.x", out.join("memory.x")).expect("cannot copy memory.x of the package");
        fs::copy(REGIONS, out.join("regions.x")).expect("cannot copy the memory regions of the chip");
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

/// Returns whether the target has DSP: always on ARMv7E-M; on ARMv8-M mainline if RUSTFLAGS name it or such a core.
fn has_dsp() -> bool {
    let target = env::var("TARGET").unwrap_or_default();
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let named = ["+dsp", "cortex-m33", "cortex-m35p", "cortex-m55", "cortex-m85"];
    target.starts_with("thumbv7em")
        || target.starts_with("thumbv8m.main") && named.iter().any(|name| flags.contains(name))
}

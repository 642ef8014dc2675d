//! Hands the memory map to the linker of the firmware images, and tells the library whether the
//! processor has the DSP extension: a stable compiler does not show that feature to `cfg`.

use std::{env, fs, path::PathBuf};

/// The memory regions of the part that an image is built for.
const REGIONS: [&str; 2] =
    ["src/bin/coprocessor/stm32f405/regions.x", "src/bin/coprocessor/stm32h743/regions.x"];
/// What only the image that is flashed must keep to.
const SLOTS: &str = "src/bin/coprocessor/slots.x";

fn main() {
    println!("cargo:rerun-if-changed=memory.x");
    for regions in REGIONS {
        println!("cargo:rerun-if-changed={regions}");
    }
    println!("cargo:rerun-if-changed=src/build.rs");
    println!("cargo:rerun-if-changed={SLOTS}");
    println!("cargo:rustc-check-cfg=cfg(gyronet_dsp, gyronet_armv8m)");
    if env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv8m.main")) {
        println!("cargo:rustc-cfg=gyronet_armv8m");
    }
    if has_dsp() {
        println!("cargo:rustc-cfg=gyronet_dsp");
    }
    // Not for the firmware of others that use the library: it has a memory map of its own.
    let image = env::var_os("CARGO_FEATURE_IMAGE").is_some();
    if image && env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        // cortex-m-rt's link.x includes memory.x, and that regions.x, from the search path.
        let [stm32f405, stm32h743] = REGIONS;
        let regions = if env::var_os("CARGO_FEATURE_STM32H743").is_some() { stm32h743 } else { stm32f405 };
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
        fs::copy("memory.x", out.join("memory.x")).expect("memory.x stands in the package root");
        fs::copy(regions, out.join("regions.x")).expect("a part's regions stand with its code");
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rustc-link-arg-bin=coprocessor=-T{SLOTS}");
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

//! Hands `memory.x` to the linker of the firmware images, and tells the library whether the
//! processor has the DSP extension: a stable compiler does not show that feature to `cfg`.

use std::{env, fs, path::PathBuf};

/// The memory of the STM32H743; that of the STM32F405, and of what is emulated, is `memory.x`.
const STM32H743: &str = "src/bin/coprocessor/stm32h743/memory.x";
/// What only the image that is flashed must keep to.
const SLOTS: &str = "src/bin/coprocessor/slots.x";

fn main() {
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed={STM32H743}");
    println!("cargo:rerun-if-changed=src/build.rs");
    println!("cargo:rerun-if-changed={SLOTS}");
    println!("cargo:rustc-check-cfg=cfg(gyronet_dsp, gyronet_armv8m)");
    if env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv8m.main")) {
        println!("cargo:rustc-cfg=gyronet_armv8m");
    }
    if has_dsp() {
        println!("cargo:rustc-cfg=gyronet_dsp");
    }
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        // cortex-m-rt's link.x includes memory.x from the search path.
        let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
        let memory = if env::var_os("CARGO_FEATURE_STM32H743").is_some() { STM32H743 } else { "memory.x" };
        fs::copy(memory, out.join("memory.x")).expect("the memory's map stands in the package");
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

//! Build script: tells the library whether the processor has the DSP extension, which a stable compiler does not expose
//! to `cfg`.

use std::env;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(gyronet_dsp, gyronet_armv8m)");
    if env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv8m.main")) {
        println!("cargo:rustc-cfg=gyronet_armv8m");
    }
    if has_dsp() {
        println!("cargo:rustc-cfg=gyronet_dsp");
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

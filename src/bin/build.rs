//! Build script of the images: passes the memory map of an image to the linker.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Memory map of the STM32F405's images, from the root of the repository, and memory regions of the chip.
const MEMORY: &str = "../../memory.x";
const REGIONS: &str = "stm32f405/regions.x";
/// Memory maps of the boards without the DSP extension, each with the Cargo feature that selects it.
const SMALL: [(&str, &str); 2] = [
    ("CARGO_FEATURE_MICROBIT", "small_core/microbit.x"),
    ("CARGO_FEATURE_LM3S6965EVB", "small_core/lm3s6965evb.x"),
];
/// Linker script with the flash limits of the `coprocessor` image.
const SLOTS: &str = "stm32f405/slots.x";
/// Start address of the code of `coprocessor` and `bringup` (`store::layout::FIRMWARE_A`).
const CODE: &str = "0x08080000";

fn main() {
    for input in ["build.rs", MEMORY, REGIONS, SLOTS] {
        println!("cargo:rerun-if-changed={input}");
    }
    SMALL.iter().for_each(|(_, map)| println!("cargo:rerun-if-changed={map}"));
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let has = |feature: &str| env::var_os(feature).is_some();
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    println!("cargo:rustc-link-search={}", out.display());
    // cortex-m-rt's link.x includes memory.x from the search path, and memory.x includes regions.x.
    let copy = |from: &str, name: &str| fs::copy(from, out.join(name)).expect("the memory map can be copied");
    copy(MEMORY, "memory.x");
    if let Some((_, map)) = SMALL.iter().find(|(feature, _)| has(feature)) {
        copy(map, "regions.x");
        return;
    }
    copy(REGIONS, "regions.x");
    let folder = env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    println!("cargo:rustc-link-arg-bin=coprocessor=-T{}", Path::new(&folder).join(SLOTS).display());
    for flashed in ["coprocessor", "bringup"] {
        println!("cargo:rustc-link-arg-bin={flashed}=--defsym=_flashed_code={CODE}");
    }
    if has("CARGO_FEATURE_RTT") {
        println!("cargo:rustc-link-arg-bin=coprocessor=-Tdefmt.x");
    }
}

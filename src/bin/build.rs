//! Build script of the images: passes the memory map of an image to the linker.

use std::path::{Path, PathBuf};
use std::{env, fs};

/// Memory map of the STM32F405's images, from the root of the repository, and memory regions of the chip.
const MEMORY: &str = "../../memory.x";
const REGIONS: &str = "stm32f405/regions.x";
/// Memory maps of the boards that are emulated alone, each with the Cargo feature that selects it.
const EMULATED: [(&str, &str); 3] = [
    ("CARGO_FEATURE_MICROBIT", "small_core/microbit.x"),
    ("CARGO_FEATURE_LM3S6965EVB", "small_core/lm3s6965evb.x"),
    ("CARGO_FEATURE_MPS2_AN505", "small_core/mps2_an505.x"),
];
/// Linker scripts with the conditions of an image.
const SCRIPTS: [(&str, &str); 2] = [("coprocessor", "stm32f405/slots.x"), ("boot", "stm32f405/boot.x")];
/// Start of the slots for firmware (`store::layout`), of which feature `slot-b` selects the second.
const FIRMWARE: [u32; 2] = [0x0808_0000, 0x0804_0000];
/// Place of an image's code behind vectors and label, and of the boot loader's behind its vectors.
const BEHIND_LABEL: u32 = 0x280;
const BEHIND_VECTORS: u32 = 0x0800_0200;

fn main() {
    for input in ["build.rs", MEMORY, REGIONS] {
        println!("cargo:rerun-if-changed={input}");
    }
    EMULATED.iter().for_each(|(_, map)| println!("cargo:rerun-if-changed={map}"));
    let has = |feature: &str| env::var_os(feature).is_some();
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        let is_image = has("CARGO_FEATURE_STM32F405") || has("CARGO_FEATURE_SMALL_CORE");
        assert!(
            !is_image,
            "an image is built for its processor: with `cargo fw`, `bringup`, `bench-target` or `selftest`"
        );
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    println!("cargo:rustc-link-search={}", out.display());
    // cortex-m-rt's link.x includes memory.x from the search path, and memory.x includes regions.x.
    let copy = |from: &str, name: &str| fs::copy(from, out.join(name)).expect("the memory map can be copied");
    copy(MEMORY, "memory.x");
    if let Some((_, map)) = EMULATED.iter().find(|(feature, _)| has(feature)) {
        copy(map, "regions.x");
        return;
    }
    copy(REGIONS, "regions.x");
    let folder = env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    for (image, script) in SCRIPTS {
        println!("cargo:rerun-if-changed={script}");
        println!("cargo:rustc-link-arg-bin={image}=-T{}", Path::new(&folder).join(script).display());
    }
    let [a, b] = FIRMWARE;
    let slot = if has("CARGO_FEATURE_SLOT_B") { b } else { a };
    println!("cargo:rustc-link-arg-bin=coprocessor=--defsym=_slot={slot:#010x}");
    for (image, code) in [("coprocessor", slot + BEHIND_LABEL), ("bringup", a), ("boot", BEHIND_VECTORS)] {
        println!("cargo:rustc-link-arg-bin={image}=--defsym=_flashed_code={code:#010x}");
    }
}

//! Builds the firmware images as `cargo fw` does, so that the tests run the same code as a board: the product with its
//! boot loader.

use crate::require::{self, Need};
use gyronet_tools::client::device::update::Update;
use gyronet_tools::target::bench;
use gyronet_tools::target::firmware::Linked;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

/// As [`firmware_for`], for the Netduino Plus 2.
pub fn firmware(scratch: &str, image: &str) -> Option<PathBuf> {
    firmware_for(("netduino-plus-2", bench::TARGET), scratch, image)
}

/// An update of the Netduino Plus 2 to what is in this checkout.
pub fn update(scratch: &str) -> Option<Update> {
    require::wants(Need::Qemu, bench::target_installed(bench::TARGET))?;
    static BUILT: OnceLock<Update> = OnceLock::new();
    let build = || {
        let linked = Linked::build("netduino-plus-2", 2, &Path::new(scratch).join("images"));
        linked.and_then(|linked| linked.update()).unwrap_or_else(|error| panic!("{error}"))
    };
    Some(BUILT.get_or_init(build).clone())
}

/// The ELF file of an image (`coprocessor`, `bringup`, `selftest`, `bench`) for a board, named by its feature, and its target;
/// the test is reported as skipped where the target's standard library is not installed.
///
/// Each image is built once in a process, under `scratch` (a test's `env!("CARGO_TARGET_TMPDIR")`): the
/// build folder of `cargo test` itself may be locked.
pub fn firmware_for((board, target): (&str, &str), scratch: &str, image: &str) -> Option<PathBuf> {
    require::wants(Need::Qemu, bench::target_installed(target))?;
    // Images of different levels of optimisation share little: those to flash and the others are built side by side.
    static BUILT: [Mutex<BTreeMap<String, PathBuf>>; 2] = [const { Mutex::new(BTreeMap::new()) }; 2];
    let kind = usize::from(!bench::FLASHED.contains(&image));
    let folder = ["images", "benches"][kind];
    // A test that panicked here has left the map unchanged.
    let mut built = BUILT[kind].lock().unwrap_or_else(PoisonError::into_inner);
    let name = format!("{board}/{image}");
    if let Some(elf) = built.get(&name) {
        return Some(elf.clone());
    }
    // The next board's image overwrites this one's in the folder.
    let scratch = Path::new(scratch);
    let elf = scratch.join(format!("{image}-{board}"));
    if image == "coprocessor" {
        let linked = Linked::build(board, 1, &scratch.join(folder)).unwrap_or_else(|error| panic!("{error}"));
        let whole = linked.for_programmer().expect("it was linked for this");
        std::fs::write(&elf, whole).expect("there is room");
    } else {
        let fresh = bench::build_for((board, target), image, &scratch.join(folder));
        std::fs::copy(fresh.unwrap_or_else(|error| panic!("{error}")), &elf).expect("there is room");
    }
    built.insert(name, elf.clone());
    Some(elf)
}

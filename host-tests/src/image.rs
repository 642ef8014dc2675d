//! The firmware images, built as `cargo fw` builds them.

use crate::qemu;
use crate::recordings::workspace;
use crate::require::{self, Need};
use gyronet_tools::target_bench;
use std::path::{Path, PathBuf};

/// The ELF file of an image (`coprocessor`, `selftest`, `bench`), for a test that is skipped
/// (aloud) where the target's standard library is not installed.
///
/// Built under `scratch` (a test's `env!("CARGO_TARGET_TMPDIR")`): the build folder of
/// `cargo test` itself may be locked.
///
/// # Panics
/// When the build fails: that is an error, not a missing tool.
#[must_use]
pub fn firmware(test: &str, scratch: &str, image: &str) -> Option<PathBuf> {
    require::wants(test, Need::Qemu, target_bench::target_installed())?;
    let folder = Path::new(scratch).join("fw");
    Some(target_bench::build(workspace(), image, &folder).unwrap_or_else(|error| panic!("{error}")))
}

/// The image that is flashed, for a test that is skipped (aloud) where it cannot be built or run.
#[must_use]
pub fn coprocessor(test: &str, scratch: &str) -> Option<PathBuf> {
    qemu::available(test)?;
    firmware(test, scratch, "coprocessor")
}

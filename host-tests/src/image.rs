//! The firmware images, built as `cargo fw` builds them.

use crate::qemu;
use crate::recordings::workspace;
use crate::require::{self, Need};
use gyronet_tools::target_bench::{self, TARGET};
use std::path::{Path, PathBuf};
use std::process::Command;

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
    require::wants(test, Need::Qemu, target_installed())?;
    let folder = Path::new(scratch).join("fw");
    Some(target_bench::build(workspace(), image, &folder).unwrap_or_else(|error| panic!("{error}")))
}

/// The image that is flashed, for a test that is skipped (aloud) where it cannot be built or run.
#[must_use]
pub fn coprocessor(test: &str, scratch: &str) -> Option<PathBuf> {
    qemu::available(test)?;
    firmware(test, scratch, "coprocessor")
}

/// Whether rustc has a standard library for the target.
fn target_installed() -> Result<(), String> {
    let rustc = std::env::var_os("RUSTC").unwrap_or("rustc".into());
    let output = Command::new(rustc)
        .args(["--print", "target-libdir", "--target", TARGET])
        .current_dir(workspace())
        .output()
        .map_err(|error| format!("rustc cannot be run: {error}"))?;
    let folder = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    if output.status.success() && Path::new(&folder).is_dir() {
        Ok(())
    } else {
        Err(format!("the Rust target {TARGET} is not installed (rustup target add {TARGET})"))
    }
}

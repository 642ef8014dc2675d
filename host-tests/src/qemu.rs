//! QEMU, which runs the images of the kernels.

use crate::require::{self, Need};
use std::process::Command;

/// Checks for QEMU; without it reports that the test is skipped.
pub fn available() -> Option<()> {
    let version = Command::new("qemu-system-arm").arg("--version").output();
    require::wants(Need::Qemu, version.map(drop).map_err(|error| format!("qemu-system-arm: {error}")))
}

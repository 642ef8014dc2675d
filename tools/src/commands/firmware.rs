//! `gyronet firmware` builds the firmware of a board.

use super::{Common, named};
use gyronet::model::blob::CRC;
use gyronet_tools::target::bench;
use gyronet_tools::target::firmware::{Linked, NUCLEO};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Build the firmware of a board, and an update for `gyronet device update`.
///
/// The ELF file holds boot loader and image, for a debug probe.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet firmware --target-dir out             # out/netduino-plus-2.elf and .update
  gyronet firmware --board olimex-stm32-h405 --flash")]
pub struct Args {
    /// Board, as a feature of the images, or nucleo-h563zi (examples/nucleo), or the folder of a copy of that.
    #[arg(long, default_value = "netduino-plus-2")]
    board: String,
    /// Folder of the build and of its results [default: cargo's target folder].
    #[arg(long, value_name = "DIR")]
    target_dir: Option<PathBuf>,
    /// Flash the board through a debug probe (probe-rs), and show its log until Ctrl-C.
    #[arg(long)]
    flash: bool,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let folder = args.target_dir.clone().unwrap_or_else(bench::target_folder);
    let folder = std::path::absolute(folder)?;
    if args.flash {
        let probe_rs = Command::new("probe-rs").arg("--version").output();
        probe_rs.map_err(|error| format!("probe-rs: {error} (cargo install probe-rs-tools)"))?;
    }
    let linked = Linked::build(&args.board, if args.flash { 1 } else { 2 }, &folder)?;
    let board = Path::new(&args.board).file_name().unwrap_or_default().display();
    let [elf, update] = ["elf", "update"].map(|end| folder.join(format!("{board}.{end}")));
    std::fs::write(&elf, linked.for_programmer()?).map_err(named(&elf))?;
    if args.flash {
        let chip = if args.board == NUCLEO { "STM32H563ZITx" } else { "STM32F405RGTx" };
        let status = Command::new("probe-rs")
            .args(["run", "--chip", chip])
            .arg(&elf)
            .status()
            .map_err(|error| format!("probe-rs: {error}"))?;
        return if status.success() { Ok(()) } else { Err(format!("probe-rs: {status}").into()) };
    }
    let file = linked.update()?;
    std::fs::write(&update, file.bytes()).map_err(named(&update))?;
    let (boot, image) = (linked.boot_loader()?.len(), file.images[0].len());
    let [a, b] = [0, 1].map(|slot: usize| format!("{:08x}", CRC.checksum(&file.images[slot])));
    let json = serde_json::json!({
        "elf": elf, "update": update, "boot_bytes": boot, "image_bytes": image, "crc": [a, b],
    });
    let (elf, update) = (elf.display(), update.display());
    let text = format_args!(
        "{elf}: for a debug probe, boot loader of {boot} bytes\n\
         {update}: for `device update`, image of {image} bytes, CRC {a} in slot A, {b} in slot B"
    );
    super::print(common, &json, text)
}

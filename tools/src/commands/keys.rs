//! `gyronet keys`: a key pair for those who may write to boards.

use super::Common;
use gyronet_tools::signing::{PrivateKey, hex};
use std::io::{self, Write};
use std::path::PathBuf;

/// Make a key pair for signing files.
///
/// NAME.key stays with whoever signs, NAME.pub goes onto boards (`device set-key`).
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet keys fleet                # fleet.key and fleet.pub")]
pub struct Args {
    /// Begin of both files' names; neither may be there.
    #[arg(value_name = "NAME")]
    name: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args, common: Common) -> super::Result {
    let key = PrivateKey::generate()?;
    let [private, public] = key.write(&args.name)?;
    let out = &mut io::stdout().lock();
    if common.json {
        let found = serde_json::json!({ "private": private, "public": public, "key": hex(&key.public()) });
        return super::print_json(out, &found);
    }
    writeln!(
        out,
        "{}: keep it secret; who has it can write to every board with this key",
        private.display()
    )?;
    Ok(writeln!(out, "{}: gyronet device --port PORT set-key {}", public.display(), public.display())?)
}

//! `gyronet keys` creates a key pair for writing to boards.

use super::Common;
use gyronet_tools::signing::{PrivateKey, hex};
use std::path::PathBuf;

/// Create a key pair for writing to boards and for signing files.
///
/// The command writes two files. Keep the private key NAME.key secret, and store the public key NAME.pub on boards
/// (`device set-key`). Such a board then accepts writes only with the private key, or a signature made with it.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet keys fleet                # fleet.key and fleet.pub")]
pub struct Args {
    /// Name of both files without the ending; neither may exist.
    #[arg(value_name = "NAME")]
    name: PathBuf,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let key = PrivateKey::generate()?;
    let [private, public] = key.write(&args.name)?;
    let json = serde_json::json!({ "private": private, "public": public, "key": hex(&key.public()) });
    let (private, public) = (private.display(), public.display());
    let text = format_args!(
        "{private}: keep this file secret; anyone who has it can write to every board with this key\n\
         {public}: gyronet device --port PORT set-key {public}"
    );
    super::print(common, &json, text)
}

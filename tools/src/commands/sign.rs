//! `gyronet sign` signs a file for a board that stores a public key.

use super::Common;
use clap::ValueEnum;
use gyronet_tools::calibrate::unit_file;
use gyronet_tools::client::device::requests::{
    self, CONFIGURATION, FIRMWARE, KEY, UNIT, USE_DOWNLOAD, WHEELS,
};
use gyronet_tools::client::device::settings::from_value;
use gyronet_tools::client::device::update::Update;
use gyronet_tools::drive::error::{read, read_text};
use gyronet_tools::signing::{PrivateKey, read_public, unhex};
use gyronet_tools::wheels::WheelFile;
use std::path::PathBuf;

/// Sign a file for boards that store your public key.
///
/// The command writes a signature. A board with the public key then accepts the file once, from anyone
/// (`device ... --signature`).
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet sign new.blob --target weights --key fleet.key --counter 7 --out new.sig")]
pub struct Args {
    /// Weight file, firmware update, complete configuration (`device get --json`), wheel frames (.toml), unit file, or public key.
    file: PathBuf,
    /// Kind of the file.
    #[arg(long, value_enum)]
    target: Target,
    /// Private key, from `gyronet keys`.
    #[arg(long, value_name = "NAME.key")]
    key: PathBuf,
    /// Counter of this signature; it must be greater than all that the board has accepted (`device access`).
    #[arg(long)]
    counter: u32,
    /// Serial number of the only board that may accept the file (`device access`) [default: any with the key].
    #[arg(long, value_name = "HEX")]
    serial: Option<String>,
    /// Have firmware accepted even if it is older than the board's.
    #[arg(long)]
    downgrade: bool,
    /// Write the signature to this file.
    #[arg(long, value_name = "FILE.sig")]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Target {
    Weights,
    Firmware,
    Configuration,
    Wheels,
    Unit,
    Key,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let name = args.file.display().to_string();
    let (target, content) = match args.target {
        Target::Weights => (USE_DOWNLOAD, read(&args.file)?),
        Target::Firmware => {
            let Update { mut head, .. } = Update::parse(&read(&args.file)?)?;
            head.downgrade = args.downgrade;
            (FIRMWARE, head.bytes().to_vec())
        }
        Target::Configuration => {
            let value =
                serde_json::from_str(&read_text(&args.file)?).map_err(|error| format!("{name}: {error}"))?;
            (CONFIGURATION, requests::configuration_content(&from_value(value)?)?)
        }
        Target::Wheels => (WHEELS, requests::content(&WheelFile::read(&args.file)?.1)?),
        Target::Unit => (UNIT, requests::content(&Some(unit_file::read(&args.file)?))?),
        Target::Key => (KEY, read_public(&args.file)?.to_vec()),
    };
    let serial = args.serial.as_deref().map(|text| unhex(text).ok_or("--serial: not 24 hexadecimal digits"));
    let trailer = PrivateKey::read(&args.key)?.trailer(target, serial.transpose()?, args.counter, &content);
    std::fs::write(&args.out, trailer).map_err(super::named(&args.out))?;
    let (path, counter) = (&args.out, args.counter);
    let json = serde_json::json!({ "signature": path, "counter": counter });
    super::print(common, &json, format_args!("{}: signature {counter} of {name}", path.display()))
}

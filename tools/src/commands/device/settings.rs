//! Reads and changes the configuration of a board.

use super::{Board, done};
use crate::commands::{self, Common, Result};
use gyronet::store::{Configuration, Record};
use gyronet_tools::client::device::settings::{assign, from_value, to_value};
use gyronet_tools::drive::error::read_text;
use gyronet_tools::wheels::WheelFile;
use std::path::Path;

pub fn print(configuration: &Configuration, common: Common) -> Result {
    super::print_value(&to_value(configuration)?, common)
}

/// Changes single values of the board's configuration, replaces it by a file, or writes wheel frames.
pub fn set(device: &mut Board, settings: &[String], file: Option<&Path>, common: Common) -> Result {
    if settings.is_empty() && file.is_none() {
        return Err("nothing to set: give NAME=VALUE, or --file".into());
    }
    if let Some(path) = file.filter(|path| path.extension().is_some_and(|end| end == "toml")) {
        if !settings.is_empty() {
            return Err(
                "NAME=VALUE and a file of wheel frames cannot be set together: set one, then the other"
                    .into(),
            );
        }
        device.set_wheels(&WheelFile::read(path)?.1)?;
        return done(common, "stored; it takes effect after a restart");
    }
    let mut wanted = match file {
        Some(path) => {
            serde_json::from_str(&read_text(path)?).map_err(|e| format!("{}: {e}", path.display()))?
        }
        None => to_value(&device.configuration()?)?,
    };
    for setting in settings {
        assign(&mut wanted, setting)?;
    }
    let configuration = from_value(wanted)?;
    configuration.check()?;
    device.set_configuration(&configuration)?;
    done(common, "stored; it takes effect after a restart")
}

/// Prints the settings of the wheel frames as a file for `set --file`.
pub fn print_wheels(device: &mut Board, common: Common) -> Result {
    let file = WheelFile::of(&device.wheels()?);
    commands::print(common, &file, toml::to_string(&file)?.trim_end())
}

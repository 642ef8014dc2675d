//! `gyronet reference` prints the tables of settings, data identifiers, troubles and states.

use super::Common;
use clap::ValueEnum;
use gyronet_tools::reference;

/// Print a Markdown table of settings, data identifiers, troubles or states.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet reference settings
  gyronet reference troubles --json")]
pub struct Args {
    #[arg(value_enum)]
    table: Name,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Name {
    /// Settings of `device get` and `device set`, with ranges and defaults.
    Settings,
    /// Data identifiers of diagnosis.
    Identifiers,
    /// Trouble codes of diagnosis.
    Troubles,
    /// States of the yaw rate.
    States,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let table = match args.table {
        Name::Settings => reference::settings(),
        Name::Identifiers => reference::identifiers(),
        Name::Troubles => reference::troubles(),
        Name::States => reference::states(),
    };
    super::print(common, &table.json(), table.to_string().trim_end())
}

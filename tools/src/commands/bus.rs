//! `gyronet bus`: what is sent, and what it costs.

use super::Common;
use embedded_can::Id;
use gyronet::can::config::{Config, Settings, Vdc2Settings};
use std::io::{self, Write};

/// Print the messages of the configurations that come with the library: identifiers, periods, the
/// load of the bus with as many stuff bits as there can be, and of SLCAN lines.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {}

/// Runs the subcommand.
pub fn run(_: &Args, _: Common) -> super::Result {
    let vdc2 = Some(Vdc2Settings { source: 0x80 });
    let all = Config::new(Settings { vdc2, ..Settings::DEFAULT })?;
    let mut out = io::stdout().lock();
    for (name, config) in [
        ("default", Config::DEFAULT),
        ("for SLCAN at 115200 bit/s", Config::SLCAN_115200),
        ("default and J1939 VDC2", all),
    ] {
        writeln!(out, "{name}")?;
        for message in config.messages() {
            let id = match message.id {
                Id::Standard(id) => format!("{:03X}", id.as_raw()),
                Id::Extended(id) => format!("{:08X}", id.as_raw()),
            };
            let (period, bits) = (message.period_ms, message.worst_case_bits());
            writeln!(out, "  {id:>8}  every {period:>2} ms  {bits} bits at worst")?;
        }
        let rate = config.settings().bits_per_second;
        writeln!(out, "  bus, {} kbit/s: {}", rate / 1_000, percent(config.bus_load_per_mille()))?;
        for line in [115_200, 460_800, 921_600] {
            let [plain, stamped] =
                [false, true].map(|stamped| percent(config.line_load_per_mille(line, stamped)));
            writeln!(out, "  SLCAN, {line} bit/s: {plain}, with time stamps {stamped}")?;
        }
    }
    Ok(())
}

fn percent(per_mille: u32) -> String {
    let fits = if per_mille > 1_000 { " (does not fit)" } else { "" };
    format!("{}.{} %{fits}", per_mille / 10, per_mille % 10)
}

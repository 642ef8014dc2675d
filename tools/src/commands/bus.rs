//! `gyronet bus`: what is sent, and what it costs.

use super::{Common, print_json};
use embedded_can::Id;
use gyronet::can::config::{Config, Settings, Vdc2Settings};
use std::io::{self, Write};

/// Print what is sent on CAN, and what it costs.
///
/// For each configuration that comes with the library: identifiers, periods (ms), the load of the bus
/// with as many stuff bits as there can be, and of SLCAN lines.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {}

/// Rates of serial lines, bit/s.
const LINES: [u32; 3] = [115_200, 460_800, 921_600];

/// Runs the subcommand.
pub fn run(_: &Args, common: Common) -> super::Result {
    let vdc2 = Some(Vdc2Settings { source: 0x80 });
    let all = Config::new(Settings { vdc2, ..Settings::DEFAULT })?;
    let configs = [
        ("default", Config::DEFAULT),
        ("for SLCAN at 115200 bit/s", Config::SLCAN_115200),
        ("default and J1939 VDC2", all),
    ];
    let mut out = io::stdout().lock();
    if common.json {
        return print_json(&mut out, &configs.map(|(name, config)| json(name, &config)));
    }
    for (name, config) in configs {
        writeln!(out, "{name}")?;
        for message in config.messages() {
            let id = hexadecimal(message.id);
            let (period, bits) = (message.period_ms, message.worst_case_bits());
            writeln!(out, "  {id:>8}  every {period:>2} ms  {bits} bits at worst")?;
        }
        let rate = config.settings().bits_per_second;
        writeln!(out, "  bus, {} kbit/s: {}", rate / 1_000, percent(config.bus_load_per_mille()))?;
        for line in LINES {
            let [plain, stamped] =
                [false, true].map(|stamped| percent(config.line_load_per_mille(line, stamped)));
            writeln!(out, "  SLCAN, {line} bit/s: {plain}, with time stamps {stamped}")?;
        }
    }
    Ok(())
}

fn json(name: &str, config: &Config) -> serde_json::Value {
    let messages: Vec<_> = config
        .messages()
        .iter()
        .map(|message| {
            let (id, bits) = (hexadecimal(message.id), message.worst_case_bits());
            serde_json::json!({ "id": id, "period_ms": message.period_ms, "worst_case_bits": bits })
        })
        .collect();
    let lines = LINES.map(|line| {
        let [plain, stamped] = [false, true].map(|stamped| config.line_load_per_mille(line, stamped));
        serde_json::json!({ "bits_per_second": line, "load_per_mille": plain, "load_with_stamps_per_mille": stamped })
    });
    serde_json::json!({
        "name": name,
        "messages": messages,
        "bits_per_second": config.settings().bits_per_second,
        "load_per_mille": config.bus_load_per_mille(),
        "slcan_lines": lines,
    })
}

fn hexadecimal(id: Id) -> String {
    match id {
        Id::Standard(id) => format!("{:03X}", id.as_raw()),
        Id::Extended(id) => format!("{:08X}", id.as_raw()),
    }
}

fn percent(per_mille: u32) -> String {
    let fits = if per_mille > 1_000 { " (does not fit)" } else { "" };
    format!("{}.{} %{fits}", per_mille / 10, per_mille % 10)
}

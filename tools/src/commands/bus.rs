//! `gyronet bus` prints the CAN messages and the bus load.

use super::{Common, print_json};
use embedded_can::Id;
use gyronet::can::config::Config;
use gyronet::can::fog_encoder::FogEncoder;
use gyronet::can::load::{Periodic, per_mille};
use gyronet::can::yaw::FOG_IDS;
use std::io::{self, Write};

/// Print the CAN messages that a board sends, and the bus load.
///
/// For each of three configurations the command prints the identifier, period (ms) and worst-case length (bits) of
/// every message. It also prints the load of the CAN bus with the most stuff bits possible, and the load of SLCAN
/// lines. A board sends the messages of a fibre-optic gyro once the gyro's first data arrive, or from the start if
/// such a gyro is configured.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {}

/// Baud rates of the serial lines, bit/s.
const LINES: [u32; 3] = [115_200, 460_800, 921_600];

/// The messages of one configuration, which share a bus.
struct Traffic {
    name: &'static str,
    messages: Vec<Periodic>,
    bits_per_second: u32,
}

impl Traffic {
    fn new(name: &'static str, config: &Config, further: &[Periodic]) -> Self {
        let messages = config.messages().iter().chain(further).copied().collect();
        Self { name, messages, bits_per_second: config.settings().bits_per_second }
    }

    fn bus_load(&self) -> u32 {
        per_mille(&self.messages, Periodic::worst_case_bits, self.bits_per_second)
    }

    fn line_load(&self, line: u32, stamped: bool) -> u32 {
        per_mille(&self.messages, |message| message.slcan_bits(stamped), line)
    }
}

pub fn run(_: &Args, common: Common) -> super::Result {
    let traffics = [
        Traffic::new("default", &Config::DEFAULT, &[]),
        Traffic::new("default, with a fibre-optic gyro", &Config::DEFAULT, &FogEncoder::messages(FOG_IDS)),
        Traffic::new("for SLCAN at 115200 bit/s", &Config::SLCAN_115200, &[]),
    ];
    let mut out = io::stdout().lock();
    if common.json {
        return print_json(&mut out, &traffics.each_ref().map(json));
    }
    for traffic in &traffics {
        writeln!(out, "{}", traffic.name)?;
        for message in &traffic.messages {
            let id = hexadecimal(message.id);
            let (period, bits) = (message.period_ms, message.worst_case_bits());
            writeln!(out, "  {id:>8}  every {period:>2} ms  {bits} bits at worst")?;
        }
        let rate = traffic.bits_per_second;
        writeln!(out, "  bus, {} kbit/s: {}", rate / 1_000, percent(traffic.bus_load()))?;
        for line in LINES {
            let [plain, stamped] = [false, true].map(|stamped| percent(traffic.line_load(line, stamped)));
            writeln!(out, "  SLCAN, {line} bit/s: {plain}, with time stamps {stamped}")?;
        }
    }
    Ok(())
}

fn json(traffic: &Traffic) -> serde_json::Value {
    let messages = traffic.messages.iter().map(|message| {
        let (id, bits) = (hexadecimal(message.id), message.worst_case_bits());
        serde_json::json!({ "id": id, "period_ms": message.period_ms, "worst_case_bits": bits })
    });
    let lines = LINES.map(|line| {
        let [plain, stamped] = [false, true].map(|stamped| traffic.line_load(line, stamped));
        serde_json::json!({ "bits_per_second": line, "load_per_mille": plain, "load_with_stamps_per_mille": stamped })
    });
    serde_json::json!({
        "name": traffic.name,
        "messages": messages.collect::<Vec<_>>(),
        "bits_per_second": traffic.bits_per_second,
        "load_per_mille": traffic.bus_load(),
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

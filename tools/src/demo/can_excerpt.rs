//! The messages of a drive, and those of one sample in words.

use crate::board::{Board, Step};
use crate::drive::candump::Log;
use crate::drive::replay::Steps;
use crate::drive::stream::Drive;
use embedded_can::{Frame, Id};
use gyronet::can::bosch::{self, LAYOUTS};
use gyronet::can::config::Config;
use gyronet::can::yaw::{AngleMessage, DetailMessage, RateMessage, SIGMA_UNKNOWN};
use gyronet::can::{DataFrame, j1939::Vdc2};
use gyronet::coprocessor::{self, TimedFrame};
use gyronet::model::WindowNetwork;
use gyronet::units::Micros;
use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Message {
    /// The time of its sample since the recording's first, s.
    pub time: String,
    pub name: String,
    pub id: String,
    pub data: String,
    /// The content in words.
    pub says: String,
}

/// The frames that the board sends on a drive.
#[derive(Debug, Default)]
pub struct Sent {
    /// The step with the fastest turn after static initialisation.
    pub fastest: Option<Step>,
    pub frames: u64,
}

impl Sent {
    pub fn run(
        drive: &Drive<'_>,
        network: impl WindowNetwork,
        out: impl std::io::Write,
    ) -> Result<Self, Box<dyn std::error::Error>> {
        let (mut sent, mut log) = (Self::default(), Log::new(out));
        for step in Steps::new(drive, Board::new(coprocessor::Config::DEFAULT, drive.wheels(), network))? {
            let step = step?;
            for TimedFrame { frame, time } in &step.frames {
                log.frame(*time, frame)?;
            }
            let rate = |step: &Step| step.vehicle.live.rate.0.unsigned_abs();
            let fastest = sent.fastest.as_ref().is_none_or(|fastest| rate(&step) >= rate(fastest));
            if step.is_compared && fastest {
                sent.fastest = Some(step);
            }
        }
        sent.frames = log.finish()?;
        Ok(sent)
    }
}

/// The messages of a step in words; `first` is the time of the drive's first sample.
pub fn in_words(step: Option<&Step>, first: Micros, config: Config) -> Vec<Message> {
    let Some(step) = step else { return Vec::new() };
    let time = format!("{:.2}", (step.time.0 - first.0) as f64 * 1e-6);
    let message = |frame: &DataFrame| {
        let (name, says) = read(frame, &config)?;
        let id = match frame.id() {
            Id::Standard(id) => format!("{:03X}", id.as_raw()),
            Id::Extended(id) => format!("{:08X}", id.as_raw()),
        };
        let data: Vec<String> = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
        Some(Message { time: time.clone(), name, id, data: data.join(" "), says })
    };
    step.frames.iter().filter_map(|sent| message(&sent.frame)).collect()
}

/// Returns the name and content of a message.
fn read(frame: &DataFrame, config: &Config) -> Option<(String, String)> {
    let data = frame.data();
    if let Some(number) = LAYOUTS.iter().position(|layout| Id::Standard(layout.id) == frame.id()) {
        let says = bosch_says(&LAYOUTS[number], &bosch::Message::parse(data).ok()?);
        return Some((format!("MM5_10_TX{}", number + 1), says));
    }
    let Id::Standard(id) = frame.id() else {
        let rate = Vdc2::parse(data).ok()?.yaw_rate_rad_per_sec()?;
        return Some(("VDC2".into(), format!("yaw rate {rate:+.4} rad/s")));
    };
    let yaw = config.settings().yaw?;
    let (name, says) = match yaw.ids.iter().position(|own| *own == id.as_raw())? {
        0 => {
            let message = RateMessage::parse(data).ok()?;
            let rate =
                message.deg_per_sec().map_or("not available".into(), |rate| format!("{rate:+.6} deg/s"));
            let quality = format!("{:?}", message.quality).to_lowercase();
            ("GyroNet_Rate", format!("yaw rate {rate}, from {:?}, {quality}", message.source))
        }
        1 => {
            let message = AngleMessage::parse(data).ok()?;
            let faults = crate::client::monitor::fault_names(message.faults);
            ("GyroNet_Angle", format!("yaw {:+.6} deg, faults: {faults}", message.deg()))
        }
        _ => {
            let message = DetailMessage::parse(data).ok()?;
            let correction = f64::from(message.correction) * 2e-4;
            let known = message.sigma != SIGMA_UNKNOWN;
            let sigma = if known { format!("{:.5}", f64::from(message.sigma) * 1e-5) } else { "-".into() };
            let latency = message.latency_ms().map_or("-".into(), |ms| format!("{ms}"));
            let says =
                format!("correction {correction:+.4} deg/s, expected error {sigma} deg/s, {latency} ms old");
            ("GyroNet_Detail", says)
        }
    };
    Some((name.into(), says))
}

fn bosch_says(layout: &bosch::Layout, message: &bosch::Message) -> String {
    let rate = ["roll", "pitch", "yaw"][layout.rate_axis];
    let force = ["forward", "left", "up"][layout.force_axis];
    format!(
        "{rate} rate {:+.3} deg/s, acceleration {force} {:+.4} g, counter {}",
        message.rate_deg_per_sec(),
        message.acceleration_g(),
        message.counter
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use gyronet::model::{Blob, GyroNet, weights};

    #[test]
    fn the_two_rates_of_one_sample_are_read_from_the_bytes() {
        let recording = bundled::simulated_drive().unwrap();
        let network = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).unwrap());
        let drive = Drive::from(&recording);
        let sent = Sent::run(&drive, network, std::io::sink()).unwrap();
        let messages = in_words(sent.fastest.as_ref(), drive.facts.first, Config::DEFAULT);
        let names: Vec<&str> = messages.iter().map(|message| message.name.as_str()).collect();
        assert_eq!(
            names,
            ["MM5_10_TX1", "MM5_10_TX2", "MM5_10_TX3", "GyroNet_Rate", "GyroNet_Angle", "GyroNet_Detail"]
        );
        let fastest = sent.fastest.unwrap().vehicle.live.rate;
        let gyro = recording.rows.iter().map(|row| row.sample.angular_rate[2].rad_per_sec().abs());
        assert!((fastest.rad_per_sec().abs() - gyro.fold(0.0, f64::max)).abs() < 0.1, "{fastest:?}");
        let degrees = fastest.rad_per_sec().to_degrees();
        let said: f64 = messages[0].says.split(' ').nth(2).unwrap().parse().unwrap();
        assert!((said - degrees).abs() < 0.01, "{said} {degrees}");
    }
}

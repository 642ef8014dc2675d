//! The board's output task on the host: bytes of an Xsens MTi in, SLCAN lines out.

use crate::recordings::Row;
use gyronet::can::config::Config;
use gyronet::can::feeds::Feeds;
use gyronet::can::{DataFrame, slcan};
use gyronet::guard::{Guard, TIMEOUT_US};
use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::PERIOD_US;
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::units::Micros;
use gyronet::vehicle::VehicleSample;

/// What the image sends.
pub const CONFIG: Config = Config::DEFAULT;

/// The message that an MTi would send for a row.
#[must_use]
pub fn message(number: usize, row: &Row) -> MtData2 {
    MtData2 {
        packet_counter: Some(number as u16),
        sample_time_fine: Some((row.time * 10_000.0).round() as u32),
        acceleration: Some(row.acceleration),
        rate_of_turn: Some(row.rate_of_turn),
        temperature: None,
        status: Some(3),
    }
}

/// What it sends when the vehicle is level and turns at `yaw_rate`, rad/s, 10 ms after 10 ms.
#[must_use]
pub fn turning(number: usize, yaw_rate: f32) -> Vec<u8> {
    // The least bits of a real part always move.
    let sign = if number.is_multiple_of(2) { 1.0 } else { -1.0 };
    let (force, rate) = (2e-6 * sign, 8e-9 * sign);
    let row = Row {
        time: number as f64 * 0.01,
        acceleration: [force, force, 9.81 + force],
        rate_of_turn: [rate, rate, yaw_rate + rate],
        reference: 0.0,
    };
    message(number, &row).emit().to_vec()
}

/// What the board must send for these bytes, line by line without the CR.
///
/// # Panics
/// When the library's own weights are refused.
#[must_use]
pub fn lines(bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut board = Board::new();
    board.push(bytes);
    board.lines
}

/// The board's output task on the host.
pub struct Board {
    network: GyroNet<'static>,
    mti: Mti,
    guard: Guard,
    feeds: Feeds,
    /// Silent for so many message sets.
    silent: u64,
    /// What it has sent.
    pub lines: Vec<Vec<u8>>,
}

impl Default for Board {
    fn default() -> Self {
        Self::new()
    }
}

impl Board {
    /// Nothing received yet.
    ///
    /// # Panics
    /// When the library's own weights are refused.
    #[must_use]
    pub fn new() -> Self {
        let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
        Self {
            network: GyroNet::new(blob),
            mti: Mti::new(),
            guard: Guard::new(PipelineConfig::DEFAULT),
            feeds: Feeds::new(CONFIG),
            silent: 0,
            lines: Vec::new(),
        }
    }

    /// The sensor sends.
    pub fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.mti.push(*byte);
            while let Some(sample) = self.mti.next_sample() {
                let Ok(Ok(output)) = sample.map(|sample| self.guard.process(sample, Micros(0))) else {
                    continue;
                };
                self.silent = 0;
                if let Some(due) = output.window {
                    self.guard.pipeline().deliver(due.end, self.network.estimate(&due.features));
                }
                self.send(&output.vehicle);
            }
        }
    }

    /// The sensor is silent for so many message sets.
    ///
    /// # Panics
    /// When the guard does not say so.
    pub fn silence(&mut self, sets: u64) {
        for set in self.silent..self.silent + sets {
            let now = Micros(TIMEOUT_US + set * PERIOD_US);
            let vehicle = self.guard.poll(now).expect("the sensor is silent");
            self.send(&vehicle);
        }
        self.silent += sets;
    }

    fn send(&mut self, vehicle: &VehicleSample) {
        for frame in self.feeds.process::<DataFrame>(vehicle) {
            let line = slcan::emit(&frame).expect("a data frame");
            self.lines.push(line.strip_suffix(b"\r").expect("a CR").to_vec());
        }
    }
}

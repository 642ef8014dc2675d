//! The image's output task on the host: bytes of an Xsens MTi and wheel frames go in, SLCAN lines come out. Like the
//! image, it does the input and output around the library's [`Coprocessor`].

use crate::synthetic;
use gyronet::can::{DataFrame, slcan};
use gyronet::coprocessor::{self, Clock, Coprocessor, TimedFrame};
use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
use gyronet::sample::ImuSample;
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::store::{Calibration, Configuration, Learned};
use gyronet::units::Micros;
use gyronet_tools::drive::wheel_frames::receiver;

/// Returns the bytes of message `number` of an MTi, one every 10 ms, when the vehicle is level and turns at
/// `yaw_rate`, rad/s.
pub fn turning(number: usize, yaw_rate: f64) -> Vec<u8> {
    let mut sample = synthetic::turning(number as u64, synthetic::rate(yaw_rate));
    // The lowest bits of a real part always change.
    let sign = if number.is_multiple_of(2) { 1 } else { -1 };
    sample.specific_force.iter_mut().for_each(|force| force.0 += 2 * sign);
    sample.angular_rate.iter_mut().for_each(|rate| rate.0 += sign);
    message(number, &sample)
}

pub fn message(number: usize, sample: &ImuSample) -> Vec<u8> {
    MtData2::of(sample, number as u16).emit().to_vec()
}

/// Returns the lines that the board must send for these bytes, without the CR.
pub fn lines(bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut board = Board::new();
    board.push(bytes);
    board.lines
}

/// Bytes arrive at the host's pace: the clock is the sensor's.
const NOW: Micros = Micros(0);

/// Runs the board's output task on the host.
pub struct Board {
    coprocessor: Coprocessor,
    network: GyroNet<'static>,
    mti: Mti,
    pub lines: Vec<Vec<u8>>,
}

impl Default for Board {
    fn default() -> Self {
        Self::new()
    }
}

impl Board {
    /// Returns a board that has received nothing yet.
    pub fn new() -> Self {
        let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
        Self::configured(&Configuration::DEFAULT, blob)
    }

    pub fn configured(configuration: &Configuration, blob: Blob<'static>) -> Self {
        Self::experienced(configuration, &Learned::NOTHING, blob)
    }

    /// Returns a board that has learnt on earlier drives.
    pub fn experienced(configuration: &Configuration, learned: &Learned, blob: Blob<'static>) -> Self {
        let config = coprocessor::Config {
            wheels: Some(receiver()),
            clock: Clock::Sensor,
            ..configuration.coprocessor(&Calibration::NONE, learned, blob.crc)
        };
        Self {
            coprocessor: Coprocessor::new(config),
            network: GyroNet::new(blob),
            mti: Mti::new(),
            lines: Vec::new(),
        }
    }

    pub fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.mti.receive(*byte);
            while let Some(sample) = self.mti.next_sample() {
                let Ok(sample) = sample else { continue };
                let Self { coprocessor, lines, .. } = self;
                // A sample out of order gives no line.
                let _ = coprocessor.imu(sample, NOW, &mut |sent: TimedFrame| lines.push(line(&sent)));
                self.estimate();
            }
        }
    }

    pub fn can(&mut self, frame: &DataFrame) {
        // A wrong frame shows as silent wheels.
        let _ = self.coprocessor.can(frame, NOW);
    }

    fn estimate(&mut self) {
        if let Some(due) = self.coprocessor.window() {
            let estimate = self.network.estimate(&due.features);
            self.coprocessor.deliver(due.end, estimate).expect("the window that is due");
        }
    }
}

fn line(sent: &TimedFrame) -> Vec<u8> {
    let line = slcan::emit(&sent.frame).expect("a data frame");
    line.strip_suffix(b"\r").expect("a CR").to_vec()
}

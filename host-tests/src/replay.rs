//! The image's output task on the host: bytes of an Xsens MTi and wheel frames go in, frames come out.

use crate::synthetic;
use gyronet::can::DataFrame;
use gyronet::coprocessor::{self, Clock, Coprocessor, TimedFrame};
use gyronet::model::{Blob, GyroNet, weights};
use gyronet::sample::ImuSample;
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::sensor::{ByteSource, Source};
use gyronet::store::{Calibration, Configuration, Learned};
use gyronet::units::Micros;
use gyronet_tools::drive::wheel_frames::receiver;

/// The bytes of message `number` of an MTi, one every 10 ms, when the vehicle is level and turns at
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

/// The frames that a board with the built-in configuration must send for these bytes.
pub fn frames(bytes: &[u8]) -> Vec<DataFrame> {
    let mut board = Board::default();
    board.push(bytes);
    board.frames
}

/// Bytes arrive at the host's pace: the clock is the sensor's.
const NOW: Micros = Micros(0);

pub struct Board {
    coprocessor: Coprocessor,
    network: GyroNet<'static>,
    mti: Mti,
    pub frames: Vec<DataFrame>,
}

impl Default for Board {
    fn default() -> Self {
        let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
        Self::new(&Configuration::DEFAULT, &Learned::NOTHING, blob)
    }
}

impl Board {
    pub fn new(configuration: &Configuration, learned: &Learned, blob: Blob<'static>) -> Self {
        let config = coprocessor::Config {
            wheels: Some(receiver()),
            clock: Clock::Sensor,
            ..configuration.coprocessor(&Calibration::NONE, learned, blob.crc)
        };
        Self {
            coprocessor: Coprocessor::new(config),
            network: GyroNet::new(blob),
            mti: Mti::new(),
            frames: Vec::new(),
        }
    }

    pub fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.mti.receive(*byte);
            while let Some(sample) = self.mti.next_sample() {
                let Ok(sample) = sample else { continue };
                let Self { coprocessor, network, frames, .. } = self;
                // A sample out of order gives no frame.
                let _ = coprocessor.imu(sample, NOW, &mut |sent: TimedFrame| frames.push(sent.frame));
                coprocessor.estimate(network);
            }
        }
    }

    pub fn can(&mut self, frame: &DataFrame) {
        // A wrong frame shows as silent wheels.
        let _ = self.coprocessor.can(frame, NOW);
    }
}

//! The image's output task on the host: bytes of an Xsens MTi and a DSP-1760 and wheel frames go in,
//! SLCAN lines come out. Like the image, it does the input and output around the library's [`Coprocessor`].

use crate::synthetic;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::can::{DataFrame, slcan};
use gyronet::coprocessor::{self, Clock, Coprocessor, TimedFrame};
use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
use gyronet::monitor::{START_US, TIMEOUT_US};
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::store::{Calibration, Configuration, Learned};
use gyronet::units::Micros;

/// Compares what a board has sent with what it must send, line by line.
pub fn assert_same(lines: &[Vec<u8>], expected: &[Vec<u8>]) {
    let text = |line: &[u8]| line.escape_ascii().to_string();
    for (number, (line, expected)) in lines.iter().zip(expected).enumerate() {
        assert_eq!(text(line), text(expected), "line {number}");
    }
    assert!(lines.len() >= expected.len(), "{} lines, {} expected", lines.len(), expected.len());
}

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

/// Returns the bytes of message `number` of an MTi.
pub fn message(number: usize, sample: &ImuSample) -> Vec<u8> {
    MtData2::of(sample, number as u16).emit().to_vec()
}

/// Returns the lines that the board must send for these bytes, without the CR.
pub fn lines(bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut board = Board::new();
    board.push(bytes);
    board.lines
}

/// Runs the board's output task on the host.
pub struct Board {
    coprocessor: Coprocessor,
    network: GyroNet<'static>,
    mti: Mti,
    dsp1760: Dsp1760,
    /// Board time, which passes only while the sensor is silent, since bytes arrive at the host's pace.
    now: Micros,
    /// The lines that another board has sent: see [`Board::following`].
    board_lines: Vec<Vec<u8>>,
    /// Number of message sets for which the sensor has been silent.
    silent: u64,
    /// The number of message sets without a rate that were followed.
    pub followed: u64,
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

    /// Returns a board with this configuration and these weights.
    pub fn configured(configuration: &Configuration, blob: Blob<'static>) -> Self {
        let wheels = WheelReceiver::new(WheelSettings::TOYOTA).expect("checked settings");
        let config = coprocessor::Config {
            wheels: Some(wheels),
            clock: Clock::Sensor,
            has_fognet: false,
            ..configuration.coprocessor(&Calibration::NONE, &Learned::NOTHING, 0)
        };
        Self {
            coprocessor: Coprocessor::new(config),
            network: GyroNet::new(blob),
            mti: Mti::new(),
            dsp1760: Dsp1760::new(Dsp1760Config::DEFAULT),
            now: Micros(0),
            board_lines: Vec::new(),
            silent: 0,
            followed: 0,
            lines: Vec::new(),
        }
    }

    /// Returns a board that follows another one, given the lines that it has sent. Where the other board, by its own
    /// clock, finds the sensor silent and reports that, this board reports it too. Everything else must be the same.
    pub fn following(lines: Vec<Vec<u8>>) -> Self {
        Self::new().follow_lines(lines)
    }

    pub fn follow_lines(self, lines: Vec<Vec<u8>>) -> Self {
        Self { board_lines: lines, ..self }
    }

    /// Sends the message sets without a rate that the other board has sent before the next sample.
    fn follow(&mut self) {
        loop {
            let mut coprocessor = self.coprocessor.clone();
            let now = self.next_silence();
            let mut set = Vec::new();
            if !matches!(coprocessor.poll(now, &mut |sent: TimedFrame| set.push(line(&sent))), Ok(Some(_))) {
                return;
            }
            let at = self.lines.len();
            if self.board_lines.get(at..at + set.len()) != Some(&set[..]) {
                return;
            }
            (self.coprocessor, self.now) = (coprocessor, now);
            self.lines.extend(set);
            self.silent += 1;
            self.followed += 1;
        }
    }

    /// Returns the time at which the next message set without a sample is due.
    fn next_silence(&self) -> Micros {
        let first = if self.lines.is_empty() { START_US } else { TIMEOUT_US };
        Micros(self.now.0 + if self.silent == 0 { first } else { PERIOD_US })
    }

    pub fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.mti.receive(*byte);
            while let Some(sample) = self.mti.next_sample() {
                let Ok(sample) = sample else { continue };
                self.follow();
                let Self { coprocessor, lines, .. } = self;
                if coprocessor.imu(sample, self.now, &mut |sent: TimedFrame| lines.push(line(&sent))).is_ok()
                {
                    self.silent = 0;
                }
                self.estimate();
            }
        }
    }

    pub fn wheel(&mut self, frame: &DataFrame) {
        // A wrong frame shows as silent wheels.
        let _ = self.coprocessor.can(frame, self.now);
    }

    pub fn push_fog(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.dsp1760.receive(*byte);
            while let Some(sample) = self.dsp1760.next_sample() {
                if let Ok(sample) = sample {
                    // Silence may come before this sample or after it.
                    self.follow();
                    // A sample without a place in time is counted.
                    let Self { coprocessor, lines, .. } = self;
                    let _ =
                        coprocessor.fog(sample, self.now, &mut |sent: TimedFrame| lines.push(line(&sent)));
                    self.estimate();
                    self.follow();
                }
            }
        }
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

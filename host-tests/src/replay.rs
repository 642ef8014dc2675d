//! The board's output task on the host: bytes of an Xsens MTi and a DSP-1760 and wheel frames in,
//! SLCAN lines out.

use crate::recordings::Row;
use gyronet::can::config::Config;
use gyronet::can::feeds::Feeds;
use gyronet::can::fog_feed::FogFeed;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::can::{DataFrame, slcan};
use gyronet::fog::FogConfig;
use gyronet::fog::lane::{FogCounters, FogLane};
use gyronet::guard::{Guard, START_US, TIMEOUT_US};
use gyronet::health::Faults;
use gyronet::model::fognet::{FogNetState, MinuteNetwork};
use gyronet::model::{Blob, FogBlob, FogNet, GyroNet, WindowNetwork, weights};
use gyronet::sample::{PERIOD_US, WheelSample};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::store::{Calibration, Configuration};
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
    wheels: WheelReceiver,
    wheels_known: Option<WheelSample>,
    dsp1760: Dsp1760,
    lane: FogLane,
    fog_network: FogNet<'static, 'static>,
    fog_feed: FogFeed,
    sample_time: Micros,
    stored_damaged: bool,
    configuration_lost: bool,
    /// What an emulated board has sent: see [`Board::following`].
    heard: Vec<Vec<u8>>,
    /// Silent for so many message sets.
    silent: u64,
    /// Message sets without a rate that were followed.
    pub followed: u64,
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
        Self::configured(&Configuration::DEFAULT, blob)
    }

    /// With another configuration, on other weights.
    ///
    /// # Panics
    /// When the configuration, or FoGNet's own weights, are refused.
    #[must_use]
    pub fn configured(configuration: &Configuration, blob: Blob<'static>) -> Self {
        let config = Config::new(configuration.can).expect("a configuration that can be stored");
        let fog_blob = FogBlob::new_checked(&weights::FOGNET.0).expect("they come with the library");
        let mut lane = FogLane::new(FogConfig::DEFAULT, true);
        if configuration.fog.is_some() {
            lane.expect(Micros(0));
        }
        Self {
            network: GyroNet::new(blob),
            mti: Mti::new(),
            guard: Guard::new(configuration.pipeline(&Calibration::NONE)),
            feeds: Feeds::new(config),
            wheels: WheelReceiver::new(WheelSettings::TOYOTA).expect("checked settings"),
            wheels_known: None,
            dsp1760: Dsp1760::new(Dsp1760Config::DEFAULT),
            lane,
            fog_network: FogNet::new(fog_blob, Box::leak(Box::new(FogNetState::ZERO))),
            fog_feed: FogFeed::new(configuration.fog_ids),
            sample_time: Micros(0),
            stored_damaged: false,
            configuration_lost: false,
            heard: Vec::new(),
            silent: 0,
            followed: 0,
            lines: Vec::new(),
        }
    }

    /// Beside an emulated board that has sent these lines. A busy host may keep its bytes back for
    /// so long that it finds the sensor silent, by its own clock, and says so; where it has, this one
    /// says so, too. All else must be the same.
    #[must_use]
    pub fn following(lines: Vec<Vec<u8>>) -> Self {
        Self::new().beside(lines)
    }

    /// The same, beside one that was configured.
    #[must_use]
    pub fn beside(self, lines: Vec<Vec<u8>>) -> Self {
        Self { heard: lines, ..self }
    }

    /// Found something damaged at its start, perhaps the configuration itself.
    #[must_use]
    pub fn damaged(self, configuration_lost: bool) -> Self {
        Self { stored_damaged: true, configuration_lost, ..self }
    }

    /// Says what the emulated board has said before anything else came.
    fn follow(&mut self) {
        loop {
            let (mut guard, mut feeds) = (self.guard.clone(), self.feeds);
            let Some(vehicle) = guard.poll(Micros(TIMEOUT_US + self.silent * PERIOD_US)) else {
                return;
            };
            let set = lines_of(&mut feeds, &self.told(vehicle));
            let at = self.lines.len();
            if self.heard.get(at..at + set.len()) != Some(&set[..]) {
                return;
            }
            (self.guard, self.feeds) = (guard, feeds);
            self.lines.extend(set);
            self.silent += 1;
            self.followed += 1;
        }
    }

    /// The sensor sends.
    pub fn push(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.mti.push(*byte);
            while let Some(sample) = self.mti.next_sample() {
                let Ok(sample) = sample else { continue };
                self.follow();
                self.sample_time = sample.time;
                self.wheels_known = self.wheels.poll(sample.time);
                if let Some(known) = self.wheels_known {
                    self.guard.wheels(known);
                }
                let Ok(output) = self.guard.process(sample, Micros(0)) else { continue };
                self.silent = 0;
                if let Some(due) = output.window {
                    self.guard.pipeline().deliver(due.end, self.network.estimate(&due.features));
                }
                self.send(output.vehicle);
                self.fog_out();
            }
        }
    }

    /// A wheel frame comes.
    pub fn wheel(&mut self, frame: &DataFrame) {
        // What is wrong with one, the wheels' silence tells.
        let _ = self.wheels.process(frame, self.sample_time);
    }

    /// The fibre-optic gyro sends.
    pub fn push_fog(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.dsp1760.push(*byte);
            while let Some(sample) = self.dsp1760.next_sample() {
                if let Ok(sample) = sample {
                    self.lane.push(self.sample_time, sample);
                    self.fog_out();
                }
            }
        }
    }

    /// What became of the fibre-optic gyro.
    #[must_use]
    pub fn fog(&self) -> &FogCounters {
        self.lane.counters()
    }

    fn fog_out(&mut self) {
        let inertial = self.guard.pipeline().inertial();
        self.follow();
        while let Some(yaw) = self.lane.next_step(self.sample_time, inertial, self.wheels_known.as_ref()) {
            for frame in self.fog_feed.process::<DataFrame>(&yaw) {
                self.lines.push(line(&frame));
            }
            if let Some((number, window)) = self.lane.window() {
                let estimate = self.fog_network.estimate(&window);
                self.lane.deliver(number, estimate);
            }
        }
    }

    /// The sensor is silent for so many message sets; from the start, where it has sent nothing yet.
    ///
    /// # Panics
    /// When the guard does not say so.
    pub fn silence(&mut self, sets: u64) {
        let begin = if self.lines.is_empty() { START_US } else { TIMEOUT_US };
        for set in self.silent..self.silent + sets {
            let now = Micros(begin + set * PERIOD_US);
            let vehicle = self.guard.poll(now).expect("the sensor is silent");
            self.send(vehicle);
        }
        self.silent += sets;
    }

    /// As the image tells it.
    fn told(&self, mut vehicle: VehicleSample) -> VehicleSample {
        if self.stored_damaged {
            vehicle.yaw.faults = vehicle.yaw.faults.with(Faults::STORED);
        }
        if self.configuration_lost {
            vehicle.doubt();
        }
        vehicle
    }

    fn send(&mut self, vehicle: VehicleSample) {
        let vehicle = self.told(vehicle);
        let lines = lines_of(&mut self.feeds, &vehicle);
        self.lines.extend(lines);
    }
}

fn lines_of(feeds: &mut Feeds, vehicle: &VehicleSample) -> Vec<Vec<u8>> {
    feeds.process::<DataFrame>(vehicle).iter().map(line).collect()
}

fn line(frame: &DataFrame) -> Vec<u8> {
    let line = slcan::emit(frame).expect("a data frame");
    line.strip_suffix(b"\r").expect("a CR").to_vec()
}

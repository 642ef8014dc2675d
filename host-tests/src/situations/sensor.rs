//! An inertial sensor on the vehicle: its errors, its clock, its faults, and the bytes that it sends.

use super::icm42688;
use super::ride::Travelled;
use super::vehicle::{Part, Vehicle};
use gyronet::sample::{ImuSample, Validity};
use gyronet::sensor::dsp1760::message::{self as dsp1760, Extra};
use gyronet::sensor::xsens::MtData2;
use gyronet::units::{AngularRate, CentiCelsius, Micros, SpecificForce};
use gyronet_tools::random::Random;

/// Range of an MTi, rad/s and m/s^2, and the clipping bits of its status word.
const MTI_RANGE: [f64; 2] = [7.85, 98.0];
const MTI_CLIPPED: u32 = 0x3F << 8;
/// Self-test passed, filter valid.
const MTI_GOOD: u32 = 3;

/// Earth's rate, rad/s, and the latitude of all rides, deg.
const EARTH_RATE: f64 = 7.292_115e-5;
pub const LATITUDE: f32 = 48.0;

/// Something that lasts from one time to another, s.
#[derive(Debug, Clone, Copy)]
pub struct During<T> {
    pub from: f64,
    pub to: f64,
    pub what: T,
}

impl<T> During<T> {
    pub fn holds(&self, time: f64) -> bool {
        (self.from..self.to).contains(&time)
    }
}

/// A fault of the sensor; axes are gyro x, y, z, then accelerometer x, y, z.
#[derive(Debug, Clone, Copy)]
pub enum Fault {
    /// These axes repeat their last readings.
    Stuck(&'static [usize]),
    /// A reading is shifted, rad/s or m/s^2.
    Shift(usize, f64),
    Gain(usize, f64),
    /// The part is turned in its mount about x, y, z, rad.
    Moved([f64; 3]),
    NoNumber(usize),
    /// The time stamps jump by this, s.
    ClockJump(f64),
    Silent,
}

#[derive(Debug, Clone)]
pub struct Sensor {
    pub part: Part,
    /// Samples a second by its own clock.
    pub hz: f64,
    /// Share by which its clock is fast.
    pub clock: f64,
    /// The reading of its clock at the start, s.
    pub epoch: f64,
    /// Sigma of the sampling times, s.
    pub jitter: f64,
    pub bias: [f64; 3],
    /// Bias per kelvin, rad/s.
    pub per_kelvin: [f64; 3],
    pub gain: [f64; 3],
    pub tilt: [f64; 3],
    pub noise: [f64; 2],
    /// Temperature at the start, its rise (deg C), and the time constant of the rise, s.
    pub warming: [f64; 3],
    pub faults: Vec<During<Fault>>,
}

/// Bytes on the sensor's line.
#[derive(Debug, Clone)]
pub struct Message {
    /// Time of arrival, s.
    pub at: f64,
    pub bytes: Vec<u8>,
}

impl Sensor {
    pub fn new(vehicle: &Vehicle, random: &mut Random) -> Self {
        let mut draw = |sigma: f64| random.normals().map(|normal| sigma * normal);
        Self {
            part: if vehicle.part == Part::Dsp1760 { Part::Xsens } else { vehicle.part },
            hz: 100.0,
            clock: 0.0,
            epoch: 0.0,
            jitter: 0.0,
            bias: draw(vehicle.bias),
            per_kelvin: draw(vehicle.per_kelvin),
            gain: draw(vehicle.gain).map(|error| 1.0 + error),
            tilt: draw(vehicle.tilt),
            noise: vehicle.noise,
            warming: [25.0, 0.0, 1.0],
            faults: Vec::new(),
        }
    }

    /// A DSP-1760 with the errors of its data sheet: 0.05 deg/h, 0.012 deg/sqrt(h), 50 ppm, and its mount's 0.3 deg.
    pub fn fibre_optic(random: &mut Random) -> Self {
        let mut draw = |sigma: f64| random.normals().map(|normal| sigma * normal);
        Self {
            part: Part::Dsp1760,
            hz: 1_000.0,
            clock: 0.0,
            epoch: 0.0,
            jitter: 0.0,
            bias: draw(2.5e-7),
            per_kelvin: [0.0; 3],
            gain: draw(5e-5).map(|error| 1.0 + error),
            tilt: draw(5e-3),
            noise: [3.5e-6, 0.0],
            warming: [25.0, 0.0, 1.0],
            faults: Vec::new(),
        }
    }

    fn celsius(&self, time: f64) -> f64 {
        let [start, rise, constant] = self.warming;
        start + rise * (1.0 - (-time / constant).exp())
    }

    pub fn messages(&self, travelled: &Travelled, random: &mut Random) -> Vec<Message> {
        let period = 1.0 / (self.hz * (1.0 + self.clock));
        let mut messages = Vec::new();
        let (mut last, mut held) = (0.0, [0.0; 6]);
        for number in 1.. {
            let at = number as f64 * period + self.jitter * random.normal().clamp(-2.0, 2.0);
            if at > travelled.seconds() {
                break;
            }
            let mut readings = self.readings(travelled.mean(last, at), at, at - last, random);
            last = at;
            // By its own clock its period is right.
            let mut stamp = (self.epoch + number as f64 / self.hz + (at - number as f64 * period)) * 1e6;
            let (mut no_number, mut silent) = (None, false);
            for fault in self.faults.iter().filter(|fault| fault.holds(at)) {
                match fault.what {
                    Fault::Stuck(axes) => axes.iter().for_each(|axis| readings[*axis] = held[*axis]),
                    Fault::Shift(axis, by) => readings[axis] += by,
                    Fault::Gain(axis, by) => readings[axis] *= by,
                    Fault::Moved(by) => readings = turned(readings, by),
                    Fault::NoNumber(axis) => no_number = Some(axis),
                    Fault::ClockJump(by) => stamp += by * 1e6,
                    Fault::Silent => silent = true,
                }
            }
            held = readings;
            if !silent {
                let stamp = stamp.max(0.0).round() as u64;
                let bytes = self.encode(number, stamp, readings, self.celsius(at), no_number);
                messages.push(Message { at, bytes });
            }
        }
        messages
    }

    fn readings(&self, motion: [f64; 6], time: f64, seconds: f64, random: &mut Random) -> [f64; 6] {
        let mut motion = motion;
        motion[2] += EARTH_RATE * f64::from(LATITUDE).to_radians().sin();
        let mut readings = turned(motion, self.tilt);
        let warmer = self.celsius(time) - 25.0;
        for axis in 0..3 {
            let bias = self.bias[axis] + self.per_kelvin[axis] * warmer;
            let noise = self.noise.map(|density| density / seconds.sqrt() * random.normal());
            readings[axis] = readings[axis] * self.gain[axis] + bias + noise[0];
            readings[3 + axis] += noise[1];
        }
        readings
    }

    fn encode(
        &self,
        number: u64,
        stamp: u64,
        readings: [f64; 6],
        celsius: f64,
        without: Option<usize>,
    ) -> Vec<u8> {
        if self.part == Part::Dsp1760 {
            return increment(number, stamp, readings.map(|rate| rate / self.hz), without);
        }
        if self.part == Part::Xsens {
            return mti(number as u16, (stamp / 100) as u32, readings, celsius, without);
        }
        let rate = |rate: f64| AngularRate::from_rad_per_sec(rate as f32).unwrap_or(AngularRate(i32::MAX));
        let force =
            |force: f64| SpecificForce::from_metre_per_sec2(force as f32).unwrap_or(SpecificForce(i32::MAX));
        let [x, y, z, ahead, left, up] = readings;
        let sample = ImuSample {
            time: Micros(stamp),
            angular_rate: [x, y, z].map(rate),
            specific_force: [ahead, left, up].map(force),
            temperature: Some(CentiCelsius((celsius * 100.0) as i16)),
            validity: Validity::Good,
        };
        let mut packet = icm42688::packet(&sample);
        match without {
            Some(axis @ 0..3) => packet.rate[axis] = None,
            Some(axis) => packet.acceleration[axis - 3] = None,
            None => {}
        }
        packet.emit().to_vec()
    }
}

/// A small turn of the axes about x, y, z.
fn turned(readings: [f64; 6], by: [f64; 3]) -> [f64; 6] {
    let mut out = readings;
    for at in [0, 3] {
        for (axis, angle) in by.into_iter().enumerate() {
            let (sin, cos) = angle.sin_cos();
            let [one, two] = [at + (axis + 1) % 3, at + (axis + 2) % 3];
            (out[one], out[two]) = (cos * out[one] + sin * out[two], cos * out[two] - sin * out[one]);
        }
    }
    out
}

/// A message of a DSP-1760 with this increment, rad; the axis without a number is marked as not valid.
fn increment(number: u64, stamp: u64, turns: [f64; 6], without: Option<usize>) -> Vec<u8> {
    let [x, y, z, ..] = turns;
    let message = dsp1760::Message {
        rotation: [x, y, z].map(|turn| turn as f32),
        acceleration: [0.0; 3],
        extra: Extra::Timed { time: stamp as u32, temperature: 25 },
        validity: dsp1760::Validity(dsp1760::Validity::GYRO.0 & !without.map_or(0, |axis| 1 << axis)),
        sequence: (number % 128) as u8,
    };
    message.emit().to_vec()
}

/// A message of an MTi; readings beyond the part's range are clipped and marked, and one may be no number.
pub fn mti(number: u16, ticks: u32, readings: [f64; 6], celsius: f64, without: Option<usize>) -> Vec<u8> {
    let mut status = MTI_GOOD;
    let mut value = |axis: usize| {
        let range = MTI_RANGE[axis / 3];
        if readings[axis].abs() > range {
            status |= MTI_CLIPPED;
        }
        if without == Some(axis) { f32::NAN } else { readings[axis].clamp(-range, range) as f32 }
    };
    let message = MtData2 {
        packet_counter: Some(number),
        sample_time_fine: Some(ticks),
        acceleration: Some([3, 4, 5].map(&mut value)),
        rate_of_turn: Some([0, 1, 2].map(value)),
        temperature: Some(celsius as f32),
        status: Some(status),
    };
    message.emit().to_vec()
}

//! What a part sends for a reading.

use super::draw::Draw;
use super::drive::Reading;
use super::fault::Line;
use super::wire::Message;
use crate::parts::dsp1760::{MESSAGE_US, MESSAGES, message};
use crate::parts::icm42688::{ENDS, packet};
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::sensor::adis16465::{Burst, DiagStat, Model};
use gyronet::sensor::dsp1760::message::{Extra, Validity};
use gyronet::sensor::xsens::MtData2;
use gyronet::units::{Micros, STANDARD_GRAVITY};
use serde::Serialize;

/// A sensor of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Xsens MTi: MTData2, an 8-bit sum.
    Xsens,
    /// KVH DSP-1760, CRC-32, beside an MTi and wheels; its own messages are judged.
    Dsp1760,
    /// ICM-42688-P: FIFO packets, no checksum.
    Icm42688,
    /// ADIS16465-2: bursts, a 16-bit sum.
    Adis16465,
}

/// All clipping bits of an MTi's status word.
const CLIPPED: u32 = 0x3F << 8;
/// Self-test passed, filter valid.
const GOOD: u32 = 3;
/// What an MTi measures at most, rad/s and m/s^2.
const XSENS_LARGEST: [f32; 2] = [7.85, 98.0];
/// The parts' clocks are not the board's.
const PART_EPOCH_US: u64 = 77_000_000;
/// Microseconds of a tick of SampleTimeFine.
const TICK_US: u64 = 100;

impl Part {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Xsens, Self::Dsp1760, Self::Icm42688, Self::Adis16465];

    /// For tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xsens => "Xsens MTi",
            Self::Dsp1760 => "DSP-1760",
            Self::Icm42688 => "ICM-42688-P",
            Self::Adis16465 => "ADIS16465",
        }
    }

    /// The messages of a row, appended.
    pub fn send(self, row: usize, reading: &Reading, out: &mut Vec<Message>) {
        let message = |line, at, bytes: &[u8]| Message { line, row, at, bytes: bytes.to_vec() };
        match self {
            Self::Xsens => out.push(message(Line::Sensor, reading.at, &mtdata2(row, reading).emit())),
            Self::Dsp1760 => {
                for n in 1..=MESSAGES {
                    let at = reading.at - PERIOD_US + n * MESSAGE_US;
                    out.push(message(Line::Gyro, at, &increment(reading, at)));
                }
                // What is wrong with its gyro is not wrong with the other sensor's.
                let mut beside = *reading;
                beside.saturated[..3].fill(false);
                beside.no_number = reading.no_number.filter(|(axis, _)| *axis >= 3);
                beside.stamp_us = 0;
                out.push(message(Line::Sensor, reading.at, &mtdata2(row, &beside).emit()));
            }
            Self::Icm42688 => out.push(message(Line::Sensor, reading.at, &fifo_packet(reading))),
            Self::Adis16465 => out.push(message(Line::Sensor, reading.at, &burst(row, reading).emit())),
        }
    }
}

/// By the part's own clock.
fn stamp(reading: &Reading) -> u64 {
    (PART_EPOCH_US + reading.sample.time.0).saturating_add_signed(reading.stamp_us)
}

fn mtdata2(row: usize, reading: &Reading) -> MtData2 {
    let sample = &reading.sample;
    let mut rate = sample.angular_rate.map(|rate| rate.rad_per_sec() as f32);
    let mut force = sample.specific_force.map(|force| force.metre_per_sec2() as f32);
    for axis in 0..3 {
        if reading.saturated[axis] {
            rate[axis] = XSENS_LARGEST[0].copysign(rate[axis]);
        }
        if reading.saturated[3 + axis] {
            force[axis] = XSENS_LARGEST[1].copysign(force[axis]);
        }
    }
    match reading.no_number {
        Some((axis @ 0..3, form)) => rate[axis] = no_number(form),
        Some((axis, form)) => force[axis - 3] = no_number(form),
        None => {}
    }
    let clipped = !sample.validity.is_good() || reading.saturated.contains(&true);
    MtData2 {
        packet_counter: Some(row as u16),
        sample_time_fine: Some((stamp(reading) / TICK_US) as u32),
        acceleration: Some(force),
        rate_of_turn: Some(rate),
        temperature: None,
        status: Some(GOOD | if clipped { CLIPPED } else { 0 }),
    }
}

/// What is no reading.
const fn no_number(form: usize) -> f32 {
    match form {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => -1e30,
        _ => 4096.0,
    }
}

/// The part drops an axis' validity bit in saturation; without a number it may not know. It has 1e-7 rad of
/// noise in a millisecond (0.012 deg per square root of an hour).
fn increment(reading: &Reading, at: u64) -> Vec<u8> {
    let mut message = message(at, &ImuSample { angular_rate: reading.fog, ..reading.sample });
    if !reading.fog_stuck {
        message.rotation[2] += Draw::new(at, 0).between(-2e-7, 2e-7) as f32;
    }
    let time = stamp(reading).wrapping_add(at).wrapping_sub(reading.at) as u32;
    message.extra = Extra::Timed { time, temperature: 25 };
    let mut validity = Validity::GYRO.0;
    for axis in 0..3 {
        if reading.saturated[axis] {
            validity &= !(1 << axis);
        }
    }
    if let Some((axis @ 0..3, form)) = reading.no_number {
        message.rotation[axis] = no_number(form);
    }
    message.validity = Validity(validity);
    message.emit().to_vec()
}

fn fifo_packet(reading: &Reading) -> Vec<u8> {
    let sample = ImuSample { time: Micros(stamp(reading)), ..reading.sample };
    let mut packet = packet(&sample);
    for axis in 0..3 {
        let largest = |value: Option<i32>| value.map(|value| ENDS[usize::from(value >= 0)] as i32);
        if reading.saturated[axis] {
            packet.rate[axis] = largest(packet.rate[axis]);
        }
        if reading.saturated[3 + axis] {
            packet.acceleration[axis] = largest(packet.acceleration[axis]);
        }
    }
    match reading.no_number {
        Some((axis @ 0..3, _)) => packet.rate[axis] = None,
        Some((axis, _)) => packet.acceleration[axis - 3] = None,
        None => {}
    }
    packet.emit().to_vec()
}

/// The part has no form of a number that is none: it says what is wrong with it.
fn burst(row: usize, reading: &Reading) -> Burst {
    let count = |value: f64, saturated: bool| {
        if saturated { if value < 0.0 { i16::MIN } else { i16::MAX } } else { libm::round(value) as i16 }
    };
    let (sample, saturated) = (&reading.sample, &reading.saturated);
    let per_rad = f64::from(ADIS.counts_per_dps()).to_degrees();
    let per_force = f64::from(ADIS.counts_per_g()) / f64::from(STANDARD_GRAVITY);
    let diagnosis = reading.no_number.map_or(DiagStat::default(), |(_, form)| {
        [DiagStat::STANDBY, DiagStat::SELF_TEST, DiagStat::MEMORY, DiagStat::CLOCK][form % 4]
    });
    Burst {
        diagnosis,
        rate: std::array::from_fn(|n| count(sample.angular_rate[n].rad_per_sec() * per_rad, saturated[n])),
        acceleration: std::array::from_fn(|n| {
            count(sample.specific_force[n].metre_per_sec2() * per_force, saturated[3 + n])
        }),
        temperature: 250,
        counter: row as u16,
    }
}

/// 500 deg/s.
pub const ADIS: Model = Model::Adis16465_2;

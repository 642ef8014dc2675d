//! Readings as the messages of a part: those of [`gyronet_tools::parts`], with the effects of a fault.

use super::drive::Reading;
use super::fault::Line;
use super::line::Message;
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::sensor::adis16465::{Burst, DiagStat};
use gyronet::sensor::dsp1760::message::{Extra, Validity};
use gyronet::sensor::xsens::MtData2;
use gyronet::units::Micros;
use gyronet_tools::parts::dsp1760::{MESSAGE_US, MESSAGES, message};
use gyronet_tools::parts::icm42688::{ENDS, packet};
use gyronet_tools::parts::{Part, adis16465, xsens};
use gyronet_tools::random::Random;

/// Full scale of an MTi, rad/s and m/s^2.
const XSENS_LARGEST: [f32; 2] = [7.85, 98.0];

pub fn encode(part: Part, row: usize, reading: &Reading, out: &mut Vec<Message>) {
    let message = |line, at, bytes: &[u8]| Message { line, row, at, bytes: bytes.to_vec() };
    match part {
        Part::Xsens => out.push(message(Line::Sensor, reading.at, &mtdata2(row, reading).emit())),
        Part::Dsp1760 => {
            for n in 1..=MESSAGES {
                let at = reading.at - PERIOD_US + n * MESSAGE_US;
                out.push(message(Line::Gyro, at, &increment(reading, at)));
            }
            // A fault of the fibre-optic gyro does not affect the inertial sensor beside it.
            let mut beside = *reading;
            beside.saturated[..3].fill(false);
            beside.no_number = reading.no_number.filter(|(axis, _)| *axis >= 3);
            beside.stamp_us = 0;
            out.push(message(Line::Sensor, reading.at, &mtdata2(row, &beside).emit()));
        }
        Part::Icm42688 => out.push(message(Line::Sensor, reading.at, &fifo_packet(reading))),
        Part::Adis16465 => out.push(message(Line::Sensor, reading.at, &burst(row, reading).emit())),
    }
}

/// The time stamp by the part's own clock.
fn stamp(reading: &Reading) -> u64 {
    (reading.epoch_us + reading.sample.time.0).saturating_add_signed(reading.stamp_us)
}

fn mtdata2(row: usize, reading: &Reading) -> MtData2 {
    let sample = ImuSample { time: Micros(stamp(reading)), temperature: None, ..reading.sample };
    let mut message = xsens::message(row, &sample);
    let axes = message.rate_of_turn.iter_mut().chain(&mut message.acceleration).flatten();
    for (axis, value) in axes.enumerate() {
        if reading.saturated[axis] {
            *value = XSENS_LARGEST[axis / 3].copysign(*value);
        }
        if let Some((_, form)) = reading.no_number.filter(|(without, _)| *without == axis) {
            *value = no_number(form);
        }
    }
    if reading.saturated.contains(&true) {
        message.status = message.status.map(|status| status | xsens::CLIPPED);
    }
    message
}

const fn no_number(form: usize) -> f32 {
    match form {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => -1e30,
        _ => 4096.0,
    }
}

/// Encodes an increment. The part clears an axis's validity bit in saturation, but not when it sends a value that is
/// no number. It has 1e-7 rad of noise in a millisecond (0.012 deg per square root of an hour).
fn increment(reading: &Reading, at: u64) -> Vec<u8> {
    let mut message = message(at, &ImuSample { angular_rate: reading.fog, ..reading.sample });
    if !reading.fog_stuck {
        message.rotation[2] += Random::new(at, 0).between(-2e-7, 2e-7) as f32;
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

/// Encodes a reading as a burst. The part has no code for NaN: it reports a fault instead.
fn burst(row: usize, reading: &Reading) -> Burst {
    let mut burst = adis16465::burst(row, &reading.sample);
    let largest = |code: i32| if code < 0 { i16::MIN } else { i16::MAX };
    for axis in 0..3 {
        if reading.saturated[axis] {
            burst.rate[axis] = largest(reading.sample.angular_rate[axis].0);
        }
        if reading.saturated[3 + axis] {
            burst.acceleration[axis] = largest(reading.sample.specific_force[axis].0);
        }
    }
    if let Some((_, form)) = reading.no_number {
        let faults = [DiagStat::STANDBY, DiagStat::SELF_TEST, DiagStat::MEMORY, DiagStat::CLOCK];
        burst.diagnosis = faults[form % 4];
    }
    burst
}

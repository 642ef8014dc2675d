//! This module reads and writes the values behind the data identifiers (ISO 14229-1 C.1).
//!
//! | identifier | bytes | content | writable in session |
//! |---|---|---|---|
//! | F186 | 1 | session: 1 default, 2 programming, 3 extended | |
//! | F189 | 1, 1, 1 | version of the firmware | |
//! | F18C | text | serial number of the chip, 24 hexadecimal digits | |
//! | F197 | text | name of the system, "gyronet" | |
//! | 0100 | 1, then the record | layout version, then the stored configuration (postcard) | extended |
//! | 0101 | the record | stored settings of the wheel frames (postcard) | extended |
//! | 0102 | 1, then the record | layout version, then the stored calibration (postcard) | |
//! | 0103 | 1, 4 | weights of GyroNet: 0 none, 1 built in, 2 slot A, 3 slot B; CRC-32 of the weights | |
//! | 0104 | 1, 1 | status of the yaw rate and fault bits, as on CAN | |
//! | 0105 | 4 each | counters of the pipeline, in the order of [`crate::health::Counters`] | |
//! | 0106 | 4 each | counters of the sensor monitor, of the inputs and of the lines, in the order of their types | |
//! | 0107 | 4 each | failed diagnostic transfers, in the order of [`TransportErrors`] | |
//! | 0108 | 4 | sensor time since the start, 10 ms steps | |
//! | 0109 | 4 each | counters of the fibre-optic gyro's lane, in the order of [`FogCounters`] | |
//! | 010A | postcard | versions, part, reset, clock, stored data, weights and status: [`crate::service::message::Info`] | |
//! | 010B | postcard | the reason why the last request was refused, if it was: [`crate::service::message::Refusal`] | |
//! | 010C | postcard | progress of a calibration: [`crate::service::calibrate::State`] | |
//! | 010D | postcard | gain and misalignment of this unit's gyro, or none: [`crate::store::UnitMap`] (to read it, use 0102) | extended |
//! | 0110 | 32 | public key that authorises writing, zeros for none: see [`super::security`] | extended |
//! | 0111 | 1, 4, 1, 4 | access: 0 open, 1 locked, 2 unlocked; newest signature counter; wrong answers; first bytes of the key | |
//! | 0112 | 4 | number of samples of the fibre-optic gyro since the start | |
//! | 0113 | 4 each | requests that were refused for lack of access, in the order of [`AccessCounters`] | |
//! | 0114 | 1, 4 | FoGNet: 0 off, 1 its weights are used, 2 they are refused (reason: 010A); CRC-32 of the weights | |
//! | 0115 | postcard | what the board has learnt about the sensor: [`crate::store::Learned`] | |
//! | 0116 | 1, 2, 2 | forward direction: 0 unknown, 1 within 10 deg, 2 within 3 deg; its angle to the left of the configured x axis, its sigma, both 1/100 deg | |
//! | 0201 to 021E | | single settings: [`super::settings`] | extended |
//!
//! Numbers are big-endian, as is usual in ISO 14229.

use super::isotp::TransportErrors;
use super::response::{Nrc, Response, decode, nrc, put, put_record};
use super::security::{self, Security};
use super::settings;
use crate::fog::FogCounters;
use crate::health::{Counters, InputCounters, MonitorCounters};
use crate::service::message::{AccessCounters, AllCounters, Calibrate, LineCounters, Request};
use crate::service::{Device, MappedSlots};
use crate::store::slots::WeightSource;
use crate::store::{Calibration, Configuration, Record, Slot};
use embedded_storage::nor_flash::NorFlash;

/// Largest sigma of a forward direction that is reported as 2 (within 3 deg), deg.
const FINE_DEG: f32 = 3.0;

/// Lists the fields of a type in the given order; an omitted field is a compile error.
macro_rules! words {
    ($from:expr => $type:ident { $($field:ident),* }) => {{
        let $type { $($field),* } = $from;
        [$($field),*]
    }};
}

/// The sources of the values that are read.
pub(super) struct Sources<'a, R: NorFlash, W> {
    pub device: &'a Device<R, W>,
    pub counters: &'a AllCounters,
    /// Number of the active session.
    pub session: u8,
    pub security: &'a Security,
    pub errors: TransportErrors,
}

/// Appends the value of an identifier.
pub(super) fn read<R: NorFlash, W: MappedSlots>(
    id: u16,
    from: &Sources<'_, R, W>,
    out: &mut Response,
) -> Result<(), Nrc> {
    let Sources { device, counters, session, security, errors } = from;
    match id {
        0xF186 => put(out, &[*session]),
        0xF18C => device.serial().iter().try_for_each(|byte| put(out, &hex(*byte))),
        0xF189 => put(out, &device.info().identity.firmware),
        0xF197 => put(out, b"gyronet"),
        0x0100 => {
            put(out, &[Configuration::VERSION])?;
            put_record(out, device.configuration())
        }
        0x0101 => put_record(out, device.wheels()),
        0x0102 => {
            put(out, &[Calibration::VERSION])?;
            put_record(out, device.calibration())
        }
        0x0103 => {
            let info = device.info();
            let source = match info.weights {
                WeightSource::None => 0,
                WeightSource::BuiltIn => 1,
                WeightSource::Slot(Slot::A) => 2,
                WeightSource::Slot(Slot::B) => 3,
            };
            put(out, &[source])?;
            put(out, &info.weights_crc.unwrap_or(0).to_be_bytes())
        }
        0x0104 => {
            let now = device.conditions();
            put(out, &[now.status as u8, now.faults.0])
        }
        0x0105 => put_words(
            out,
            &words!(counters.pipeline => Counters {
                samples, missing, misplaced, clock_jumps, invalid, moving, windows, clamped_inputs, implausible, late,
                zero_rate_updates, contradicted, foreign_mountings, moved_mounts
            }),
        ),
        0x0106 => {
            let monitor =
                words!(counters.watch => MonitorCounters { silences, stuck, held, wrong, clock_off });
            let inputs = words!(counters.inputs => InputCounters {
                imu_errors, fog_errors, wheel_errors, latitude_errors, clock_back, unclaimed_estimates,
                replaced_windows, replaced_frames, out_of_range
            });
            let lines = words!(counters.lines => LineCounters {
                unsent, line_errors, held, overruns, service_errors, frames_lost
            });
            put_words(out, &monitor)?;
            put_words(out, &inputs)?;
            put_words(out, &lines)
        }
        0x0107 => {
            put_words(out, &words!(*errors => TransportErrors { unexpected, sequence, overflow, timeout }))
        }
        0x0108 => put(out, &device.conditions().tick.to_be_bytes()),
        0x0109 => put_words(
            out,
            &words!(counters.fog => FogCounters {
                samples, misplaced, gaps, stuck, windows, late, implausible, broken, no_latitude, zero_rate_updates,
                contradicted, dropped
            }),
        ),
        0x010A => put_record(out, &device.info()),
        0x010B => put_record(out, &device.refusal()),
        0x010C => put_record(out, &device.calibration_state()),
        0x0111 => security::state(security, device, out),
        0x0112 => put(out, &counters.fog.samples.to_be_bytes()),
        0x0113 => put_words(
            out,
            &words!(device.access_counters() => AccessCounters {
                locked, unsigned, answers, signatures, replayed
            }),
        ),
        0x0114 => {
            let (state, crc) = match device.info().fognet {
                None => (0, 0),
                Some(Ok(crc)) => (1, crc),
                Some(Err(_)) => (2, 0),
            };
            put(out, &[state])?;
            put(out, &crc.to_be_bytes())
        }
        0x0115 => put_record(out, device.learned()),
        0x0116 => {
            let known = device.forward_deg();
            let [yaw, sigma] = known.unwrap_or_default().map(|angle| libm::roundf(100.0 * angle) as i16);
            put(out, &[known.map_or(0, |[_, sigma]| if sigma <= FINE_DEG { 2 } else { 1 })])?;
            put(out, &yaw.to_be_bytes())?;
            put(out, &sigma.to_be_bytes())
        }
        _ => settings::read(id, device, out),
    }
}

/// Writes the value of an identifier. Each record has its own function, so that only one record is on the stack.
pub(super) fn write<R: NorFlash, W: MappedSlots>(
    id: u16,
    bytes: &[u8],
    device: &mut Device<R, W>,
) -> Result<(), Nrc> {
    match id {
        0x0100 => write_configuration(bytes, device),
        0x0101 => write_wheels(bytes, device),
        0x010D => write_unit(bytes, device),
        _ => settings::write(id, bytes, device),
    }
}

#[inline(never)]
fn write_configuration<R: NorFlash, W: MappedSlots>(
    bytes: &[u8],
    device: &mut Device<R, W>,
) -> Result<(), Nrc> {
    let (&version, record) = bytes.split_first().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
    if version != Configuration::VERSION {
        return Err(Nrc::RequestOutOfRange);
    }
    let configuration = decode(record)?;
    device.act(&Request::SetConfiguration { version, configuration: &configuration }).map_err(nrc)
}

#[inline(never)]
fn write_wheels<R: NorFlash, W: MappedSlots>(bytes: &[u8], device: &mut Device<R, W>) -> Result<(), Nrc> {
    device.act(&Request::SetWheels(decode(bytes)?)).map_err(nrc)
}

#[inline(never)]
fn write_unit<R: NorFlash, W: MappedSlots>(bytes: &[u8], device: &mut Device<R, W>) -> Result<(), Nrc> {
    device.act(&Request::Calibrate(Calibrate::SetUnit(decode(bytes)?))).map_err(nrc)
}

fn hex(byte: u8) -> [u8; 2] {
    let digit = |value: u8| if value < 10 { b'0' + value } else { b'A' - 10 + value };
    [digit(byte >> 4), digit(byte & 0xF)]
}

fn put_words(out: &mut Response, words: &[u32]) -> Result<(), Nrc> {
    words.iter().try_for_each(|word| put(out, &word.to_be_bytes()))
}

//! The values behind the data identifiers (ISO 14229-1 C.1), big-endian. `gyronet reference identifiers` prints
//! [`IDENTIFIERS`].

use super::isotp::TransportErrors;
use super::response::{Nrc, Response, decode, nrc, put, put_record};
use super::security::Seed;
use super::services::{Exchange, UPDATE};
use crate::coprocessor::Contradiction;
use crate::fog::FogCounters;
use crate::heading::CourseCounters;
use crate::health::{Counters, InputCounters, MonitorCounters};
use crate::service::MappedSlots;
use crate::service::device::Firmware;
use crate::service::message::{AccessCounters, LineCounters, Refusal};
use crate::store::slots::WeightSource;
use crate::store::{Calibration, Configuration, Record, Slot};
use embedded_storage::nor_flash::NorFlash;

/// Identifiers of single settings, which were retired for the configuration (0100).
const RETIRED_FIRST: u16 = 0x0201;
const RETIRED_LAST: u16 = 0x021E;

#[derive(Debug)]
pub struct Identifier {
    pub id: u16,
    /// Name, as in `tools/gyronet_uds.yaml`.
    pub name: &'static str,
    /// Length of each value in bytes, or its encoding.
    pub bytes: &'static str,
    pub content: &'static str,
    pub access: Access,
}

/// The services that accept an identifier; writing needs the extended session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    Read,
    ReadWrite,
    Write,
}

const fn read_only(id: u16, name: &'static str, bytes: &'static str, content: &'static str) -> Identifier {
    Identifier { id, name, bytes, content, access: Access::Read }
}

const fn writable(id: u16, name: &'static str, bytes: &'static str, content: &'static str) -> Identifier {
    Identifier { access: Access::ReadWrite, ..read_only(id, name, bytes, content) }
}

const fn write_only(id: u16, name: &'static str, bytes: &'static str, content: &'static str) -> Identifier {
    Identifier { access: Access::Write, ..read_only(id, name, bytes, content) }
}

pub const IDENTIFIERS: [Identifier; 28] = [
    read_only(0xF186, "session", "1", "session: 1 default, 2 programming, 3 extended"),
    read_only(0xF189, "firmware_version", "1, 1, 1", "version of the firmware"),
    read_only(0xF18C, "serial_number", "text", "serial number of the chip, 24 hexadecimal digits"),
    read_only(0xF197, "system_name", "text", "name of the system, \"gyronet\""),
    writable(0x0100, "configuration", "1, then postcard", "layout version, then the configuration"),
    writable(0x0101, "wheels", "postcard", "settings of the wheel frames"),
    read_only(0x0102, "calibration", "1, then postcard", "layout version, then the calibration"),
    read_only(
        0x0103,
        "weights",
        "1, 4",
        "weights of GyroNet: 0 none, 1 built in, 2 slot A, 3 slot B; CRC-32 of the weights",
    ),
    read_only(
        0x0104,
        "state",
        "1, 1",
        "status of the yaw rate (`gyronet reference states`), fault bits as on CAN",
    ),
    read_only(0x0105, "pipeline_counters", "4 each", "counters of the pipeline"),
    read_only(
        0x0106,
        "input_counters",
        "4 each",
        "counters of the sensor monitor, of the inputs and of the lines",
    ),
    read_only(0x0107, "diagnosis_errors", "4 each", "failed diagnostic transfers"),
    read_only(0x0108, "tick", "4", "sensor time since the start, 10 ms steps"),
    read_only(0x0109, "fog_counters", "4 each", "counters of the fibre-optic gyro"),
    read_only(0x010A, "info", "postcard", "versions, part, reset, clock, stored data, weights and status"),
    read_only(0x010B, "last_refusal", "postcard", "the reason why the last request was refused, if it was"),
    write_only(
        0x010D,
        "unit_map",
        "postcard",
        "gain and misalignment of this unit's gyro, or none; 0102 contains it",
    ),
    write_only(0x0110, "public_key", "32", "public key that authorises writing, zeros for none"),
    read_only(
        0x0111,
        "access",
        "1, 4, 1, 4",
        "0 open, 1 locked, 2 unlocked; newest signature counter; wrong answers; first bytes of the key",
    ),
    read_only(0x0112, "fog_messages", "4", "number of messages of the fibre-optic gyro since the start"),
    read_only(
        0x0113,
        "access_refusals",
        "4 each",
        "requests refused for lack of access: locked, unsigned, wrong answers, wrong signatures, replayed",
    ),
    read_only(0x0115, "learned", "postcard", "what the board has learnt about the sensor"),
    read_only(
        0x0116,
        "forward",
        "1, 2, 2",
        "forward direction: 0 unknown, 1 within 10 deg, 2 within 3 deg; its angle to the left of the configured x axis, its sigma, both 1/100 deg",
    ),
    read_only(
        0x0117,
        "wheel_speeds",
        "2, 2, 2, 2, 1, 1",
        "speed of each wheel, 0.01 m/s, 7FFF for none; the wheels: 0 unknown, 1 moving, 2 standing; 1 if the vehicle is proven to stand",
    ),
    read_only(
        0x0118,
        "level",
        "1, 2, 2, 2",
        "tilt of the sensor beyond the configured mounting, by standstills and turns: 0 unknown, 1 coarse, 2 within 3 deg; roll, pitch, their sigma, all three 1/100 deg",
    ),
    read_only(
        0x0119,
        "course",
        "1, 2, 2, 4, 4, 4, 1",
        "gain of the yaw gyro by courses: 0 unknown, 1 coarse, 2 fine, 3 they contradict the gyro; gain and sigma, 1e-5; courses used, refused, and starts of the heading after contradictions; the newest course: 0 used, 1 far from the gyro's heading, 2 the same in a turn, 3 the vehicle stands, 4 reckoned by the receiver's own sensors",
    ),
    writable(
        0x011A,
        "firmware",
        "1, 1",
        "slot of the firmware that runs: 0 A, 1 B, FF none; 0 not updatable, 1 confirmed, 2 on trial, 3 the update was rolled back, 4 it is damaged; CRC-32 of the image. Written: the head of an update",
    ),
    read_only(
        0x011B,
        "contradiction",
        "4, 2, 2, 2, 2, 2",
        "seconds in which wheels, accelerometer or another gyro contradicted a gyro or the wheels; of the newest: inertial and fibre-optic rate, 0.01 deg/s, lateral force to the left, 0.01 m/s^2, speed, right wheel less left, 0.01 m/s; 7FFF for none",
    ),
];

/// Lists the fields of a type in the given order; an omitted field is a compile error.
macro_rules! words {
    ($from:expr => $type:ident { $($field:ident),* }) => {{
        let $type { $($field),* } = $from;
        [$($field),*]
    }};
}

impl<R: NorFlash, W: MappedSlots, E: FnMut() -> Option<Seed>> Exchange<'_, R, W, E> {
    pub(super) fn read(&mut self, id: u16) -> Result<(), Nrc> {
        let Self { services, device, out, counters, errors, .. } = self;
        match id {
            0xF186 => put(out, &[services.session() as u8]),
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
                    zero_rate_updates, contradicted, moved_mounts
                }),
            ),
            0x0106 => {
                let monitor =
                    words!(counters.watch => MonitorCounters { silences, stuck, held, wrong, clock_off });
                let inputs = words!(counters.inputs => InputCounters {
                    imu_errors, fog_errors, wheel_errors, latitude_errors, heading_errors, clock_back, unclaimed_estimates,
                    replaced_windows, out_of_range
                });
                let lines = words!(counters.lines => LineCounters {
                    unsent, line_errors, overruns, service_errors, frames_lost
                });
                put_words(out, &monitor)?;
                put_words(out, &inputs)?;
                put_words(out, &lines)
            }
            0x0107 => put_words(
                out,
                &words!(*errors => TransportErrors { unexpected, sequence, overflow, timeout }),
            ),
            0x0108 => put(out, &device.conditions().tick.to_be_bytes()),
            0x0109 => put_words(
                out,
                &words!(counters.fog => FogCounters {
                    samples, misplaced, gaps, stuck, no_latitude, zero_rate_updates, contradicted
                }),
            ),
            0x010A => put_record(out, &device.info()),
            0x010B => put_record(
                out,
                &if services.is_guest { Some(Refusal::OtherTester) } else { device.refusal() },
            ),
            0x0111 => self.access_state(),
            0x0112 => put(out, &counters.fog.samples.to_be_bytes()),
            0x0113 => put_words(
                out,
                &words!(device.access_counters() => AccessCounters {
                    locked, unsigned, answers, signatures, replayed
                }),
            ),
            0x0115 => put_record(out, device.learned()),
            0x0116 => {
                let known = device.forward_deg();
                let [yaw, sigma] = known.unwrap_or_default().map(|angle| libm::roundf(100.0 * angle) as i16);
                put(out, &[device.forward_knowledge() as u8])?;
                put(out, &yaw.to_be_bytes())?;
                put(out, &sigma.to_be_bytes())
            }
            0x0118 => {
                let (knowledge, angles) = device.level_deg();
                put(out, &[knowledge as u8])?;
                angles
                    .into_iter()
                    .try_for_each(|angle| put(out, &(libm::roundf(100.0 * angle) as i16).to_be_bytes()))
            }
            0x0119 => {
                let (course, knowledge) = device.course();
                let codes = course.gain.map_or([0.0, 0.0], |gain| [gain.share, gain.sigma]);
                put(out, &[knowledge as u8])?;
                codes
                    .iter()
                    .try_for_each(|share| put(out, &(libm::roundf(1e5 * share) as i16).to_be_bytes()))?;
                put_words(out, &words!(course.counters => CourseCounters { used, refused, restarts }))?;
                put(out, &[course.refusal.map_or(0, |refusal| refusal as u8)])
            }
            0x011B => {
                let Contradiction { seconds, gyros: [inertial, fog], lateral, wheels } =
                    counters.contradiction;
                put(out, &seconds.to_be_bytes())?;
                let [speed, difference] = wheels.map_or([None; 2], |values| values.map(Some));
                [inertial, fog, lateral, speed, difference]
                    .into_iter()
                    .try_for_each(|code: Option<i16>| put(out, &code.unwrap_or(i16::MAX).to_be_bytes()))
            }
            0x011A => {
                let Firmware { slot, crc, state } = device.firmware();
                put(out, &[slot.map_or(0xFF, |slot| slot as u8), state as u8])?;
                put(out, &crc.unwrap_or(0).to_be_bytes())
            }
            0x0117 => {
                let (wheels, stands) = device.standing();
                for speed in wheels.speeds {
                    let code = speed.map_or(i16::MAX, |speed| ((i64::from(speed.0) * 100) >> 16) as i16);
                    put(out, &code.to_be_bytes())?;
                }
                put(out, &[wheels.standstill as u8, u8::from(stands)])
            }
            _ => Err(Nrc::RequestOutOfRange),
        }
    }

    /// Writes the value of an identifier. Each record has its own function, so that only one record is on the stack.
    pub(super) fn write(&mut self, id: u16, bytes: &[u8]) -> Result<(), Nrc> {
        match id {
            0x0100 => self.write_configuration(bytes),
            0x0101 => self.write_wheels(bytes),
            0x010D => self.write_unit(bytes),
            RETIRED_FIRST..=RETIRED_LAST => Err(self.refuse(Refusal::SingleSetting)),
            _ => Err(Nrc::RequestOutOfRange),
        }
    }

    #[inline(never)]
    fn write_configuration(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
        let (&found, record) = bytes.split_first().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
        let expected = Configuration::VERSION;
        if found != expected {
            return Err(self.refuse(Refusal::Version { found, expected }));
        }
        self.device.set_configuration(&decode(record)?).map_err(nrc)
    }

    #[inline(never)]
    fn write_wheels(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
        self.device.set_wheels(&decode(bytes)?).map_err(nrc)
    }

    #[inline(never)]
    fn write_unit(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
        self.device.set_unit(decode(bytes)?).map_err(nrc)
    }
}

/// Returns whether an identifier can be written, or could be by earlier versions.
pub(super) fn is_writable(id: u16) -> bool {
    matches!(id, 0x0100 | 0x0101 | 0x010D | 0x0110 | UPDATE | RETIRED_FIRST..=RETIRED_LAST)
}

fn hex(byte: u8) -> [u8; 2] {
    let digit = |value: u8| if value < 10 { b'0' + value } else { b'A' - 10 + value };
    [digit(byte >> 4), digit(byte & 0xF)]
}

fn put_words(out: &mut Response, words: &[u32]) -> Result<(), Nrc> {
    words.iter().try_for_each(|word| put(out, &word.to_be_bytes()))
}

//! The values behind the data identifiers (ISO 14229-1 C.1), big-endian. `gyronet reference identifiers` prints them.

use super::exchange::Exchange;
use super::lock::Seed;
use super::response::{Nrc, Response, decode, nrc, put, put_record};
use crate::can::slcan::hex;
use crate::coprocessor::Contradiction;
use crate::heading::CourseCounters;
use crate::service::MappedSlots;
use crate::service::device::Firmware;
use crate::service::message::Refusal;
use crate::store::slots::WeightSource;
use crate::store::{Calibration, Configuration, Record, Slot};
use embedded_storage::nor_flash::NorFlash;

/// Data identifier of the firmware: its state, and the head of an update.
pub(super) const UPDATE: u16 = 0x011A;
/// Identifiers of single settings, which were retired for the configuration (0100).
const RETIRED_FIRST: u16 = 0x0201;
const RETIRED_LAST: u16 = 0x021E;

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
            0x0105 => put_words(out, &counters.pipeline.words()),
            0x0106 => {
                put_words(out, &counters.watch.words())?;
                put_words(out, &counters.inputs.words())?;
                put_words(out, &counters.lines.words())
            }
            0x0107 => put_words(out, &errors.words()),
            0x0108 => put(out, &device.conditions().tick.to_be_bytes()),
            0x0109 => put_words(out, &counters.fog.words()),
            0x010A => put_record(out, &device.info()),
            0x010B => put_record(
                out,
                &if services.is_guest { Some(Refusal::OtherTester) } else { device.refusal() },
            ),
            0x0111 => self.access_state(),
            0x0112 => put(out, &counters.fog.samples.to_be_bytes()),
            0x0113 => put_words(out, &device.access_counters().words()),
            0x0115 => put_record(out, device.learned()),
            0x0116 => {
                let known = device.forward_deg();
                put(out, &[device.forward_knowledge() as u8])?;
                put_codes(out, known.unwrap_or_default().map(|angle| 100.0 * angle))
            }
            0x0118 => {
                let (knowledge, angles) = device.level_deg();
                put(out, &[knowledge as u8])?;
                put_codes(out, angles.map(|angle| 100.0 * angle))
            }
            0x0119 => {
                let (course, knowledge) = device.course();
                let codes = course.gain.map_or([0.0, 0.0], |gain| [gain.share, gain.sigma]);
                put(out, &[knowledge as u8])?;
                put_codes(out, codes.map(|share| 1e5 * share))?;
                let CourseCounters { used, refused, restarts } = course.counters;
                put_words(out, &[used, refused, restarts])?;
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
            UPDATE => {
                let Firmware { slot, crc, state } = device.info().firmware;
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

/// Writes values as whole numbers of 16 bits.
fn put_codes<const N: usize>(out: &mut Response, values: [f32; N]) -> Result<(), Nrc> {
    values.into_iter().try_for_each(|value| put(out, &(libm::roundf(value) as i16).to_be_bytes()))
}

fn put_words(out: &mut Response, words: &[u32]) -> Result<(), Nrc> {
    words.iter().try_for_each(|word| put(out, &word.to_be_bytes()))
}

//! Frames and signals of the file as those of the board, and back.

use super::protection::parts;
use super::{Counter, Frame, Place, Protection, Raw, Says, Signal, Wheel, WheelFileError};
use embedded_can::{ExtendedId, Id, StandardId};
use gyronet::can::wheel::{Checksum, Parts, WheelFrame, WheelSettings, WheelSignal};
use gyronet::units::WheelSpeed;

/// Speed codes per km/h.
const CODES_PER_KMH: f64 = 65_536.0 / 3.6;
/// [`WheelSignal::factor_q16`] of a factor of 1 km/h.
const FACTORS_PER_KMH: f64 = CODES_PER_KMH * 65_536.0;
/// The same of a pulse of 1 m.
const FACTORS_PER_METRE: f64 = 65_536.0 * 65_536.0;

impl Frame {
    pub(super) fn of(settings: &WheelSettings, number: u8, frame: &WheelFrame) -> Self {
        let wheels = [Wheel::FrontLeft, Wheel::FrontRight, Wheel::RearLeft, Wheel::RearRight];
        let signals = wheels.into_iter().zip(settings.signals);
        let own = signals.filter_map(|(wheel, signal)| Some((wheel, signal?)));
        let own = own.filter(|(_, signal)| signal.frame == number);
        let (id, extended) = match frame.id {
            Id::Standard(id) => (id.as_raw().into(), false),
            Id::Extended(id) => (id.as_raw(), true),
        };
        Self {
            id,
            extended,
            checksum: Protection::of(frame.checksum),
            counter: frame.counter.map(|Parts { low, high }| Counter {
                low: Place::of(&low),
                high: high.as_ref().map(Place::of),
            }),
            signal: own.map(|(wheel, signal)| Signal::of(wheel, &signal)).collect(),
        }
    }

    pub(super) fn settings(&self) -> Result<WheelFrame, WheelFileError> {
        let Self { id, extended, .. } = *self;
        let identifier = if extended {
            ExtendedId::new(id).map(Id::Extended)
        } else {
            u16::try_from(id).ok().and_then(StandardId::new).map(Id::Standard)
        };
        let place = |source| WheelFileError::Place { id, source };
        Ok(WheelFrame {
            id: identifier.ok_or(WheelFileError::Identifier { id, extended })?,
            counter: self
                .counter
                .map(|counter| parts(counter.low, counter.high))
                .transpose()
                .map_err(place)?,
            checksum: match &self.checksum {
                None => Checksum::None,
                Some(protection) => protection.checksum().map_err(place)?,
            },
        })
    }
}

impl Signal {
    pub(super) fn settings(&self, id: u32, frame: u8) -> Result<WheelSignal, WheelFileError> {
        let place = |source| WheelFileError::Place { id, source };
        let (pulses, factor_q16) = match (self.factor_kmh, self.metres_per_pulse) {
            (Some(kmh), None) => (false, factor("factor_kmh", kmh, FACTORS_PER_KMH, 100.0)?),
            (None, Some(metres)) => (true, factor("metres_per_pulse", metres, FACTORS_PER_METRE, 0.5)?),
            _ => return Err(WheelFileError::Scale(self.wheel)),
        };
        let codes = match &self.invalid {
            None => &[][..],
            Some(Raw::One(code)) => std::slice::from_ref(code),
            Some(Raw::List(codes)) => codes,
        };
        let mut invalid = [None; 3];
        if codes.len() > invalid.len() {
            let value = codes.len() as f64;
            let range = "at most three codes".into();
            return Err(WheelFileError::Range { key: "invalid", value, range });
        }
        invalid.iter_mut().zip(codes).for_each(|(to, code)| *to = Some(*code));
        let limit = |kmh| speed("range_kmh", kmh);
        let range =
            self.range_kmh.map(|[least, most]| Ok::<_, WheelFileError>([limit(least)?, limit(most)?]));
        Ok(WheelSignal {
            pulses,
            offset: speed("offset_kmh", self.offset_kmh)?,
            invalid,
            range: range.transpose()?,
            valid_when: self.valid_when.map(Says::code).transpose().map_err(place)?,
            reverse_when: self.reverse_when.map(Says::code).transpose().map_err(place)?,
            ..WheelSignal::new(frame, self.place.field().map_err(place)?, factor_q16)
        })
    }

    pub(super) fn of(wheel: Wheel, signal: &WheelSignal) -> Self {
        Self {
            wheel,
            place: Place::of(&signal.field),
            factor_kmh: (!signal.pulses).then(|| shortest(signal.factor_q16, FACTORS_PER_KMH)),
            metres_per_pulse: signal.pulses.then(|| shortest(signal.factor_q16, FACTORS_PER_METRE)),
            offset_kmh: kmh(signal.offset),
            invalid: match signal.invalid.into_iter().flatten().collect::<Vec<_>>()[..] {
                [] => None,
                [code] => Some(Raw::One(code)),
                ref codes => Some(Raw::List(codes.to_vec())),
            },
            range_kmh: signal.range.map(|range| range.map(kmh)),
            valid_when: signal.valid_when.map(Says::of),
            reverse_when: signal.reverse_when.map(Says::of),
        }
    }
}

/// Converts a factor to the library's code, which must not be zero; an error names the key and the range.
fn factor(key: &'static str, value: f64, per_unit: f64, most: f64) -> Result<i32, WheelFileError> {
    let code = (value * per_unit).round() as i32;
    let range = format!("below {most} and not 0");
    if value.abs() < most && code != 0 { Ok(code) } else { Err(WheelFileError::Range { key, value, range }) }
}

pub(super) fn kmh(speed: WheelSpeed) -> f64 {
    shortest(speed.0, CODES_PER_KMH)
}

/// The value with the fewest decimals that has this code.
fn shortest(code: i32, per_unit: f64) -> f64 {
    let exact = f64::from(code) / per_unit;
    let mut rounded = (0..12).map(|decimals| {
        let scale = 10_f64.powi(decimals);
        (exact * scale).round() / scale
    });
    rounded.find(|value| (value * per_unit).round() == f64::from(code)).unwrap_or(exact)
}

pub(super) fn speed(key: &'static str, kmh: f64) -> Result<WheelSpeed, WheelFileError> {
    if kmh.abs() < 1e4 {
        return Ok(WheelSpeed((kmh * CODES_PER_KMH).round() as i32));
    }
    Err(WheelFileError::Range { key, value: kmh, range: "within 10000".into() })
}

//! Sentences RMC and VTG of NMEA 0183 (IEC 61162-1), of any satellite system.
//!
//! A sentence is `$TTSSS,FIELD,..*HH` with CR and LF; HH is the exclusive or of all between `$` and `*`. Each `$`
//! begins a sentence, so that one behind a damaged one is read. VTG is used only where RMC has no course. One talker
//! is used, because two receivers differ in latency.

use super::{Fix, Heading, HeadingError, Read};
use heapless::Vec;

/// Length of the longest sentence, bytes. The standard allows 82, and receivers of high precision send a little more.
const MAX_SENTENCE: usize = 100;
/// Talkers that are GNSS receivers: of several systems (`GN`), or of one.
const TALKERS: [&[u8; 2]; 9] = [b"GN", b"GP", b"GL", b"GA", b"GB", b"BD", b"GQ", b"QZ", b"GI"];
/// VTG is used after this many VTG with no RMC course between them.
const WITHOUT_RMC: u8 = 3;
/// Another talker is used after this many RMC and VTG from talkers other than the one in use: 5 s at ten a second.
const WITHOUT_TALKER: u8 = 50;
const KNOT: f32 = 1852.0 / 3600.0;

#[derive(Debug, Clone)]
pub(super) struct Sentences {
    bytes: Vec<u8, MAX_SENTENCE>,
    /// The talker in use, and the number of RMC and VTG of others since its newest.
    talker: Option<&'static [u8; 2]>,
    of_others: u8,
    /// VTG since the newest RMC with a course.
    without_rmc: u8,
}

impl Sentences {
    pub const fn new() -> Self {
        Self { bytes: Vec::new(), talker: None, of_others: 0, without_rmc: WITHOUT_RMC }
    }

    /// Processes a byte; an error is that of a sentence that was cut, or is too long. Call [`Self::read`] after each.
    pub fn receive(&mut self, byte: u8) -> Result<(), HeadingError> {
        let length = self.bytes.len();
        let begins = byte == b'$';
        if begins {
            self.bytes.clear();
        }
        let is_lost = if begins || length > 0 { self.bytes.push(byte).is_err() } else { byte == b'\n' };
        if is_lost {
            self.bytes.clear();
        }
        if is_lost || begins && length > 0 { Err(HeadingError::Length(length)) } else { Ok(()) }
    }

    pub fn interrupt(&mut self) {
        self.bytes.clear();
    }

    pub fn read(&mut self) -> Option<Read> {
        let bytes = core::mem::take(self.bytes.ends_with(b"\n").then_some(&mut self.bytes)?);
        Some(checked(&bytes).map_or_else(|error| Some(Err(error)), |body| self.content(body)))
    }

    fn content(&mut self, body: &[u8]) -> Read {
        let mut fields = body.split(|byte| *byte == b',');
        let (talker, name) = fields.next()?.split_last_chunk::<3>()?;
        let talker = *TALKERS.iter().find(|known| talker == known.as_slice())?;
        if !matches!(name, b"RMC" | b"VTG") {
            return None;
        }
        if self.talker.is_some_and(|used| used != talker) && self.of_others < WITHOUT_TALKER {
            self.of_others += 1;
            return None;
        }
        (self.talker, self.of_others) = (Some(talker), 0);
        if name == b"VTG" {
            self.without_rmc = self.without_rmc.saturating_add(1);
            return (self.without_rmc > WITHOUT_RMC).then(|| vtg(fields));
        }
        let read = rmc(fields);
        if matches!(read, Ok(Fix { heading: Some(Heading { course: Some(_), .. }), .. })) {
            self.without_rmc = 0;
        }
        Some(read)
    }
}

/// Returns what is between `$` and `*` where the checksum is right.
fn checked(sentence: &[u8]) -> Result<&[u8], HeadingError> {
    let [b'$', body @ .., b'*', high, low, b'\r', b'\n'] = sentence else {
        return Err(HeadingError::Checksum);
    };
    let sum = body.iter().fold(0, |sum, byte| sum ^ byte);
    let digit = |value: u8| *b"0123456789ABCDEF".get(usize::from(value)).unwrap_or(&0);
    if [*high, *low] == [digit(sum >> 4), digit(sum & 0xF)] { Ok(body) } else { Err(HeadingError::Checksum) }
}

/// Reads time, status, latitude, N/S, longitude, E/W, speed, course, date, declination, E/W and mode.
fn rmc<'a>(mut fields: impl Iterator<Item = &'a [u8]>) -> Result<Fix, HeadingError> {
    let mut next = || fields.next().unwrap_or_default();
    let [_, status, latitude, side, _, _, speed, course, _, _, _, mode] = core::array::from_fn(|_| next());
    if !is_fix(mode)? || status != b"A" {
        return Ok(Fix::NONE);
    }
    Ok(Fix { heading: Some(heading(course, speed)?), latitude: degrees(latitude, side) })
}

/// Reads a latitude: degrees and minutes are written as one number.
fn degrees(latitude: &[u8], side: &[u8]) -> Result<Option<f32>, HeadingError> {
    match (number(latitude, "latitude")?, side) {
        (None, _) => Ok(None),
        (Some((whole, part)), b"N" | b"S") if whole % 100 < 60 => {
            let degrees = (whole / 100) as f32 + ((whole % 100) as f32 + part) / 60.0;
            Ok(Some(if side == b"S" { -degrees } else { degrees }))
        }
        _ => Err(HeadingError::Field("latitude")),
    }
}

/// Reads course, `T`, magnetic course, `M`, speed, `N`, speed in km/h, `K` and the mode.
fn vtg<'a>(mut fields: impl Iterator<Item = &'a [u8]>) -> Result<Fix, HeadingError> {
    let mut next = || fields.next().unwrap_or_default();
    let [course, from, _, _, speed, unit, _, _, mode] = core::array::from_fn(|_| next());
    if !is_fix(mode)? {
        return Ok(Fix::NONE);
    }
    if from != b"T" || unit != b"N" {
        return Err(HeadingError::Field("course"));
    }
    Ok(Fix { heading: Some(heading(course, speed)?), latitude: Ok(None) })
}

/// Returns whether a mode is that of a position by satellites. Sentences before NMEA 2.3 have no mode and are refused.
fn is_fix(mode: &[u8]) -> Result<bool, HeadingError> {
    match mode {
        b"E" => Err(HeadingError::Reckoned),
        b"" => Err(HeadingError::Field("mode")),
        b"A" | b"D" | b"F" | b"P" | b"R" => Ok(true),
        _ => Ok(false),
    }
}

fn heading(course: &[u8], speed: &[u8]) -> Result<Heading, HeadingError> {
    let value = |(whole, part): (u32, f32)| whole as f32 + part;
    let course = number(course, "course")?.map(|degrees| value(degrees).to_radians());
    let speed = number(speed, "speed")?.map(|knots| value(knots) * KNOT);
    Ok(Heading { course, speed, ..Heading::default() })
}

/// Reads a number without sign, its whole part and the rest; `None` where the field is empty.
fn number(field: &[u8], what: &'static str) -> Result<Option<(u32, f32)>, HeadingError> {
    if field.is_empty() {
        return Ok(None);
    }
    let mut parts = field.splitn(2, |byte| *byte == b'.');
    let (whole, part) = (parts.next().unwrap_or_default(), parts.next().unwrap_or(b"0"));
    let is_number = |text: &[u8]| !text.is_empty() && text.iter().all(u8::is_ascii_digit);
    let digit = |byte: &u8| byte.wrapping_sub(b'0');
    let value = whole
        .iter()
        .try_fold(0u32, |sum, byte| sum.checked_mul(10)?.checked_add(digit(byte).into()))
        .filter(|_| is_number(whole) && is_number(part))
        .ok_or(HeadingError::Field(what))?;
    Ok(Some((value, part.iter().rev().fold(0.0, |sum, byte| (sum + f32::from(digit(byte))) / 10.0))))
}

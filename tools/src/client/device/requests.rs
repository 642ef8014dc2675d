//! The requests of a user, made of diagnostic services and data identifiers (tables in [`gyronet::uds`]).

use super::{Device, DeviceError};
use crate::client::bus::Bus;
use gyronet::can::diagnosis::DiagnosisIds;
use gyronet::can::wheel::WheelSettings;
use gyronet::coprocessor::Contradiction;
use gyronet::fog::FogCounters;
use gyronet::heading::CourseCounters;
use gyronet::health::{Counters, InputCounters, MonitorCounters};
use gyronet::service::message::{AccessCounters, AllCounters, Info, LineCounters, PROTOCOL};
use gyronet::store::{Calibration, Configuration, Learned, Record, UnitMap};
use gyronet::uds::Session;
use serde::de::DeserializeOwned;
use serde::de::value::{Error, SeqAccessDeserializer, SeqDeserializer};

/// Data identifier of the configuration, which follows the version of its layout.
pub const CONFIGURATION: u16 = 0x0100;
pub const WHEELS: u16 = 0x0101;
const CALIBRATION: u16 = 0x0102;
const PIPELINE_COUNTERS: u16 = 0x0105;
const INPUT_COUNTERS: u16 = 0x0106;
const FOG_COUNTERS: u16 = 0x0109;
const INFO: u16 = 0x010A;
/// Data identifier of the map of the unit's gyro.
pub const UNIT: u16 = 0x010D;
/// Data identifier of the public key that controls who may write.
pub const KEY: u16 = 0x0110;
pub const ACCESS: u16 = 0x0111;
const ACCESS_COUNTERS: u16 = 0x0113;
const LEARNED: u16 = 0x0115;
const FORWARD: u16 = 0x0116;
const LEVEL: u16 = 0x0118;
const COURSE: u16 = 0x0119;
const CONTRADICTION: u16 = 0x011B;
/// Data identifier of the firmware and of the head of its update.
pub const FIRMWARE: u16 = 0x011A;
pub const COUNTERS: [u8; 7] = {
    let [a, b] = PIPELINE_COUNTERS.to_be_bytes();
    let [c, d] = INPUT_COUNTERS.to_be_bytes();
    let [e, f] = FOG_COUNTERS.to_be_bytes();
    [0x22, a, b, c, d, e, f]
};
pub const USE_DOWNLOAD: u16 = 0xFF01;
/// The other routines.
const FORGET: u16 = 0x0205;
const START: u8 = 1;

type Result<T> = std::result::Result<T, DeviceError>;

impl<B: Bus> Device<B> {
    pub fn new(bus: B, name: &str) -> Self {
        Self::with_ids(bus, name, &DiagnosisIds::DEFAULT).expect("three of 11 bits")
    }

    pub fn info(&mut self) -> Result<Info> {
        let record = self.read(INFO)?;
        if record.first() != Some(&PROTOCOL) {
            return Err(DeviceError::Mismatch);
        }
        decode(&record)
    }

    pub fn configuration(&mut self) -> Result<Configuration> {
        versioned::<Configuration>(&self.read(CONFIGURATION)?)
    }

    /// Stores a configuration, which takes effect after a restart.
    pub fn set_configuration(&mut self, configuration: &Configuration) -> Result<()> {
        self.write(CONFIGURATION, &configuration_content(configuration)?)
    }

    pub fn wheels(&mut self) -> Result<WheelSettings> {
        decode(&self.read(WHEELS)?)
    }

    /// Stores the settings of the wheel frames, which take effect after a restart.
    pub fn set_wheels(&mut self, wheels: &WheelSettings) -> Result<()> {
        self.write(WHEELS, &content(wheels)?)
    }

    pub fn calibration(&mut self) -> Result<Calibration> {
        versioned::<Calibration>(&self.read(CALIBRATION)?)
    }

    /// Returns what the board has learnt about its sensor at standstills.
    pub fn learned(&mut self) -> Result<Learned> {
        decode(&self.read(LEARNED)?)
    }

    /// Returns the forward direction in the configured axes, deg to the left of x, and its sigma; `None` until drives
    /// have shown it.
    pub fn forward_deg(&mut self) -> Result<Option<[f32; 2]>> {
        self.angles_deg(FORWARD)
    }

    /// Returns roll and pitch of the sensor beyond the configured mounting and their sigma, deg; `None` before the first
    /// standstill.
    pub fn level_deg(&mut self) -> Result<Option<[f32; 3]>> {
        self.angles_deg(LEVEL)
    }

    /// Reads angles behind a state, which is 0 where they are not known.
    fn angles_deg<const N: usize>(&mut self, id: u16) -> Result<Option<[f32; N]>> {
        let content = self.read(id)?;
        let (state, codes) = content.split_first().ok_or(DeviceError::Mismatch)?;
        let angles = codes.as_chunks::<2>().0.iter().map(|code| f32::from(i16::from_be_bytes(*code)) / 100.0);
        let angles: Option<[f32; N]> = angles.collect::<Vec<_>>().try_into().ok();
        if *state == 0 { Ok(None) } else { angles.map(Some).ok_or(DeviceError::Mismatch) }
    }

    /// Returns how well the gain is known by courses, its code, the gain and its sigma, and the counters of courses.
    pub fn course(&mut self) -> Result<(u8, [f32; 2], CourseCounters)> {
        let content = self.read(COURSE)?;
        let [state, a, b, c, d, words @ ..] = content.as_slice() else { return Err(DeviceError::Mismatch) };
        let gain = [[*a, *b], [*c, *d]].map(|code| f32::from(i16::from_be_bytes(code)) * 1e-5);
        Ok((*state, gain, Words(words).fields()?))
    }

    /// Makes the board forget what it has learnt about its sensor.
    pub fn forget_learned(&mut self) -> Result<()> {
        self.enter(Session::Extended)?;
        let [high, low] = FORGET.to_be_bytes();
        self.ask(&[0x31, START, high, low]).map(drop)
    }

    /// Stores the map of this unit's gyro, or removes it; this takes effect after a restart.
    pub fn set_unit(&mut self, unit: Option<UnitMap>) -> Result<()> {
        self.write(UNIT, &content(&unit)?)
    }

    pub fn counters(&mut self) -> Result<AllCounters> {
        let counters = counters(&self.ask(&COUNTERS)?)?;
        let contradiction = contradiction(&self.read(CONTRADICTION)?).ok_or(DeviceError::Mismatch)?;
        Ok(AllCounters { contradiction, ..counters })
    }

    /// Returns the counts of requests that were refused for lack of access since the board started.
    pub fn access_counters(&mut self) -> Result<AccessCounters> {
        Words(&self.read(ACCESS_COUNTERS)?).fields()
    }

    /// Restarts the board, once the vehicle is proven to stand: what was stored just before may have interrupted the proof.
    pub fn restart(&mut self) -> Result<()> {
        self.enter(Session::Extended)?;
        self.ask_at_rest(&[0x11, 1]).map(drop)
    }

    pub fn read(&mut self, id: u16) -> Result<Vec<u8>> {
        let id = id.to_be_bytes();
        let response = self.ask(&[0x22, id[0], id[1]])?;
        response.strip_prefix(&id).map(<[u8]>::to_vec).ok_or(DeviceError::Mismatch)
    }

    /// Writes a data identifier, with a signature if the board has a key.
    pub(super) fn write(&mut self, id: u16, content: &[u8]) -> Result<()> {
        self.enter(Session::Extended)?;
        let trailer = self.trailer(id, content)?;
        self.ask(&[&[0x2E][..], &id.to_be_bytes(), content, &trailer].concat()).map(drop)
    }
}

/// Encodes a record as it is written to a board, and signed.
pub fn content(record: &impl serde::Serialize) -> Result<Vec<u8>> {
    postcard::to_stdvec(record).map_err(|_| DeviceError::TooLong)
}

/// Encodes a configuration as it is written to a board, and signed: the version of its layout, then the record.
pub fn configuration_content(configuration: &Configuration) -> Result<Vec<u8>> {
    Ok([&[Configuration::VERSION][..], &content(configuration)?].concat())
}

fn decode<T: DeserializeOwned>(record: &[u8]) -> Result<T> {
    postcard::from_bytes(record).map_err(|_| DeviceError::Mismatch)
}

/// Decodes a record that follows the version of its layout.
fn versioned<R: Record>(bytes: &[u8]) -> Result<R> {
    match bytes.split_first() {
        Some((version, record)) if *version == R::VERSION => decode(record),
        _ => Err(DeviceError::Mismatch),
    }
}

/// Decodes the counters from a response to [`COUNTERS`] without its first byte; a contradiction is not among them.
pub fn counters(response: &[u8]) -> Result<AllCounters> {
    let mut words = Words(response);
    words.identifier(PIPELINE_COUNTERS)?;
    let pipeline: Counters = words.fields()?;
    words.identifier(INPUT_COUNTERS)?;
    let (watch, inputs, lines): (MonitorCounters, InputCounters, LineCounters) =
        (words.fields()?, words.fields()?, words.fields()?);
    words.identifier(FOG_COUNTERS)?;
    let fog: FogCounters = words.fields()?;
    if words.0.is_empty() {
        Ok(AllCounters { pipeline, watch, lines, fog, inputs, ..AllCounters::default() })
    } else {
        Err(DeviceError::Mismatch)
    }
}

/// Decodes a count and five codes, of which the largest says that there is none.
fn contradiction(bytes: &[u8]) -> Option<Contradiction> {
    let (seconds, codes) = bytes.split_first_chunk()?;
    let codes: &[[u8; 2]; 5] = codes.as_chunks().0.try_into().ok().filter(|_| codes.len() == 10)?;
    let code = |at: usize| Some(i16::from_be_bytes(codes[at])).filter(|code| *code != i16::MAX);
    Some(Contradiction {
        seconds: u32::from_be_bytes(*seconds),
        gyros: [code(0), code(1)],
        lateral: code(2),
        wheels: code(3).zip(code(4)).map(|(speed, difference)| [speed, difference]),
    })
}

/// The words of a response that are not decoded yet.
struct Words<'a>(&'a [u8]);

impl Words<'_> {
    fn identifier(&mut self, id: u16) -> Result<()> {
        self.0 = self.0.strip_prefix(&id.to_be_bytes()).ok_or(DeviceError::Mismatch)?;
        Ok(())
    }

    /// Decodes a type from as many words as it has fields, in the order of their declaration.
    fn fields<T: DeserializeOwned>(&mut self) -> Result<T> {
        let words = std::iter::from_fn(|| {
            let (word, rest) = self.0.split_first_chunk()?;
            self.0 = rest;
            Some(u32::from_be_bytes(*word))
        });
        let fields = SeqDeserializer::<_, Error>::new(words);
        T::deserialize(SeqAccessDeserializer::new(fields)).map_err(|_| DeviceError::Mismatch)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_stand_in_the_order_of_their_types() {
        let words =
            |from: u32, count: u32| (from..from + count).flat_map(u32::to_be_bytes).collect::<Vec<u8>>();
        let response = [
            &PIPELINE_COUNTERS.to_be_bytes()[..],
            &words(0, 13),
            &INPUT_COUNTERS.to_be_bytes(),
            &words(100, 19),
            &FOG_COUNTERS.to_be_bytes(),
            &words(200, 7),
        ]
        .concat();
        let all = counters(&response).expect("whole");
        assert_eq!((all.pipeline.samples, all.pipeline.moved_mounts), (0, 12));
        assert_eq!((all.watch.silences, all.inputs.imu_errors, all.lines.unsent), (100, 105, 114));
        assert_eq!((all.lines.frames_lost, all.fog.samples, all.fog.contradicted), (118, 200, 206));
        for length in 0..response.len() {
            assert!(counters(&response[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn a_contradiction_has_five_numbers_or_none() {
        let bytes = [0, 0, 0, 7, 0x01, 0xF4, 0x7F, 0xFF, 0xFF, 0x9C, 0x05, 0xDC, 0x00, 0x0B];
        let expected = Contradiction {
            seconds: 7,
            gyros: [Some(500), None],
            lateral: Some(-100),
            wheels: Some([1500, 11]),
        };
        assert_eq!(contradiction(&bytes), Some(expected));
        assert_eq!(contradiction(&bytes[..13]), None);
    }
}

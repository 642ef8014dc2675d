//! A configuration defines which messages are sent, with their identifiers, periods and E2E protection.
//!
//! [`Settings`] are what a user writes; a [`Config`] holds settings that have passed the check.

pub use super::e2e::DataIdMode;
pub use super::settings::{BoschSettings, E2e, Settings, StatusSettings, YawSettings};

use super::bosch::LAYOUTS;
use super::load::{Periodic, per_mille};
use super::status;
use crate::sample::PERIOD_US;
use embedded_can::{Id, StandardId};
use heapless::Vec;

/// Period of the samples, and of the messages whose layout fixes it.
pub(super) const SAMPLE_MS: u16 = (PERIOD_US / 1000) as u16;
/// Longest period of a message, ms; a receiver's timeout is a few periods.
const MAX_PERIOD_MS: u16 = 1000;
/// Identifiers reserved for diagnosis (ISO 15765-4).
const DIAGNOSIS: core::ops::RangeInclusive<u16> = 0x7DF..=0x7EF;
/// The bit rates of the bus, bit/s.
pub const BIT_RATES: [u32; 4] = [125_000, 250_000, 500_000, 1_000_000];
/// Highest worst-case bus load, 1/1000; above it other nodes would wait too long.
const MAX_BUS_LOAD: u32 = 800;
/// Largest number of messages in a configuration.
pub const MAX_MESSAGES: usize = 8;

#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum ConfigError {
    #[error("no message is configured")]
    Empty,
    #[error("bits_per_second: {0} is not one of {BIT_RATES:?}")]
    BitRate(u32),
    #[error("identifier {0} (0x{0:03x}) is above 2047, or reserved for diagnosis (0x7df to 0x7ef)")]
    Identifier(u16),
    #[error("identifier {0} (0x{0:03x}) is used twice")]
    DuplicateIdentifier(u16),
    #[error("period_ms: {0} is not a multiple of {SAMPLE_MS} up to {MAX_PERIOD_MS}")]
    Period(u16),
    #[error("E2E identifier {0:x} has more than 12 bits")]
    DataId(u16),
    /// Two messages have the same E2E identifier; a receiver would not notice if they were swapped.
    #[error("an E2E identifier is used twice")]
    DuplicateDataId,
    #[error(
        "the messages are {}.{} % of the bus at {} kbit/s, above {} %",
        .per_mille / 10, .per_mille % 10, .bits_per_second / 1_000, MAX_BUS_LOAD / 10
    )]
    Overload { per_mille: u32, bits_per_second: u32 },
}

/// Checked [`Settings`]: the messages that are sent, their periods and their protection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config {
    settings: Settings,
}

impl Config {
    /// [`Settings::DEFAULT`], which pass the check (as a test shows).
    pub const DEFAULT: Self = Self { settings: Settings::DEFAULT };
    /// No message at all, for a replay of which only the rates are used. [`Config::new`] refuses it for a bus.
    pub const SILENT: Self = Self { settings: Settings { bosch: None, yaw: None, ..Settings::DEFAULT } };

    /// Checks settings.
    pub fn new(settings: Settings) -> Result<Self, ConfigError> {
        if !BIT_RATES.contains(&settings.bits_per_second) {
            return Err(ConfigError::BitRate(settings.bits_per_second));
        }
        if let Some(yaw) = &settings.yaw {
            check_yaw(yaw, settings.bosch)?;
        }
        if let Some(StatusSettings { id }) = settings.status {
            let others = Self { settings: Settings { status: None, ..settings } };
            check_ids([id], |id| others.sends(Id::Standard(id)))?;
        }
        let config = Self { settings };
        if config.messages().is_empty() {
            return Err(ConfigError::Empty);
        }
        config.check_load(&[])?;
        Ok(config)
    }

    fn check_load(&self, further: &[Periodic]) -> Result<(), ConfigError> {
        let bits_per_second = self.settings.bits_per_second;
        let per_mille = per_mille(&self.messages(), bits_per_second) + per_mille(further, bits_per_second);
        if per_mille > MAX_BUS_LOAD {
            Err(ConfigError::Overload { per_mille, bits_per_second })
        } else {
            Ok(())
        }
    }

    /// Returns the checked settings.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns every message that is sent, in the order of sending.
    pub fn messages(&self) -> Vec<Periodic, MAX_MESSAGES> {
        let Settings { bosch, yaw, status, .. } = self.settings;
        let classic = |id, period_ms| Periodic { id: Id::Standard(id), period_ms, is_fd: false };
        let bosch = bosch_ids(bosch).map(|id| classic(id, SAMPLE_MS));
        let yaw = yaw.into_iter().flat_map(|yaw| {
            let ids = yaw.ids.into_iter().filter(move |_| yaw.fd.is_none()).chain(yaw.fd);
            let message = move |id| Periodic { is_fd: yaw.fd.is_some(), ..classic(id, yaw.period_ms) };
            ids.filter_map(StandardId::new).map(message)
        });
        let status = status.and_then(|status| StandardId::new(status.id));
        let status = status.map(|id| classic(id, status::PERIOD_MS));
        let mut messages = Vec::new();
        for message in bosch.chain(yaw).chain(status) {
            // MAX_MESSAGES holds every message that can be configured.
            let _ = messages.push(message);
        }
        messages
    }

    /// Checks the identifiers of further messages (of [`super::fog_encoder`]) against those configured here.
    #[doc(hidden)]
    pub fn check_further(&self, ids: [u16; 3]) -> Result<(), ConfigError> {
        check_ids(ids, |id| self.sends(Id::Standard(id)))
    }

    /// Checks the load with three further messages of 11-bit identifiers, one for each sample.
    #[cfg(feature = "store")]
    pub(crate) fn check_further_load(&self) -> Result<(), ConfigError> {
        let id = Id::Standard(StandardId::ZERO);
        self.check_load(&[Periodic { id, period_ms: SAMPLE_MS, is_fd: false }; 3])
    }

    /// Returns whether one of our messages, or a part of the CAN FD frame, has this identifier; no input may use it.
    pub fn sends(&self, id: Id) -> bool {
        let is_part = |id: StandardId| self.settings.yaw.is_some_and(|yaw| yaw.ids.contains(&id.as_raw()));
        matches!(id, Id::Standard(id) if is_part(id))
            || self.messages().iter().any(|message| message.id == id)
    }

    pub(crate) const fn samples_per_yaw(&self) -> u8 {
        match &self.settings.yaw {
            // At most 1000 / 10.
            Some(yaw) => (yaw.period_ms / SAMPLE_MS) as u8,
            None => 1,
        }
    }
}

fn bosch_ids(bosch: Option<BoschSettings>) -> impl Iterator<Item = StandardId> {
    let count = match bosch {
        Some(BoschSettings { tx1_only: true }) => 1,
        Some(BoschSettings { tx1_only: false }) => LAYOUTS.len(),
        None => 0,
    };
    LAYOUTS.into_iter().take(count).map(|layout| layout.id)
}

fn check_yaw(yaw: &YawSettings, bosch: Option<BoschSettings>) -> Result<(), ConfigError> {
    let is_bosch = |id| bosch_ids(bosch).any(|other| other == id);
    check_ids(yaw.ids, is_bosch)?;
    if let Some(fd) = yaw.fd {
        // The three are the names of its parts.
        check_ids([fd], |id| is_bosch(id) || yaw.ids.contains(&id.as_raw()))?;
    }
    if yaw.period_ms == 0 || yaw.period_ms > MAX_PERIOD_MS || !yaw.period_ms.is_multiple_of(SAMPLE_MS) {
        return Err(ConfigError::Period(yaw.period_ms));
    }
    check_e2e(&yaw.e2e)
}

/// Checks that all identifiers are valid, and that none equals another one or `taken`.
fn check_ids<const N: usize>(ids: [u16; N], taken: impl Fn(StandardId) -> bool) -> Result<(), ConfigError> {
    for (k, raw) in ids.into_iter().enumerate() {
        let id = StandardId::new(raw).filter(|_| !DIAGNOSIS.contains(&raw));
        let id = id.ok_or(ConfigError::Identifier(raw))?;
        if ids.get(..k).unwrap_or_default().contains(&raw) || taken(id) {
            return Err(ConfigError::DuplicateIdentifier(raw));
        }
    }
    Ok(())
}

fn check_e2e(e2e: &E2e) -> Result<(), ConfigError> {
    let distinct = |seen: [u16; 3]| seen[0] != seen[1] && seen[1] != seen[2] && seen[0] != seen[2];
    let E2e::P01 { mode, data_ids } = e2e;
    let unique = match mode {
        DataIdMode::Low => distinct(data_ids.map(|id| id & 0xFF)),
        DataIdMode::Nibble => {
            if let Some(id) = data_ids.iter().find(|id| **id > 0xFFF) {
                return Err(ConfigError::DataId(*id));
            }
            distinct(*data_ids)
        }
        // Each byte alone must distinguish the messages.
        DataIdMode::Alternating => {
            distinct(data_ids.map(|id| id & 0xFF)) && distinct(data_ids.map(|id| id >> 8))
        }
        DataIdMode::Both => distinct(*data_ids),
    };
    if unique { Ok(()) } else { Err(ConfigError::DuplicateDataId) }
}

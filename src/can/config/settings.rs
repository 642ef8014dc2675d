//! These are the settings of the bus that a user can change.

use crate::can::e2e::{DataIdMode, P01, P02, P05, P11, P11Mode, Profile};

/// E2E profile of the three yaw messages with their identifiers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum E2e {
    /// Profile 1.
    P01 {
        /// The way in which the identifier enters the CRC.
        mode: DataIdMode,
        /// Rate, angle, detail.
        data_ids: [u16; 3],
    },
    /// Profile 2.
    P02 {
        /// Rate, angle, detail; one for each counter value.
        data_ids: [[u8; 16]; 3],
    },
    /// Profile 5.
    P05 {
        /// Rate, angle, detail.
        data_ids: [u16; 3],
    },
    /// Profile 11.
    P11 {
        /// The way in which the identifier enters the CRC.
        mode: P11Mode,
        /// Rate, angle, detail.
        data_ids: [u16; 3],
    },
}

impl E2e {
    /// Returns the profile of each message.
    #[must_use]
    pub fn profiles(&self) -> [Profile; 3] {
        match *self {
            Self::P01 { mode, data_ids } => data_ids.map(|data_id| Profile::P01(P01 { data_id, mode })),
            Self::P02 { data_ids } => data_ids.map(|data_ids| Profile::P02(P02 { data_ids })),
            Self::P05 { data_ids } => data_ids.map(|data_id| Profile::P05(P05 { data_id })),
            Self::P11 { mode, data_ids } => data_ids.map(|data_id| Profile::P11(P11 { data_id, mode })),
        }
    }
}

/// The Bosch MM5.10 set; its layout fixes the period at 10 ms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoschSettings {
    /// TX1 alone, for receivers of the yaw rate only.
    pub tx1_only: bool,
}

/// Our own yaw messages: rate, angle, detail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct YawSettings {
    /// 11-bit identifiers of rate, angle, detail.
    pub ids: [u16; 3],
    /// A multiple of 10 ms.
    pub period_ms: u16,
    /// Protection.
    pub e2e: E2e,
}

/// J1939 VDC2; the standard fixes the period at 10 ms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Vdc2Settings {
    /// Our address on the bus.
    pub source: u8,
}

/// The messages on the bus; [`super::Config::new`] checks them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Bit rate of the bus.
    pub bits_per_second: u32,
    /// The drop-in set.
    pub bosch: Option<BoschSettings>,
    /// Our own messages.
    pub yaw: Option<YawSettings>,
    /// Trucks and machines.
    pub vdc2: Option<Vdc2Settings>,
}

impl Settings {
    /// A car: the Bosch set and our own messages every 10 ms.
    pub const DEFAULT: Self = Self {
        bits_per_second: 500_000,
        bosch: Some(BoschSettings { tx1_only: false }),
        yaw: Some(YawSettings {
            ids: [0x1A0, 0x1A1, 0x1A2],
            period_ms: 10,
            e2e: E2e::P01 { mode: DataIdMode::Both, data_ids: [0x1A0, 0x1A1, 0x1A2] },
        }),
        vdc2: None,
    };

    /// Settings that fit an SLCAN line of 115200 bit/s, time stamps included: our own messages go out five times
    /// less often, and the mean over the period loses nothing.
    pub const SLCAN_115200: Self = Self {
        yaw: match Self::DEFAULT.yaw {
            Some(yaw) => Some(YawSettings { period_ms: 50, ..yaw }),
            None => None,
        },
        ..Self::DEFAULT
    };
}

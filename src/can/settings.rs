//! The bus settings that a user can change.

use super::e2e::{DataIdMode, P01, Profile};

/// The E2E profile of the three yaw messages, with their data identifiers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum E2e {
    /// Profile 1, whose bytes profile 11 also sends.
    P01 {
        /// Bytes of the identifier that enter the CRC.
        mode: DataIdMode,
        /// Data identifiers of rate, angle, detail.
        data_ids: [u16; 3],
    },
}

impl E2e {
    /// Returns the profile of each message.
    pub const fn profiles(&self) -> [Profile; 3] {
        let Self::P01 { mode, data_ids: [rate, angle, detail] } = *self;
        [
            Profile::P01(P01 { data_id: rate, mode }),
            Profile::P01(P01 { data_id: angle, mode }),
            Profile::P01(P01 { data_id: detail, mode }),
        ]
    }
}

/// The Bosch MM5.10 set; its layout fixes the period at 10 ms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoschSettings {
    /// True if only TX1 is sent, for receivers that use only the yaw rate.
    pub tx1_only: bool,
}

/// Our own yaw messages: rate, angle, detail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct YawSettings {
    /// 11-bit identifiers of rate, angle, detail.
    pub ids: [u16; 3],
    /// Period in ms, a multiple of 10.
    pub period_ms: u16,
    /// E2E protection.
    pub e2e: E2e,
    /// Identifier of one CAN FD frame in place of the three ([`crate::can::fd`]), of 11 bits; `None` for classic frames.
    pub fd: Option<u16>,
}

/// The slow status message ([`crate::can::status`]), which is sent once a second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StatusSettings {
    /// 11-bit identifier, which is also the E2E data identifier; [`crate::can::status::STATUS_ID`] is free by default.
    pub id: u16,
}

/// The messages on the bus; [`super::config::Config::new`] checks them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// Bit rate of the bus, bit/s.
    pub bits_per_second: u32,
    /// Bosch MM5.10 messages, if sent.
    pub bosch: Option<BoschSettings>,
    /// Our own yaw messages, if sent.
    pub yaw: Option<YawSettings>,
    /// Slow status message, if sent.
    pub status: Option<StatusSettings>,
}

impl Settings {
    /// Settings for a car: the Bosch set and our own messages every 10 ms.
    pub const DEFAULT: Self = Self {
        bits_per_second: 500_000,
        bosch: Some(BoschSettings { tx1_only: false }),
        yaw: Some(YawSettings {
            ids: [0x1A0, 0x1A1, 0x1A2],
            period_ms: 10,
            e2e: E2e::P01 { mode: DataIdMode::Both, data_ids: [0x1A0, 0x1A1, 0x1A2] },
            fd: None,
        }),
        status: None,
    };
}

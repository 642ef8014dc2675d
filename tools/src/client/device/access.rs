//! Gets access to a board with a key: answers the board's challenge, and signs the written content.

use super::requests::ACCESS;
use super::{Authority, Device, DeviceError};
use crate::client::bus::Bus;
use crate::signing::unhex;
use gyronet::uds::Session;
use gyronet::uds::signature::SEED;

#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct AccessState {
    /// `open` (no key is stored), `locked`, or `unlocked` for this session.
    pub state: &'static str,
    /// The counter of the newest signature that was accepted.
    pub counter: u32,
    /// Consecutive wrong answers to challenges.
    pub wrong_answers: u8,
    /// First bytes of the public key, hexadecimal; empty if no key is stored.
    pub key: String,
    /// The serial number of the board, hexadecimal.
    pub serial: String,
}

impl<B: Bus> Device<B> {
    pub fn access(&mut self) -> Result<AccessState, DeviceError> {
        let state = self.read(ACCESS)?;
        let [state, a, b, c, d, wrong_answers, key @ ..] =
            <[u8; 10]>::try_from(state).map_err(|_| DeviceError::Mismatch)?;
        let state = ["open", "locked", "unlocked"].get(usize::from(state)).ok_or(DeviceError::Mismatch)?;
        let serial = String::from_utf8(self.read(0xF18C)?).map_err(|_| DeviceError::Mismatch)?;
        let key = if key == [0; 4] { String::new() } else { crate::signing::hex(&key) };
        Ok(AccessState { state, counter: u32::from_be_bytes([a, b, c, d]), wrong_answers, key, serial })
    }

    /// Enters a session, and unlocks a locked board with the private key, if there is one. The board leaves the
    /// session after 5 s without a request.
    pub(super) fn enter(&mut self, session: Session) -> Result<(), DeviceError> {
        self.ask(&[0x10, session as u8])?;
        let access = self.access()?;
        let Authority::Key(_) = &self.authority else { return Ok(()) };
        if access.state != "locked" {
            return Ok(());
        }
        let seed = self.ask(&[0x27, 1])?;
        let seed: [u8; SEED] =
            seed.get(1..).and_then(|seed| seed.try_into().ok()).ok_or(DeviceError::Mismatch)?;
        let serial = unhex(&access.serial).ok_or(DeviceError::Mismatch)?;
        let Authority::Key(key) = &self.authority else { return Ok(()) };
        let answer = key.answer(&serial, &seed);
        self.ask(&[&[0x27, 2][..], &answer].concat()).map(drop)
    }

    /// Returns the signature trailer of a content for this board; empty if the board has no key, or without
    /// authority.
    pub(super) fn trailer(&mut self, target: u16, content: &[u8]) -> Result<Vec<u8>, DeviceError> {
        let access = self.access()?;
        Ok(match &self.authority {
            _ if access.state == "open" => Vec::new(),
            Authority::None => Vec::new(),
            Authority::Signature(trailer) => trailer.to_vec(),
            Authority::Key(key) => {
                let serial = unhex(&access.serial).ok_or(DeviceError::Mismatch)?;
                key.trailer(target, Some(serial), access.counter.saturating_add(1), content).to_vec()
            }
        })
    }

    /// Stores the public key that controls who may write; zeros remove the key.
    pub fn set_key(&mut self, key: &[u8; 32]) -> Result<(), DeviceError> {
        self.write(super::requests::KEY, key)
    }
}

//! These services control the server itself: session, restart, messages of the board, memory of troubles.

use super::response::{Nrc, Response, exactly, nrc, put};
use super::services::{SUPPRESS, Services, Session};
use crate::service::message::Request;
use crate::service::{Device, MappedSlots};
use automotive_diag::uds::ResetType;
use embedded_storage::nor_flash::NorFlash;

/// Longest time to a response, ms, and to one after "response pending", 10 ms (P2, P2*).
const P2_MS: u16 = 50;
const P2_STAR_10_MS: u16 = 500;

/// Each returns whether a positive response is wanted.
impl Services {
    /// Enters a session, which ends the one before.
    pub(super) fn session_control(&mut self, rest: &[u8], out: &mut Response) -> Result<bool, Nrc> {
        let [sub] = exactly(rest)?;
        let session = match sub & !SUPPRESS {
            1 => Session::Default,
            2 => Session::Programming,
            3 => Session::Extended,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        self.enter(session);
        let [[a, b], [c, d]] = [P2_MS.to_be_bytes(), P2_STAR_10_MS.to_be_bytes()];
        put(out, &[session as u8, a, b, c, d])?;
        Ok(sub & SUPPRESS == 0)
    }

    /// Has the board restart, once the response is out.
    pub(super) fn reset<R: NorFlash, W: MappedSlots>(
        &mut self,
        rest: &[u8],
        device: &mut Device<R, W>,
        out: &mut Response,
    ) -> Result<bool, Nrc> {
        let [sub] = exactly(rest)?;
        let reset = ResetType::from_repr(sub & !SUPPRESS);
        if !matches!(reset, Some(ResetType::HardReset | ResetType::SoftReset)) {
            return Err(Nrc::SubFunctionNotSupported);
        }
        self.security.check(device)?;
        device.act(&Request::Restart).map_err(nrc)?;
        self.is_restarting = true;
        put(out, &[sub & !SUPPRESS])?;
        Ok(sub & SUPPRESS == 0)
    }

    /// Keeps the session.
    pub(super) fn tester_present(rest: &[u8], out: &mut Response) -> Result<bool, Nrc> {
        let [sub] = exactly(rest)?;
        if sub & !SUPPRESS != 0 {
            return Err(Nrc::SubFunctionNotSupported);
        }
        put(out, &[0])?;
        Ok(sub & SUPPRESS == 0)
    }

    /// Stops the messages of the board, or lets them go out again.
    pub(super) fn communication_control<R: NorFlash, W: MappedSlots>(
        &mut self,
        rest: &[u8],
        device: &mut Device<R, W>,
        out: &mut Response,
    ) -> Result<bool, Nrc> {
        self.needs(Session::Extended)?;
        let [sub, what] = exactly(rest)?;
        let is_silenced = match sub & !SUPPRESS {
            0 => false,
            1 => true,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        // Normal messages, or they and those of a network management that this board has not got.
        if !matches!(what, 1 | 3) {
            return Err(Nrc::RequestOutOfRange);
        }
        self.security.check(device)?;
        if is_silenced && !device.may_interrupt() {
            return Err(Nrc::ConditionsNotCorrect);
        }
        self.is_silenced = is_silenced;
        put(out, &[sub & !SUPPRESS])?;
        Ok(sub & SUPPRESS == 0)
    }

    /// Stops the memory of troubles, or lets it go on.
    pub(super) fn dtc_setting<R: NorFlash, W: MappedSlots>(
        &mut self,
        rest: &[u8],
        device: &mut Device<R, W>,
        out: &mut Response,
    ) -> Result<bool, Nrc> {
        self.needs(Session::Extended)?;
        let sub = *rest.first().ok_or(Nrc::IncorrectMessageLengthOrInvalidFormat)?;
        self.security.check(device)?;
        self.memory.is_enabled = match sub & !SUPPRESS {
            1 => true,
            2 => false,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        put(out, &[sub & !SUPPRESS])?;
        Ok(sub & SUPPRESS == 0)
    }

    /// Clears one trouble or all.
    pub(super) fn clear_troubles<R: NorFlash, W: MappedSlots>(
        &mut self,
        rest: &[u8],
        device: &mut Device<R, W>,
    ) -> Result<bool, Nrc> {
        let [a, b, c] = exactly(rest)?;
        self.security.check(device)?;
        let is_known = self.memory.clear(u32::from_be_bytes([0, a, b, c]));
        if is_known { Ok(true) } else { Err(Nrc::RequestOutOfRange) }
    }
}

//! These services control the server and the board: session, reset, communication, and the trouble memory.

use super::response::{Nrc, Response, exactly, nrc, put};
use super::services::Services;
use super::session::Session;
use crate::service::{Device, MappedSlots};
use automotive_diag::uds::ResetType;
use embedded_storage::nor_flash::NorFlash;

/// P2 and P2*: longest time to a response (ms), and to the next one after "response pending" (units of 10 ms).
const P2_MS: u16 = 50;
const P2_STAR_10_MS: u16 = 500;

impl Services {
    pub(super) fn session_control(&mut self, sub: u8, rest: &[u8], out: &mut Response) -> Result<(), Nrc> {
        let session = match sub {
            1 => Session::Default,
            2 => Session::Programming,
            3 => Session::Extended,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        let [] = exactly(rest)?;
        self.enter(session);
        let [[a, b], [c, d]] = [P2_MS.to_be_bytes(), P2_STAR_10_MS.to_be_bytes()];
        put(out, &[a, b, c, d])
    }

    /// Requests a restart of the board, which follows once the response has been sent.
    pub(super) fn reset<R: NorFlash, W: MappedSlots>(
        &mut self,
        sub: u8,
        rest: &[u8],
        device: &mut Device<R, W>,
    ) -> Result<(), Nrc> {
        if !matches!(ResetType::from_repr(sub), Some(ResetType::HardReset | ResetType::SoftReset)) {
            return Err(Nrc::SubFunctionNotSupported);
        }
        self.security.check(device)?;
        let [] = exactly(rest)?;
        device.restart().map_err(nrc)?;
        self.is_restarting = true;
        Ok(())
    }

    /// Answers TesterPresent. Any frame of the tester keeps the session alive.
    pub(super) fn tester_present(sub: u8, rest: &[u8]) -> Result<(), Nrc> {
        if sub != 0 {
            return Err(Nrc::SubFunctionNotSupported);
        }
        exactly(rest).map(|[]: [u8; 0]| ())
    }

    /// Stops or resumes the messages of the board. What it receives is not stopped: requests would be lost, too.
    pub(super) fn communication_control<R: NorFlash, W: MappedSlots>(
        &mut self,
        sub: u8,
        rest: &[u8],
        device: &mut Device<R, W>,
    ) -> Result<(), Nrc> {
        // Bit 0 stops what the board sends, bit 1 what it receives.
        let is_silenced = match sub {
            0 | 2 => false,
            1 | 3 => true,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        self.security.check(device)?;
        let [kind] = exactly(rest)?;
        // Normal messages, alone or with those of network management, which this board does not have.
        if !matches!(kind, 1 | 3) {
            return Err(Nrc::RequestOutOfRange);
        }
        if is_silenced && !device.may_interrupt() {
            return Err(Nrc::ConditionsNotCorrect);
        }
        self.is_silenced = is_silenced;
        Ok(())
    }

    pub(super) fn dtc_setting<R: NorFlash, W: MappedSlots>(
        &mut self,
        sub: u8,
        device: &mut Device<R, W>,
    ) -> Result<(), Nrc> {
        let is_enabled = match sub {
            1 => true,
            2 => false,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        self.security.check(device)?;
        self.memory.is_enabled = is_enabled;
        Ok(())
    }

    pub(super) fn clear_troubles<R: NorFlash, W: MappedSlots>(
        &mut self,
        rest: &[u8],
        device: &mut Device<R, W>,
    ) -> Result<(), Nrc> {
        self.security.check(device)?;
        let [a, b, c] = exactly(rest)?;
        let is_known = self.memory.clear(u32::from_be_bytes([0, a, b, c]));
        if is_known { Ok(()) } else { Err(Nrc::RequestOutOfRange) }
    }
}

//! These services control the server and the board: session, reset, communication, and the trouble memory.

use super::exchange::Exchange;
use super::lock::Seed;
use super::response::{Nrc, exactly, nrc, put};
use super::session::Session;
use crate::service::MappedSlots;
use automotive_diag::uds::ResetType;
use embedded_storage::nor_flash::NorFlash;

/// P2 and P2*: longest time to a response (ms), and to the next one after "response pending" (units of 10 ms).
const P2_MS: u16 = 50;
const P2_STAR_10_MS: u16 = 500;

impl<R: NorFlash, W: MappedSlots, E: FnMut() -> Option<Seed>> Exchange<'_, R, W, E> {
    pub(super) fn session_control(&mut self, sub: u8, rest: &[u8]) -> Result<(), Nrc> {
        let session = match sub {
            1 => Session::Default,
            2 => Session::Programming,
            3 => Session::Extended,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        let [] = exactly(rest)?;
        self.services.enter(session);
        let [[a, b], [c, d]] = [P2_MS.to_be_bytes(), P2_STAR_10_MS.to_be_bytes()];
        put(self.out, &[a, b, c, d])
    }

    /// Requests a restart of the board, which follows once the response has been sent.
    pub(super) fn reset(&mut self, sub: u8, rest: &[u8]) -> Result<(), Nrc> {
        if !matches!(ResetType::from_repr(sub), Some(ResetType::HardReset | ResetType::SoftReset)) {
            return Err(Nrc::SubFunctionNotSupported);
        }
        self.require_access()?;
        let [] = exactly(rest)?;
        self.device.restart().map_err(nrc)?;
        self.services.is_restarting = true;
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
    pub(super) fn communication_control(&mut self, sub: u8, rest: &[u8]) -> Result<(), Nrc> {
        // Bit 0 stops what the board sends, bit 1 what it receives.
        let is_silenced = match sub {
            0 | 2 => false,
            1 | 3 => true,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        self.require_access()?;
        let [kind] = exactly(rest)?;
        // Normal messages, alone or with those of network management, which this board does not have.
        if !matches!(kind, 1 | 3) {
            return Err(Nrc::RequestOutOfRange);
        }
        if is_silenced && !self.device.may_interrupt() {
            return Err(Nrc::ConditionsNotCorrect);
        }
        self.services.is_silenced = is_silenced;
        Ok(())
    }

    pub(super) fn dtc_setting(&mut self, sub: u8) -> Result<(), Nrc> {
        let is_enabled = match sub {
            1 => true,
            2 => false,
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        self.require_access()?;
        self.services.memory.is_enabled = is_enabled;
        Ok(())
    }

    pub(super) fn clear_troubles(&mut self, rest: &[u8]) -> Result<(), Nrc> {
        self.require_access()?;
        let [a, b, c] = exactly(rest)?;
        let is_known = self.services.memory.clear(u32::from_be_bytes([0, a, b, c]));
        if is_known { Ok(()) } else { Err(Nrc::RequestOutOfRange) }
    }
}

//! Reads the cause of the last reset (RM0090 7.3.21).

use super::pac;
use gyronet::service::event::ResetCause;

/// Reads the reset flags and clears them for the next reset.
///
/// Every reset sets the pin's flag and power-on sets the brown-out's too, so the most specific cause is checked
/// first.
pub fn cause(rcc: &pac::RCC) -> ResetCause {
    let flags = rcc.csr().read();
    let causes = [
        (flags.wdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set(), ResetCause::Watchdog),
        (flags.sftrstf().bit_is_set(), ResetCause::Software),
        (flags.lpwrrstf().bit_is_set(), ResetCause::LowPower),
        (flags.porrstf().bit_is_set(), ResetCause::PowerOn),
        (flags.borrstf().bit_is_set(), ResetCause::BrownOut),
        (flags.padrstf().bit_is_set(), ResetCause::Pin),
    ];
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    causes.into_iter().find_map(|(set, cause)| set.then_some(cause)).unwrap_or(ResetCause::Unknown)
}

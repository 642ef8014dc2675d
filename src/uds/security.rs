//! Access by challenge and response (service 0x27), and signatures of what is written.
//!
//! Without a key everyone may write. With one, what is written is signed; whoever has the private part, and proves it once a
//! session, may also restart, silence and calibrate the board, and clear its troubles. Wrong answers are stored before they are answered, so that a restart does not help to guess; from the third
//! in a row on, each doubles a delay, which also runs after a restart.
//! Refusals are counted (data 0113) and a trouble.
//!
//! | what | code |
//! |---|---|
//! | no access in this session | 0x33 |
//! | an answer without a challenge | 0x24 |
//! | a wrong answer, a wrong signature, or one for another identifier, content or board | 0x35 |
//! | the third wrong answer in a row, and each after it | 0x36 |
//! | the delay runs | 0x37 |
//! | no trailer | 0x13 |
//! | a counter that is not greater than that of the newest signature, or no public key | 0x31 |
//! | no random numbers, the same again, or the vehicle may move | 0x22 |

use super::response::{Nrc, Response, exactly, nrc, put};
use super::signature::{self, Digest, SEED, SERIAL, SIGNATURE, Statement, TRAILER};
use crate::service::message::Refusal;
use crate::service::{Device, MappedSlots};
use crate::store::Access;
use embedded_storage::nor_flash::NorFlash;

/// A challenge.
pub type Seed = [u8; SEED];

/// Wrong answers in a row without a delay.
const FREE: u8 = 2;
/// The first delay, ms; each wrong answer doubles it, up to 2^6 times.
const DELAY_MS: u32 = 10_000;
const MOST_DOUBLED: u8 = 6;

/// The state of access in a session.
#[derive(Debug)]
pub(super) struct Security {
    is_unlocked: bool,
    seed: Option<Seed>,
    /// The newest challenge: one that comes twice is no random number.
    newest: Seed,
    /// The time of the last wrong answer, ms; before any, that of the start.
    wrong_at: u32,
}

impl Security {
    pub const fn new() -> Self {
        Self { is_unlocked: false, seed: None, newest: [0; SEED], wrong_at: 0 }
    }

    /// Ends the access: the session is over.
    pub fn end(&mut self) {
        self.is_unlocked = false;
        self.seed = None;
    }

    /// Refuses what this session has no access to.
    pub fn check<R: NorFlash, W: MappedSlots>(&self, device: &mut Device<R, W>) -> Result<(), Nrc> {
        match device.access() {
            Some(Access { key: None, .. }) => Ok(()),
            _ if self.is_unlocked => Ok(()),
            _ => Err(nrc(device.refuse_request(Refusal::Locked))),
        }
    }

    /// Makes a challenge, or takes the answer to it.
    pub fn access<R: NorFlash, W: MappedSlots>(
        &mut self,
        sub: u8,
        answer: &[u8],
        device: &mut Device<R, W>,
        (now, entropy): (u32, impl FnOnce() -> Option<Seed>),
        out: &mut Response,
    ) -> Result<(), Nrc> {
        let access = device.access().ok_or(Nrc::SecurityAccessDenied)?;
        let beyond = access.wrong.saturating_sub(FREE);
        let delay = DELAY_MS << beyond.saturating_sub(1).min(MOST_DOUBLED);
        if beyond > 0 && now.wrapping_sub(self.wrong_at) < delay {
            return Err(Nrc::RequiredTimeDelayNotExpired);
        }
        match sub {
            1 => {
                let [] = exactly(answer)?;
                // What is open has the challenge zero.
                let seed = match access.key {
                    Some(_) if !self.is_unlocked => {
                        let seed = entropy().filter(|seed| *seed != self.newest);
                        let seed = seed.ok_or(Nrc::ConditionsNotCorrect)?;
                        (self.seed, self.newest) = (Some(seed), seed);
                        seed
                    }
                    _ => [0; SEED],
                };
                put(out, &seed)
            }
            2 => {
                let answer = exactly::<SIGNATURE>(answer)?;
                if !device.may_interrupt() {
                    return Err(nrc(device.refuse_request(Refusal::Moving)));
                }
                let (seed, key) = self.seed.take().zip(access.key).ok_or(Nrc::RequestSequenceError)?;
                let message = signature::challenge(device.serial(), &seed);
                let is_right = signature::is_valid(&key, &message, &answer);
                let wrong = if is_right { 0 } else { access.wrong.saturating_add(1) };
                if wrong != access.wrong {
                    device.store_access(Access { wrong, ..access }).map_err(nrc)?;
                }
                if is_right {
                    self.is_unlocked = true;
                    return Ok(());
                }
                self.wrong_at = now;
                device.refuse_request(Refusal::Answer);
                Err(if wrong > FREE { Nrc::ExceedNumberOfAttempts } else { Nrc::InvalidKey })
            }
            _ => Err(Nrc::SubFunctionNotSupported),
        }
    }

    /// Stores a key where there is none, or one that is signed with that before; zeros remove it.
    pub fn write_key<R: NorFlash, W: MappedSlots>(
        &mut self,
        bytes: &[u8],
        device: &mut Device<R, W>,
    ) -> Result<(), Nrc> {
        let key: [u8; 32] = exactly(bytes)?;
        if !device.may_interrupt() {
            return Err(nrc(device.refuse_request(Refusal::Moving)));
        }
        let access = device.access().ok_or(Nrc::SecurityAccessDenied)?;
        let key = Some(key).filter(|key| *key != [0; 32]);
        if key.as_ref().is_some_and(|key| !signature::is_key(key)) {
            return Err(Nrc::RequestOutOfRange);
        }
        device.store_access(Access { key, ..access }).map_err(nrc)?;
        // Whoever has stored the first one goes on; a signature proves nothing of who carries it.
        self.is_unlocked = key.is_some() && (self.is_unlocked || access.key.is_none());
        Ok(())
    }
}

/// Splits what is written under an identifier from its trailer, once that is right. Without a key there is none.
pub(super) fn signed<'b, R: NorFlash, W: MappedSlots>(
    target: u16,
    bytes: &'b [u8],
    device: &mut Device<R, W>,
) -> Result<&'b [u8], Nrc> {
    if let Some(Access { key: None, .. }) = device.access() {
        return Ok(bytes);
    }
    let Some((content, trailer)) = bytes.split_last_chunk::<TRAILER>() else {
        return Err(nrc(device.refuse_request(Refusal::Unsigned)));
    };
    accept(target, &signature::digest(content), trailer, device)?;
    Ok(content)
}

/// Checks a trailer, and burns its counter: whatever happens next, it is never accepted again.
#[inline(never)]
pub(super) fn accept<R: NorFlash, W: MappedSlots>(
    target: u16,
    digest: &Digest,
    trailer: &[u8; TRAILER],
    device: &mut Device<R, W>,
) -> Result<(), Nrc> {
    let Some(access) = device.access() else { return Err(Nrc::SecurityAccessDenied) };
    let Some(key) = access.key else { return Ok(()) };
    let [scope, a, b, c, d, signature @ ..] = trailer;
    let counter = u32::from_be_bytes([*a, *b, *c, *d]);
    let serial = match scope {
        0 => *device.serial(),
        1 => [0; SERIAL],
        _ => return Err(Nrc::IncorrectMessageLengthOrInvalidFormat),
    };
    if !device.may_interrupt() {
        return Err(nrc(device.refuse_request(Refusal::Moving)));
    }
    if counter <= access.counter {
        let refusal = Refusal::Counter { found: counter, newest: access.counter };
        return Err(nrc(device.refuse_request(refusal)));
    }
    let message = signature::message(&Statement { target, serial, counter }, digest);
    if !signature::is_valid(&key, &message, signature) {
        return Err(nrc(device.refuse_request(Refusal::Signature)));
    }
    device.store_access(Access { counter, ..access }).map_err(nrc)
}

/// Returns the state of access: 0 open, 1 locked, 2 unlocked; the newest counter; wrong answers in a row; the key's
/// first four bytes.
pub(super) fn state<R: NorFlash, W: MappedSlots>(
    security: &Security,
    device: &Device<R, W>,
    out: &mut Response,
) -> Result<(), Nrc> {
    let access = device.access();
    let key = access.and_then(|access| access.key);
    let state = match (access, security.is_unlocked) {
        (Some(Access { key: None, .. }), _) => 0,
        (_, false) => 1,
        (_, true) => 2,
    };
    let Access { counter, wrong, .. } = access.unwrap_or(Access::OPEN);
    put(out, &[state])?;
    put(out, &counter.to_be_bytes())?;
    put(out, &[wrong])?;
    put(out, key.as_ref().and_then(|key| key.first_chunk::<4>()).unwrap_or(&[0; 4]))
}

//! Controls access: challenge and response (service 0x27), and signatures of written data.
//!
//! Without a key everyone may write. With a key, written data must be signed. A tester that proves once per session
//! that it has the private key may also restart and silence the board, and clear what it has learnt and its troubles. A challenge
//! is answered once, and by the key that it was made for. The number of wrong answers is stored before the response is
//! sent, so a restart does not help an attacker to guess. From the third wrong answer in a row on, a delay follows each
//! one and doubles each time; it also runs after a restart. Signed data are not delayed, and end the delay: answers of
//! others do not keep the owner out. Refusals are counted (data 0113) and reported as a trouble; `src/can/README.md` has the codes.

use super::exchange::Exchange;
pub use super::lock::Seed;
use super::response::{Nrc, exactly, nrc, put};
use super::signature::{self, Digest, SEED, SERIAL, SIGNATURE, Statement, TRAILER};
use crate::service::MappedSlots;
use crate::service::message::Refusal;
use crate::store::Access;
use embedded_storage::nor_flash::NorFlash;

/// Number of successive wrong answers that cause no delay.
const FREE_ATTEMPTS: u8 = 2;
/// First delay, ms; each further wrong answer doubles it, at most to 2^6 times its length.
const DELAY_MS: u32 = 10_000;
const MAX_DOUBLINGS: u8 = 6;

impl<R: NorFlash, W: MappedSlots, E: FnMut() -> Option<Seed>> Exchange<'_, R, W, E> {
    /// Refuses a request if the board has a key and this session is not unlocked.
    pub fn require_access(&mut self) -> Result<(), Nrc> {
        match self.device.access() {
            Some(Access { key: None, .. }) => Ok(()),
            _ if self.services.lock.is_open() => Ok(()),
            _ => Err(self.refuse(Refusal::Locked)),
        }
    }

    /// Makes a challenge (1), or checks the answer to it (2).
    pub fn access(&mut self, sub: u8, rest: &[u8]) -> Result<(), Nrc> {
        let answer = match sub {
            1 => exactly(rest).map(|[]: [u8; 0]| None)?,
            2 => Some(exactly::<SIGNATURE>(rest)?),
            _ => return Err(Nrc::SubFunctionNotSupported),
        };
        let lock = &mut self.services.lock;
        let access = self.device.access().ok_or(Nrc::SecurityAccessDenied)?;
        let beyond = access.wrong.saturating_sub(FREE_ATTEMPTS);
        let delay = DELAY_MS << beyond.saturating_sub(1).min(MAX_DOUBLINGS);
        if beyond > 0 && lock.since_wrong(self.now) < delay {
            return Err(Nrc::RequiredTimeDelayNotExpired);
        }
        let Some(answer) = answer else {
            // The challenge is zero if no answer is needed.
            let mut seed = [0; SEED];
            if access.key.is_some() && !lock.is_open() {
                seed = lock.challenge((self.entropy)()).ok_or(Nrc::ConditionsNotCorrect)?;
            }
            return put(self.out, &seed);
        };
        self.require_standstill()?;
        let lock = &mut self.services.lock;
        let (seed, key) = lock.answered().zip(access.key).ok_or(Nrc::RequestSequenceError)?;
        let message = signature::challenge(self.device.serial(), &seed);
        let is_right = self.device.long(|| signature::is_valid(&key, &message, &answer));
        let wrong = if is_right { 0 } else { access.wrong.saturating_add(1) };
        if wrong != access.wrong {
            self.device.store_access(Access { wrong, ..access }).map_err(nrc)?;
        }
        if is_right {
            lock.open();
            return Ok(());
        }
        lock.was_wrong(self.now);
        self.device.refuse_request(Refusal::Answer);
        Err(if wrong > FREE_ATTEMPTS { Nrc::ExceedNumberOfAttempts } else { Nrc::InvalidKey })
    }

    /// Refuses a request unless the vehicle is proven to stand.
    pub fn require_standstill(&mut self) -> Result<(), Nrc> {
        if self.device.may_interrupt() { Ok(()) } else { Err(self.refuse(Refusal::Moving)) }
    }

    /// Stores a key. The caller has checked that the request is signed with the previous key, if there was one. Zeros
    /// remove the key. A board without random numbers takes no key: it could never make a challenge.
    pub fn write_key(&mut self, bytes: &[u8]) -> Result<(), Nrc> {
        let key: [u8; 32] = exactly(bytes)?;
        self.require_standstill()?;
        let access = self.device.access().ok_or(Nrc::SecurityAccessDenied)?;
        let key = Some(key).filter(|key| *key != [0; 32]);
        if key.as_ref().is_some_and(|key| !self.device.long(|| signature::is_key(key))) {
            return Err(Nrc::RequestOutOfRange);
        }
        if key.is_some() && (self.entropy)().is_none() {
            return Err(Nrc::ConditionsNotCorrect);
        }
        self.device.store_access(Access { key, ..access }).map_err(nrc)?;
        // The session that stores the first key has access. One that replaces a key has not: a signature does not prove
        // that its sender has a private key, and an answer proves the key before.
        self.services.lock.end();
        if key.is_some() && access.key.is_none() {
            self.services.lock.open();
        }
        Ok(())
    }

    /// Checks and cuts off the trailer of written data, none without a key; returns the counter to [`use_up`], too.
    pub fn signed<'b>(&mut self, target: u16, bytes: &'b [u8]) -> Result<(&'b [u8], Option<u32>), Nrc> {
        if let Some(Access { key: None, .. }) = self.device.access() {
            return Ok((bytes, None));
        }
        let Some((content, trailer)) = bytes.split_last_chunk::<TRAILER>() else {
            return Err(self.refuse(Refusal::Unsigned));
        };
        Ok((content, self.check(target, &signature::digest(content), trailer)?))
    }

    #[inline(never)]
    pub fn check(
        &mut self,
        target: u16,
        digest: &Digest,
        trailer: &[u8; TRAILER],
    ) -> Result<Option<u32>, Nrc> {
        let Some(access) = self.device.access() else { return Err(Nrc::SecurityAccessDenied) };
        let Some(key) = access.key else { return Ok(None) };
        let [scope, a, b, c, d, signature @ ..] = trailer;
        let counter = u32::from_be_bytes([*a, *b, *c, *d]);
        let serial = match scope {
            0 => *self.device.serial(),
            1 => [0; SERIAL],
            // The end of long data without a signature.
            _ => return Err(self.refuse(Refusal::Unsigned)),
        };
        self.require_standstill()?;
        self.check_counter(counter, access)?;
        let message = signature::message(&Statement { target, serial, counter }, digest);
        if !self.device.long(|| signature::is_valid(&key, &message, signature)) {
            return Err(self.refuse(Refusal::Signature));
        }
        Ok(Some(counter))
    }

    fn check_counter(&mut self, found: u32, access: Access) -> Result<(), Nrc> {
        let newest = access.counter;
        if found <= newest { Err(self.refuse(Refusal::Counter { found, newest })) } else { Ok(()) }
    }

    /// Stores a signature's counter, so that it is not accepted again, and forgets wrong answers before it.
    pub fn use_up(&mut self, counter: Option<u32>) -> Result<(), Nrc> {
        let Some((counter, access)) = counter.zip(self.device.access()) else { return Ok(()) };
        self.check_counter(counter, access)?;
        self.device.store_access(Access { counter, wrong: 0, ..access }).map_err(nrc)
    }

    /// Appends the state (0 open, 1 locked, 2 unlocked), newest counter, wrong answers, the key's first bytes.
    pub fn access_state(&mut self) -> Result<(), Nrc> {
        let access = self.device.access();
        let key = access.and_then(|access| access.key);
        let state = match (access, self.services.lock.is_open()) {
            (Some(Access { key: None, .. }), _) => 0,
            (_, false) => 1,
            (_, true) => 2,
        };
        let Access { counter, wrong, .. } = access.unwrap_or(Access::OPEN);
        put(self.out, &[state])?;
        put(self.out, &counter.to_be_bytes())?;
        put(self.out, &[wrong])?;
        put(self.out, key.as_ref().and_then(|key| key.first_chunk::<4>()).unwrap_or(&[0; 4]))
    }
}

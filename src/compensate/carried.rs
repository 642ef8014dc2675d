//! What the sum of the rates that were sent still lacks: revisions by later windows, and the angle that standstill has held at
//! zero before it was seen to end. It is carried into the rates that follow, at most a bounded part with each.

use super::code;
use crate::sample::RATE_HZ;
use crate::units::AngularRate;

/// Quarters of a second at standstill whose angle may still be carried: wheels show no later that a vehicle moves.
const HELD_QUARTERS: usize = 5;

#[derive(Debug, Clone)]
pub(super) struct Carried {
    /// What is taken off the rates that follow, codes x samples.
    pub waiting: i64,
    /// Rates that standstill has set to zero, summed over the current quarter of a second and those before it.
    held: [i64; HELD_QUARTERS],
    held_until: u32,
}

impl Carried {
    pub const NONE: Self = Self { waiting: 0, held: [0; HELD_QUARTERS], held_until: 0 };

    /// Adds the revision of a correction whose rate has been sent, `held` at zero or not.
    pub fn revise(&mut self, revision: i64, held: bool) {
        if held {
            self.held[0] -= revision;
        } else {
            self.waiting += revision;
        }
    }

    /// Returns the rate to send: zero at standstill, less at most `most` of what waits, nothing of it where a reading
    /// is not good and a receiver drops it; and the rate that standstill has withheld.
    pub fn send(
        &mut self,
        rate: i64,
        is_good: bool,
        stands: bool,
        most: AngularRate,
    ) -> (AngularRate, Option<AngularRate>) {
        let is_held = stands && is_good;
        if is_held {
            if self.held_until == 0 {
                self.held.rotate_right(1);
                (self.held[0], self.held_until) = (0, RATE_HZ / 4);
            }
            self.held_until -= 1;
            self.held[0] += rate;
        }
        // A negative bound would disable the limit.
        let bound = if is_good { i64::from(most.0).max(0) } else { 0 };
        let carried = self.waiting.clamp(-bound, bound);
        let wanted = if is_held { 0 } else { rate } - carried;
        let sent = code(wanted);
        // What does not fit the code goes on waiting.
        self.waiting += i64::from(sent.0) - wanted - carried;
        (sent, is_held.then(|| code(rate)))
    }

    /// Notes that the vehicle no longer stands. It may have moved before that was detected, so the angle held at zero
    /// in the last second is carried into the next rates; older angles stay zero.
    pub fn end_standstill(&mut self) {
        self.waiting -= core::mem::take(&mut self.held).iter().sum::<i64>();
        self.held_until = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_end_of_a_standstill_is_carried() {
        let mut carried = Carried::NONE;
        for _ in 0..60 * RATE_HZ {
            assert_eq!(
                carried.send(7, true, true, AngularRate(100)),
                (AngularRate::ZERO, Some(AngularRate(7)))
            );
        }
        carried.end_standstill();
        // Four whole quarters of a second, and the one that has begun.
        let samples = -carried.waiting / 7;
        assert!((i64::from(RATE_HZ)..=125).contains(&samples), "{samples}");
    }
}

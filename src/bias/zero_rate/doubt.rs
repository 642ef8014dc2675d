//! Standstills that contradict the bias: by two seconds, or by one that is steady, since it may be pulling away.
//!
//! The difference is part of sigma until a stop agrees with the bias, or [`AGREEING_STOPS`] that agree with each other
//! replace it.

/// Refused seconds that make a stop contradict the bias.
const REFUSED_SECONDS: u8 = 2;
/// Stops that contradict the bias and agree with each other before they replace it.
const AGREEING_STOPS: u8 = 3;

/// Seconds that contradict the bias: their mean in this stop, and that of earlier stops that agree with each other, rad/s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Doubt {
    mean: f32,
    seconds: u8,
    is_steady: bool,
    earlier: f32,
    stops: u8,
}

impl Doubt {
    pub const NONE: Self = Self { mean: 0.0, seconds: 0, is_steady: false, earlier: 0.0, stops: 0 };

    pub fn add(&mut self, mean: f32, is_steady: bool) {
        self.seconds = self.seconds.saturating_add(1);
        self.is_steady |= is_steady;
        self.mean += (mean - self.mean) / f32::from(self.seconds);
    }

    fn is_by_this_stop(&self) -> bool {
        self.is_steady || self.seconds >= REFUSED_SECONDS
    }

    pub fn is_some(&self) -> bool {
        self.is_by_this_stop() || self.stops > 0
    }

    /// Returns whether the mean of a second is nearer than `than` to the stops that contradict the bias, rad/s.
    pub fn is_nearer(&self, mean: f32, than: f32) -> bool {
        let is_nearer = |own: f32, is_doubt: bool| is_doubt && libm::fabsf(mean - own) < than;
        is_nearer(self.mean, self.is_by_this_stop()) || is_nearer(self.earlier, self.stops > 0)
    }

    /// The largest difference from a bias, rad/s.
    pub fn off(&self, bias: f32) -> f32 {
        let off = |mean: f32, is_doubt: bool| if is_doubt { libm::fabsf(mean - bias) } else { 0.0 };
        off(self.mean, self.is_by_this_stop()).max(off(self.earlier, self.stops > 0))
    }

    /// Ends a stop; returns the bias once enough stops agree within `gate`: one, where the bias is only claimed.
    pub fn end_stop(&mut self, gate: f32, is_claim: bool) -> Option<f32> {
        let Self { mean, earlier, stops, .. } = *self;
        let contradicts = self.is_by_this_stop();
        *self = Self { earlier, stops, ..Self::NONE };
        if !contradicts {
            return None;
        }
        let agrees = stops > 0 && libm::fabsf(mean - earlier) <= gate;
        let (stops, before) = if agrees { (stops + 1, earlier) } else { (1, mean) };
        let mean = before + (mean - before) / f32::from(stops);
        *self = Self { earlier: mean, stops, ..Self::NONE };
        let enough = if is_claim { 1 } else { AGREEING_STOPS };
        (stops >= enough).then(|| {
            *self = Self::NONE;
            mean
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GATE: f32 = 1e-3;

    #[test]
    fn one_steady_second_or_two_others_contradict_and_the_stop_s_end_keeps_it() {
        for (seconds, is_steady, expected) in [(1, false, 0.0), (1, true, 0.01), (2, false, 0.01)] {
            let mut doubt = Doubt::NONE;
            (0..seconds).for_each(|_| doubt.add(0.012, is_steady));
            let off = doubt.off(0.002);
            assert!((off - expected).abs() < 1e-6, "{seconds} {is_steady}: {off}");
            assert_eq!(doubt.end_stop(GATE, false), None);
            assert!((doubt.off(0.002) - expected).abs() < 1e-6, "the vehicle drives on");
        }
    }

    #[test]
    fn stops_that_agree_replace_the_bias_and_one_replaces_a_claim() {
        let stop = |doubt: &mut Doubt, mean: f32, is_claim: bool| {
            doubt.add(mean, true);
            doubt.end_stop(GATE, is_claim)
        };
        let mut doubt = Doubt::NONE;
        assert_eq!([0.01, 0.0, 1e-4].map(|mean| stop(&mut doubt, mean, false)), [None; 3], "one is alone");
        assert_eq!(stop(&mut doubt, 2e-4, false).map(|mean| (mean * 1e5).round()), Some(10.0));
        assert!(!doubt.is_some());
        assert_eq!(stop(&mut doubt, 0.01, true), Some(0.01));
    }

    #[test]
    fn a_second_within_both_gates_withdraws_nothing_that_it_is_nearer_to() {
        let mut doubt = Doubt::NONE;
        doubt.add(2e-3, true);
        assert!(doubt.is_nearer(1.5e-3, 1.5e-3) && !doubt.is_nearer(5e-4, 5e-4));
        doubt.add(3e-3, true);
        assert!((doubt.off(0.0) - 2.5e-3).abs() < 1e-6, "the mean of both");
        assert_eq!(doubt.end_stop(GATE, false), None);
        assert!(doubt.is_nearer(2e-3, 2e-3) && !doubt.is_nearer(5e-4, 5e-4), "nor in a later stop");
    }
}

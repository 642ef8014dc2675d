//! Checks and decodes a set of yaw messages: rate, angle, detail.

use super::MAX_DELTA;
use embedded_can::{Id, StandardId};
use gyronet::can::e2e::{Checker, Fault, Profile, Verdict};
use gyronet::can::yaw::{AngleMessage, DetailMessage, Faults, Quality, RateMessage};
use gyronet::can::yaw::{SIGMA_UNKNOWN, Source};

/// The newest values of a set of yaw messages.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Corrected rate, deg/s; `None` if not available.
    pub rate: Option<f64>,
    pub judgement: Option<(Source, Quality)>,
    /// Yaw turned since the first angle message, deg, not wrapped.
    pub yaw: Option<f64>,
    /// The faults of the newest angle message.
    pub faults: Faults,
    /// The correction that was subtracted, deg/s.
    pub correction: Option<f64>,
    /// Expected error, 1 sigma, deg/s.
    pub sigma: Option<f64>,
    /// Time from the sample to the message, ms.
    pub latency: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    Rate,
    Angle,
    /// The detail message, which is the last one of a sample.
    Detail,
}

/// The three messages of a set, and their newest values.
#[derive(Debug, Clone)]
pub(super) struct YawSet {
    messages: Vec<(Id, Part, Checker)>,
    last_yaw: Option<i32>,
    turned: i64,
    state: State,
}

impl YawSet {
    /// Creates a set from the identifiers and E2E profiles of rate, angle and detail.
    pub(super) fn new(ids: [u16; 3], profiles: [Profile; 3]) -> Self {
        let checkers = profiles.map(|profile| Checker::new(profile, MAX_DELTA));
        let parts = [Part::Rate, Part::Angle, Part::Detail].into_iter().zip(checkers);
        let messages = ids.into_iter().zip(parts).filter_map(|(id, (part, checker))| {
            StandardId::new(id).map(|id| (Id::Standard(id), part, checker))
        });
        Self { messages: messages.collect(), last_yaw: None, turned: 0, state: State::default() }
    }

    pub(super) fn state(&self) -> State {
        self.state
    }

    /// Checks a message, and decodes it if it may be used; returns `None` if it is not in the set.
    pub(super) fn take(&mut self, id: Id, data: &[u8]) -> Option<(Part, Result<Verdict, Fault>)> {
        let (_, part, checker) = self.messages.iter_mut().find(|(own, ..)| *own == id)?;
        let (part, verdict) = (*part, checker.check(data));
        if verdict.is_ok_and(Verdict::usable) {
            match part {
                Part::Rate => self.take_rate(data),
                Part::Angle => self.take_angle(data),
                Part::Detail => self.take_detail(data),
            }
        }
        Some((part, verdict))
    }

    fn take_rate(&mut self, data: &[u8]) {
        if let Ok(message) = RateMessage::parse(data) {
            self.state.rate = message.deg_per_sec();
            self.state.judgement = Some((message.source, message.quality));
        }
    }

    fn take_angle(&mut self, data: &[u8]) {
        if let Ok(message) = AngleMessage::parse(data) {
            // The difference modulo 2^32 is the angle turned, also across lost messages.
            if let Some(last) = self.last_yaw.replace(message.yaw) {
                self.turned += i64::from(message.yaw.wrapping_sub(last));
            }
            self.state.yaw = Some(self.turned as f64 * (360.0 / 4_294_967_296.0));
            self.state.faults = message.faults;
        }
    }

    fn take_detail(&mut self, data: &[u8]) {
        if let Ok(message) = DetailMessage::parse(data) {
            let DetailMessage { correction, sigma, .. } = message;
            self.state.correction = Some(f64::from(correction) * 2e-4);
            self.state.sigma = (sigma != SIGMA_UNKNOWN).then(|| f64::from(sigma) * 1e-5);
            self.state.latency = message.latency_ms();
        }
    }
}

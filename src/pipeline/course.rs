//! Courses in the pipeline: a start in motion, and what is learnt after it.
//!
//! A vehicle that never stands has no static initialisation. There the bias about z is what the courses show, that of the
//! other axes their mean since the first course: no vehicle rolls or pitches for long. The tilt is that of earlier drives.

use super::initialised::Initialised;
use super::level::Level;
use super::{Pipeline, State};
use crate::bias::ZeroRate;
use crate::compensate::Remaining;
use crate::heading::filter::{BIAS, FINE_BIAS, Filter, GAIN};
use crate::heading::{CourseCounters, CourseState, Gain, Heading, Refusal, gain_knowledge};
use crate::health::slow::Knowledge;
use crate::mounting::{Rotation, Vertical};
use crate::sample::Frame;
use crate::standstill::Standing;
use crate::units::AngularRate;

#[derive(Debug, Clone)]
pub(super) struct Start {
    filter: Filter,
    /// Sums of the rates about x and y since the first course, codes, and their number.
    sums: [i64; 2],
    count: i64,
}

impl Start {
    pub(super) const EMPTY: Self = Self { filter: Filter::new(0.0, 0.0), sums: [0; 2], count: 0 };

    fn mean(&self) -> [AngularRate; 2] {
        self.sums.map(|sum| AngularRate((sum / self.count.max(1)) as i32))
    }
}

impl Pipeline {
    /// Takes a course that arrives now: the vehicle's direction of travel up to two seconds ago.
    pub fn course(&mut self, heading: &Heading) {
        self.state.course.arrived(heading, self.state.tick);
    }

    pub fn refuse_course(&mut self, why: Refusal) {
        self.state.course.refuse(why);
    }

    pub fn gain(&self) -> (f32, Option<f32>) {
        self.zero_rate().map_or((0.0, None), ZeroRate::gain)
    }

    /// Adds a sample before initialisation, already levelled; `early` is what earlier drives have shown: levelling and
    /// sigma of the bias. Initialises once the courses have shown the bias.
    #[inline(never)]
    pub(super) fn start_in_motion(
        &mut self,
        frame: &Frame,
        early: Option<(Rotation, f32)>,
        standing: Standing,
    ) {
        let Some(zero_rate) = self.config.zero_rate.filter(|_| self.state.initialised.is_none()) else {
            return;
        };
        let State { course, start, .. } = &mut self.state;
        if course.state().counters.used == 0 {
            let sigma = early.map_or(zero_rate.max_bias, |(_, sigma)| sigma);
            *start = Start { filter: Filter::new(sigma * sigma, 0.0), ..Start::EMPTY };
            start.filter.give_back(self.config.gain);
        }
        let [x, y, z] = frame.sample.angular_rate;
        let is_good = frame.sample.validity.is_good();
        if is_good {
            start.sums.iter_mut().zip([x, y]).for_each(|(sum, rate)| *sum += i64::from(rate.0));
            start.count += 1;
        }
        course.add(&mut start.filter, frame.tick, is_good.then_some(z), standing.is_likely());
        if !course.is_usable(&start.filter) {
            return;
        }
        let mut filter = start.filter.clone();
        let [x, y] = start.mean();
        let z = AngularRate(libm::roundf(filter.get::<BIAS>() * AngularRate::PER_RAD_PER_SEC) as i32);
        filter.put::<BIAS>(0.0);
        course.refer();
        self.state.sensor_bias.refer();
        let mounted = self.config.vertical.turned(&self.config.mounting);
        let (known, levelling) =
            early.map_or((Vertical::UNKNOWN, Rotation::IDENTITY), |(levelling, _)| (mounted, levelling));
        let rates = levelling.inverse().rate([x, y, z]);
        let level = Level::new(rates, None, self.config.levelling.then_some(known));
        self.state.initialised = Some(Initialised {
            zero: level.zero(self.config.earth_rate),
            level,
            zero_rate: Some(ZeroRate::with(zero_rate, filter)),
            is_coarse: true,
        });
    }

    pub fn course_counters(&self) -> CourseCounters {
        self.state.course.state().counters
    }

    /// Returns what courses have shown since the start. `is_silent` stays false: the coprocessor sets it.
    pub(crate) fn course_state(&self) -> CourseState {
        let (share, sigma) = self.gain();
        let gain = sigma.map(|sigma| Gain { share, sigma, of: self.config.gain_of });
        CourseState { gain, ..self.state.course.state() }
    }

    pub(super) fn forget_gain(&mut self) {
        self.config.gain = None;
        let prior = self.config.course.gain;
        if let Some(zero_rate) = self.zero_rate_mut()
            && zero_rate.gain().1.is_some()
        {
            zero_rate.filter().restart::<GAIN>(0.0, prior * prior);
        }
    }

    /// Notes whether a bias is coarse: one that was found in motion, or that courses made so, until it is as good as one after a
    /// standstill.
    pub(super) fn judge_start(&mut self) {
        if let Some(Initialised { zero_rate: Some(zero_rate), is_coarse, .. }) = &mut self.state.initialised {
            let is_worse = self.state.course.take_became_coarse() || *is_coarse;
            *is_coarse = is_worse && zero_rate.sigma() > FINE_BIAS;
        }
    }

    pub(super) fn is_bias_coarse(&self) -> bool {
        self.state.initialised.as_ref().is_some_and(|known| known.is_coarse)
    }

    pub(super) fn gain_by_course(&self) -> Option<(Knowledge, f32)> {
        let (_, sigma) = self.zero_rate()?.gain();
        sigma.map(|sigma| (gain_knowledge(sigma), sigma))
    }

    /// Returns what the gyro reads wrong beyond its static bias and the network's estimate.
    pub(super) fn remaining(&self) -> Remaining {
        let gain = self.zero_rate().map_or(0.0, |known| known.gain().0);
        Remaining { bias: self.bias(), gain }
    }
}

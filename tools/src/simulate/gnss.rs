//! A GNSS receiver: course and speed over ground once a second, late, with errors that last, and lost now and then.
//!
//! | what | value |
//! |---|---|
//! | accuracy across the direction of travel | 0.1 m/s white and as much that changes in 30 s, both sigma |
//! | slowest speed with a course | 1 m/s |
//! | first course | after 30 s |
//! | outages | the last minute of every five |
//! | spoofed course | turns by 0.5 deg/s from the true one |
//!
//! The values are assumed.

use super::purpose::Purpose;
use crate::drive::DT;
use crate::random::Random;
use std::collections::VecDeque;
use std::f64::consts::TAU;

const ACROSS: f64 = 0.1;
const LASTS_S: f64 = 30.0;
const SLOWEST: f64 = 1.0;
const FIRST_S: f64 = 30.0;
const OUTAGES_S: [f64; 2] = [300.0, 240.0];
const SPOOFED: f64 = 0.5 * TAU / 360.0;
/// Samples from one course to the next.
const EVERY: usize = 100;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Age of a course when it arrives, s.
    pub latency_s: f64,
    /// Time from which on the course is spoofed, s.
    pub spoofed_from_s: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Course {
    /// Direction, rad clockwise from the direction at the start.
    pub course: f64,
    /// Its accuracy, 1 sigma, rad.
    pub sigma: f64,
    /// Speed over ground, m/s.
    pub speed: f64,
}

#[derive(Debug, Clone)]
pub struct Gnss {
    config: Config,
    random: Random,
    /// Error across the direction of travel that lasts, m/s.
    lasting: f64,
    heading: f64,
    /// Headings and speeds since the latency.
    past: VecDeque<[f64; 2]>,
    samples: usize,
}

impl Gnss {
    pub fn new(config: &Config, seed: u64) -> Self {
        let (random, past) = (Purpose::Gnss.stream(seed), VecDeque::new());
        Self { config: *config, random, lasting: 0.0, heading: 0.0, past, samples: 0 }
    }

    /// Adds 10 ms of a motion: its rate of heading, left positive, rad/s, and its speed, m/s.
    pub fn step(&mut self, heading_rate: f64, speed: f64) -> Option<Course> {
        self.heading += heading_rate * DT;
        self.past.push_back([self.heading, speed]);
        if self.past.len() > 1 + (self.config.latency_s / DT).round() as usize {
            self.past.pop_front();
        }
        self.samples += 1;
        if !self.samples.is_multiple_of(EVERY) {
            return None;
        }
        let kept = (-1.0 / LASTS_S).exp();
        self.lasting = kept * self.lasting + (1.0 - kept * kept).sqrt() * ACROSS * self.random.normal();
        let across = self.lasting + ACROSS * self.random.normal();
        let now = self.samples as f64 * DT;
        let [period, held] = OUTAGES_S;
        let [heading, speed] = *self.past.front()?;
        let spoofed = self.config.spoofed_from_s.map_or(0.0, |from| SPOOFED * (now - from).max(0.0));
        (now >= FIRST_S && now % period < held && speed >= SLOWEST).then(|| Course {
            course: (spoofed - heading + across / speed).rem_euclid(TAU),
            sigma: std::f64::consts::SQRT_2 * ACROSS / speed,
            speed,
        })
    }
}

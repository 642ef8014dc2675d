//! The board on the host: the library's coprocessor, driven by the rows of a recorded drive.
//!
//! The board runs the code of the firmware, so its frames are those that a board in the vehicle would send. A step is
//! given out [`HOLD`] rows after its row, when its delayed rate and its complete rate are known; nothing older is
//! kept, so a long drive needs no more memory than a short one.

use crate::drive::recording::Row;
use crate::drive::wheel_frames::{self, WheelFrames};
use gyronet::bias::StaticError;
use gyronet::compensate::Lag;
use gyronet::coprocessor::{Clock, Config, Coprocessor, TimedFrame};
use gyronet::estimate::{VehicleSample, YawEstimate};
use gyronet::health::Status;
use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Estimate, WindowNetwork};
use gyronet::monitor::TIMEOUT_US;
use gyronet::sample::Standstill;
use gyronet::units::{AngularRate, Micros};
use std::collections::VecDeque;

/// Steps that are held back. No rate is sent or revised later than this.
pub const HOLD: usize = Lag::MAX.samples() + 1;
/// Period at which the board polls its inputs, microseconds.
const POLL_US: u64 = 1_000;
/// Longest part of a gap in which the board's messages about a silent sensor are replayed, microseconds; the rest of
/// the gap is skipped.
const SILENCE_US: u64 = 60_000_000;

#[derive(Debug, Clone, Copy)]
pub struct Uncorrected;

impl WindowNetwork for Uncorrected {
    fn estimate(&mut self, _window: &[Features; WINDOW]) -> Estimate {
        Estimate::NONE
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    pub row: usize,
    pub input: Row,
    pub time: Micros,
    pub standstill: Standstill,
    /// The estimates that were sent with this row.
    pub vehicle: VehicleSample,
    /// The delayed rate of this row's sample, which is sent some samples later; `None` during static
    /// initialisation and for the last samples of the drive.
    pub delayed: Option<YawEstimate>,
    /// The gyro less static bias less the network's complete estimate, which is known some samples later; the live
    /// rate if there is no complete estimate.
    pub complete: AngularRate,
    /// The frames that were sent with this row, and those sent while the sensor was silent after it.
    pub frames: Vec<TimedFrame>,
    pub is_initialised: bool,
    /// The rates of this step are compared with others: after static initialisation, and before the first step without
    /// a delayed rate.
    pub is_compared: bool,
}

#[derive(Debug, Clone)]
pub struct Board<N> {
    coprocessor: Coprocessor,
    wheels: Option<WheelFrames>,
    network: N,
    rows: usize,
    now: Micros,
    /// The time from which on the board finds the sensor silent.
    silent_from: Micros,
    held: VecDeque<Step>,
    /// True once a step that was given out is initialised, and once one after that has no delayed rate.
    initialised: bool,
    ended: bool,
    /// The vehicle may move at the start, and the board takes the courses of the rows.
    may_move: bool,
    takes_course: bool,
}

impl<N: WindowNetwork> Board<N> {
    /// Creates a board before its first row. `wheels` replaces the vehicle's bus; the estimate of each window is
    /// delivered without delay.
    pub fn new(config: Config, wheels: Option<WheelFrames>, network: N) -> Self {
        let receiver = wheels.as_ref().map(|_| wheel_frames::receiver());
        let coprocessor = Coprocessor::new(Config { wheels: receiver, clock: Clock::Sensor, ..config });
        Self {
            coprocessor,
            wheels,
            network,
            rows: 0,
            now: Micros(0),
            silent_from: Micros(0),
            held: VecDeque::with_capacity(HOLD + 1),
            initialised: false,
            ended: false,
            may_move: false,
            takes_course: false,
        }
    }

    /// The board of a vehicle that may move at the start, with or without the courses of the rows.
    #[must_use]
    pub fn moving(self, takes_course: bool) -> Self {
        Self { may_move: true, takes_course, ..self }
    }

    /// Takes the courses of the rows from now on, with which the vehicle may move at the start.
    pub fn take_courses(&mut self) {
        (self.may_move, self.takes_course) = (true, true);
    }

    pub fn coprocessor(&self) -> &Coprocessor {
        &self.coprocessor
    }

    /// Processes a row, and gives out the step of the row [`HOLD`] steps before it. A row whose time stamp does not
    /// fit the grid gives no step and is counted.
    pub fn row(&mut self, row: &Row) -> Result<Option<Step>, StaticError> {
        let (index, time) = (self.rows, row.sample.time);
        self.rows += 1;
        self.wait(time);
        self.now = self.now.max(time);
        if let Some(frame) = self.wheels.as_mut().and_then(|wheels| wheels.next(row)) {
            // A speed that does not fit the frame is counted as not valid.
            let _ = self.coprocessor.can(&frame, self.now);
        }
        if let Some(heading) = row.heading.filter(|_| self.takes_course) {
            // A course that is no vehicle's is counted.
            let _ = self.coprocessor.heading(&heading, self.now);
        }
        let mut frames = Vec::new();
        let sent = self.coprocessor.imu(row.sample, self.now, &mut |frame: TimedFrame| frames.push(frame));
        let Ok(Some(observation)) = sent else { return Ok(None) };
        if let Some(refused) = observation.refused.filter(|_| !self.may_move) {
            return Err(refused);
        }
        self.silent_from = Micros(self.now.0 + TIMEOUT_US);
        if let Some(window) = self.coprocessor.window() {
            let estimate = self.network.estimate(&window.features);
            self.coprocessor.deliver(window.end, estimate).expect("the window that is due");
        }
        let vehicle = observation.vehicle;
        self.held.push_back(Step {
            row: index,
            input: *row,
            time,
            standstill: observation.wheels.standstill,
            vehicle,
            delayed: None,
            complete: vehicle.live.rate,
            frames,
            is_initialised: false,
            is_compared: false,
        });
        if vehicle.delayed.status != Status::Init
            && let Some(step) = self.held(vehicle.delayed.tick)
        {
            step.delayed = Some(vehicle.delayed);
        }
        if let Some(complete) = observation.complete
            && let Some(step) = self.held(complete.tick)
        {
            step.complete = AngularRate(complete.rate.0.saturating_sub(complete.correction.0));
        }
        Ok(if self.held.len() > HOLD { self.end() } else { None })
    }

    /// Gives out the next of the steps that are still held; call it until `None` after the last row.
    pub fn end(&mut self) -> Option<Step> {
        let mut step = self.held.pop_front()?;
        self.initialised |= step.vehicle.live.status != Status::Init;
        self.ended |= self.initialised && step.delayed.is_none();
        step.is_initialised = self.initialised;
        step.is_compared = self.initialised && !self.ended;
        Some(step)
    }

    /// Lets time pass until the next row. The messages about a silent sensor precede those of the row.
    fn wait(&mut self, row: Micros) {
        let Some(last) = self.held.back_mut() else { return };
        let until = row.0.min(self.now.0 + SILENCE_US);
        // Until then a poll finds nothing to do.
        let quiet = self.silent_from.0.saturating_sub(self.now.0 + 1) / POLL_US * POLL_US;
        for now in (self.now.0 + quiet + POLL_US..until).step_by(POLL_US as usize) {
            let _ = self.coprocessor.poll(Micros(now), &mut |frame: TimedFrame| last.frames.push(frame));
        }
    }

    fn held(&mut self, tick: u32) -> Option<&mut Step> {
        self.held.iter_mut().rev().find(|step| step.vehicle.live.tick == tick)
    }
}

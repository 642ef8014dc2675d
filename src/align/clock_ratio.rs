//! Measures how fast an inertial sensor's clock runs against the board's.
//!
//! A sensor paces its samples by its own oscillator. Its rate is correct in rad/s of true time, but a step that it
//! calls 10 ms may last 10.1 ms, in which the vehicle turns by the rate times 10.1 ms. The accumulated yaw therefore
//! sums [`ClockRatio::turned`] of each rate. A receiver that multiplies the rate by the time between two messages gets
//! the same angle.
//!
//! A sample arrives late by a time that varies, and never early. The least late sample of every two seconds is taken,
//! as a point of sensor time and board time. The ratio is the slope from the oldest of the last 17 points to the
//! newest: 32 s, over which 3 ms of remaining jitter are 94 ppm. Before 8 s the ratio is one.
//!
//! | event | what is done |
//! |---|---|
//! | the two clocks differ by less than [`JITTER_US`] over the points | one: two crystals agree, and no bit of the results changes |
//! | the point in the middle is off the line by more than [`JITTER_US`] (a stamp that jumped, a block that was late as a whole) | the points restart with the newest; the ratio is kept |
//! | the sensor's clock goes back, [`GAP_US`] pass on either clock between two samples (restart, silence), or a block lasts twice its time by the board's | the points restart; the ratio is kept |
//! | the ratio departs from one by more than [`LIMIT_PPM`] | one of the clocks is at fault, and it is unknown which: the ratio is one, and [`RatioEstimator::fault`] reports it |
//!
//! A step of J in either clock, wherever it falls, and a late point at either end bend the line by at least J / 2 in
//! its middle; so an undetected step is below 2 [`JITTER_US`], 188 ppm of 32 s. A recording, whose bytes arrive at the
//! host's pace, has no estimator, but [`ClockRatio::ONE`].

use crate::units::{Angle, AngularRate, Micros};
use heapless::Deque;

/// One sample is taken from each block of this length, by the sensor's clock.
pub const BLOCK_US: u64 = 2_000_000;
/// A slope spans at most this many points: 32 s.
pub const POINTS: usize = 17;
/// A slope spans at least this many points: 8 s.
const ENOUGH: usize = 5;
/// The least late samples of two blocks may differ by this much in their lateness.
pub const JITTER_US: u64 = 3_000;
/// The points restart after this time without a sample.
pub const GAP_US: u64 = BLOCK_US;
/// Largest departure of a working oscillator from one, millionths: an ICM-42688-P has 3.5 %, with temperature.
pub const LIMIT_PPM: u32 = 40_000;

/// True time over the sensor's time: LSB 2^-30, so one is 2^30.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClockRatio(pub u32);

impl ClockRatio {
    pub const FRACTION_BITS: u32 = 30;
    /// Both clocks run alike, or there is only one.
    pub const ONE: Self = Self(1 << Self::FRACTION_BITS);
    /// Codes per millionth, rounded down.
    const PPM: u32 = Self::ONE.0 / 1_000_000;

    /// Divides two spans of less than 4.7 h, to the nearest code; `None` from 4 on.
    fn of(board: u64, sensor: u64) -> Option<Self> {
        let code = ((board << Self::FRACTION_BITS) + sensor / 2).checked_div(sensor)?;
        u32::try_from(code).ok().map(Self)
    }

    fn true_time(self, sensor: u64) -> u64 {
        (sensor * u64::from(self.0)) >> Self::FRACTION_BITS
    }

    #[must_use]
    pub fn departure_ppm(self) -> u32 {
        self.0.abs_diff(Self::ONE.0) / Self::PPM
    }

    /// Returns an angle that was summed over the sensor's time, over true time. It has at most 46 bits, the departure 26.
    #[must_use]
    pub fn angle(self, Angle(angle): Angle) -> Angle {
        let departure = i64::from(self.0) - i64::from(Self::ONE.0);
        let (high, low) = (angle >> 16, angle & 0xFFFF);
        Angle(
            angle
                .saturating_add((high * departure + ((low * departure) >> 16)) >> (Self::FRACTION_BITS - 16)),
        )
    }

    /// Returns the angle turned at `rate` in a grid step of the sensor's clock, in codes of [`crate::units::Yaw`].
    #[must_use]
    pub fn turned(self, rate: AngularRate) -> i64 {
        // Below 2^63.
        (i64::from(rate.0) * i64::from(self.0) + (1 << (Self::FRACTION_BITS - 1))) >> Self::FRACTION_BITS
    }
}

/// The time of a sample by the sensor's clock, and of its arrival by the board's.
#[derive(Debug, Clone, Copy)]
struct Point {
    sensor: u64,
    board: u64,
}

impl Point {
    /// Returns the time by which this point is above a line through the older point `from`, microseconds.
    fn lateness(self, from: Self, slope: ClockRatio) -> i64 {
        let expected = slope.true_time(self.sensor - from.sensor);
        (self.board - from.board) as i64 - expected as i64
    }
}

#[derive(Debug, Clone, Copy)]
struct Block {
    first: Point,
    last: Point,
    /// The least late sample, and its lateness against a line through the first one.
    best: (Point, i64),
}

#[derive(Debug, Clone)]
pub struct RatioEstimator {
    block: Option<Block>,
    points: Deque<Point, POINTS>,
    /// The slope of the points, which compares arrivals with each other even where it is not accepted as the ratio.
    slope: ClockRatio,
    /// In use: one before it is known, and while the clocks contradict each other.
    pub ratio: ClockRatio,
    pub is_known: bool,
    pub fault: bool,
}

impl RatioEstimator {
    pub const START: Self = Self {
        block: None,
        points: Deque::new(),
        slope: ClockRatio::ONE,
        ratio: ClockRatio::ONE,
        is_known: false,
        fault: false,
    };

    pub fn observe(&mut self, sensor: Micros, board: Micros) {
        let point = Point { sensor: sensor.0, board: board.0 };
        let Some(block) = &mut self.block else {
            self.block = Some(Block { first: point, last: point, best: (point, 0) });
            return;
        };
        let follows = |before: u64, now: u64| now >= before && now - before < GAP_US;
        let connected = follows(block.last.sensor, point.sensor) && follows(block.last.board, point.board);
        if !connected || point.board - block.first.board > 2 * BLOCK_US {
            self.points.clear();
            self.block = Some(Block { first: point, last: point, best: (point, 0) });
            return;
        }
        block.last = point;
        let lateness = point.lateness(block.first, self.slope);
        if lateness < block.best.1 {
            block.best = (point, lateness);
        }
        if point.sensor - block.first.sensor >= BLOCK_US {
            let (best, _) = block.best;
            // This sample begins the next block, so that no time falls between two blocks.
            self.block = Some(Block { first: point, last: point, best: (point, 0) });
            self.take(best);
        }
    }

    fn take(&mut self, newest: Point) {
        if self.points.is_full() {
            self.points.pop_front();
        }
        // There is room now.
        let _ = self.points.push_back(newest);
        let (Some(oldest), Some(middle)) =
            (self.points.front(), self.points.iter().nth(self.points.len() / 2))
        else {
            return;
        };
        let (board, sensor) = (newest.board - oldest.board, newest.sensor - oldest.sensor);
        let Some(slope) = ClockRatio::of(board, sensor) else { return };
        self.slope = slope;
        if self.points.len() < ENOUGH {
            return;
        }
        if middle.lateness(*oldest, slope).unsigned_abs() > JITTER_US {
            self.points.clear();
            let _ = self.points.push_back(newest);
            return;
        }
        self.is_known = true;
        self.fault = slope.departure_ppm() > LIMIT_PPM;
        let alike = board.abs_diff(sensor) <= JITTER_US;
        self.ratio = if self.fault || alike { ClockRatio::ONE } else { slope };
    }
}

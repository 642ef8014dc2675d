//! Sends increments of a three-axis fibre-optic gyro at 1 kHz; [`FogGrid`] sums them on the grid. The
//! recorded accelerometer is used with it, since the part has none.
//!
//! A row's rate is taken as that of the 10 ms before it: ten messages in format B with a tenth of its angle each. The
//! board's clock is derived from the number of the grid step, so that a recording with time stamp jitter is not
//! interpolated. In a missing row the part is silent.

use super::{Part, Sent, ViaError};
use crate::drive::recording::Recording;
use gyronet::align::MAX_GAP;
use gyronet::align::fog_grid::{FogGrid, Step};
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::units::Micros;

/// Number of messages per row.
pub const MESSAGES: u64 = 10;
/// Time from one message to the next, microseconds.
pub const MESSAGE_US: u64 = PERIOD_US / MESSAGES;

pub(super) fn send(recording: &Recording) -> Result<Sent, ViaError> {
    let mut gyro = Gyro { part: Dsp1760::new(Dsp1760Config::DEFAULT), bytes: 0 };
    let mut grid = FogGrid::new(false);
    let mut samples = Vec::with_capacity(recording.rows.len());
    // The grid begins one step before the first row, so that the first row's increments have their time.
    let mut last = recording.rows.first().map_or(0, |row| row.sample.time.0);
    let mut tick = 1;
    for row in &recording.rows {
        let error = |why: &str| Part::Dsp1760.no_sample(recording, row, why);
        let steps = ((row.sample.time.0 - last + PERIOD_US / 2) / PERIOD_US).max(1);
        last = row.sample.time.0;
        if steps > u64::from(MAX_GAP) {
            // The pipeline restarts after such a gap, and so does the board's grid.
            grid = FogGrid::new(false);
        } else {
            // The board keeps polling while no message arrives.
            for missing in 1..steps {
                while grid.next_step(Micros((tick + missing) * PERIOD_US)).is_some() {}
            }
        }
        tick += steps;
        let step = gyro.turn(&mut grid, tick * PERIOD_US, &row.sample).map_err(|why| error(&why))?;
        let [x, y, z] = [0, 1, 2].map(|axis| step.turn.rate(axis));
        let rates = x.zip(y).zip(z).ok_or_else(|| error("increments are missing"))?;
        let ((x, y), z) = rates;
        samples.push(ImuSample { angular_rate: [x, y, z], ..row.sample });
    }
    Ok((samples, gyro.bytes))
}

struct Gyro {
    part: Dsp1760,
    bytes: u64,
}

impl Gyro {
    /// Sends ten messages up to `end`; returns the grid step that they complete.
    fn turn(&mut self, grid: &mut FogGrid, end: u64, sample: &ImuSample) -> Result<Step, String> {
        for n in 1..=MESSAGES {
            let now = end - PERIOD_US + n * MESSAGE_US;
            let frame = message(now, sample).emit();
            self.bytes += frame.len() as u64;
            frame.iter().for_each(|byte| self.part.receive(*byte));
            let fog = self.part.next_sample().ok_or("no frame was found")?;
            let fog = fog.map_err(|error| error.to_string())?;
            grid.add(Micros(now), fog).map_err(|error| error.to_string())?;
            while n < MESSAGES && grid.next_step(Micros(now)).is_some() {}
        }
        let step = std::iter::from_fn(|| grid.next_step(Micros(end))).last();
        step.filter(|step| step.time.0 == end).ok_or_else(|| "the grid step is missing".to_owned())
    }
}

/// Encodes a tenth of a row's turn as the message at `now`.
pub fn message(now: u64, sample: &ImuSample) -> Message {
    let seconds = MESSAGE_US as f64 * 1e-6;
    Message {
        rotation: sample.angular_rate.map(|rate| (rate.rad_per_sec() * seconds) as f32),
        acceleration: [0.0; 3],
        extra: Extra::Timed { time: now as u32, temperature: 25 },
        validity: Validity::GYRO,
        sequence: (now / MESSAGE_US % 128) as u8,
    }
}

//! This module sends increments of a three-axis fibre-optic gyro at 1 kHz, which [`Streams`] sums on the grid; the part
//! has no accelerometer, so the recorded one is used beside it.
//!
//! A row's rate is that of the 10 ms before it: ten messages with a tenth of its angle each, in
//! format B. The board's clock is the number of the row's grid step, so that a recording whose
//! time stamps jitter is not interpolated; a missing row is a silent part.

use super::{Part, Sent, ViaError};
use crate::drive::recording::Recording;
use gyronet::align::MAX_GAP;
use gyronet::align::streams::{Fitted, Step, Streams};
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::units::Micros;

/// A row becomes this many messages.
pub const MESSAGES: u64 = 10;
/// Messages are this far apart, microseconds.
pub const MESSAGE_US: u64 = PERIOD_US / MESSAGES;
pub const BOTH: Fitted = Fitted { imu: true, fog: true };

pub fn send(recording: &Recording) -> Result<Sent, ViaError> {
    let mut gyro = Gyro { part: Dsp1760::new(Dsp1760Config::DEFAULT), bytes: 0 };
    let mut streams = Streams::new(BOTH);
    let mut samples = Vec::with_capacity(recording.rows.len());
    // One row is put before the first, so that the increments have their time.
    let mut last = recording.rows.first().map_or(0, |row| row.sample.time.0);
    let mut tick = 1;
    for row in &recording.rows {
        let error = |why: &str| Part::Dsp1760.no_sample(recording, row, why);
        let steps = ((row.sample.time.0 - last + PERIOD_US / 2) / PERIOD_US).max(1);
        last = row.sample.time.0;
        if steps > u64::from(MAX_GAP) {
            // The pipeline restarts after such a gap, and so does the board's grid.
            streams = Streams::new(BOTH);
        } else {
            // The board keeps polling while nothing comes.
            for missing in 1..steps {
                while streams.next_step(Micros((tick + missing) * PERIOD_US)).is_some() {}
            }
        }
        tick += steps;
        let step = gyro.turn(&mut streams, tick * PERIOD_US, &row.sample).map_err(|why| error(&why))?;
        let (sample, _) = step.imu.ok_or_else(|| error("the grid has no sample"))?;
        let [x, y, z] = [0, 1, 2].map(|axis| step.fog.rate(axis));
        let rates = x.zip(y).zip(z).ok_or_else(|| error("increments are missing"))?;
        let ((x, y), z) = rates;
        samples.push(ImuSample { time: row.sample.time, angular_rate: [x, y, z], ..sample });
    }
    Ok((samples, gyro.bytes))
}

struct Gyro {
    part: Dsp1760,
    bytes: u64,
}

impl Gyro {
    /// Sends ten messages up to `end`, then the other sensor's sample; returns the step that they complete.
    fn turn(&mut self, streams: &mut Streams, end: u64, sample: &ImuSample) -> Result<Step, String> {
        for n in 1..=MESSAGES {
            let now = end - PERIOD_US + n * MESSAGE_US;
            let frame = message(now, sample).emit();
            self.bytes += frame.len() as u64;
            frame.iter().for_each(|byte| self.part.receive(*byte));
            let fog = self.part.next_sample().ok_or("no frame was found")?;
            let fog = fog.map_err(|error| error.to_string())?;
            streams.add_fog(Micros(now), fog).map_err(|error| error.to_string())?;
            while n < MESSAGES && streams.next_step(Micros(now)).is_some() {}
        }
        let imu = ImuSample { time: Micros(end), ..*sample };
        streams.add_imu(Micros(end), imu).map_err(|error| error.to_string())?;
        let step = std::iter::from_fn(|| streams.next_step(Micros(end))).last();
        step.filter(|step| step.time.0 == end).ok_or_else(|| "its grid step does not come".to_owned())
    }
}

/// Makes the message of a tenth of a row's turn, at `now`.
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

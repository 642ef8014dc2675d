//! Sends MTData2 messages in single precision through the parser, byte by byte.

use super::{Part, Sent, ViaError};
use crate::drive::recording::Recording;
use gyronet::sample::ImuSample;
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet::units::Micros;

/// The six clipping bits of the status word.
pub const CLIPPED: u32 = 0x3F << 8;
/// The status word of a good sample: self-test passed, filter valid.
const GOOD: u32 = 3;
/// Length of a tick of SampleTimeFine, microseconds.
const TICK_US: u64 = 100;

pub(super) fn send(recording: &Recording) -> Result<Sent, ViaError> {
    let mut mti = Mti::new();
    let (mut samples, mut bytes) = (Vec::with_capacity(recording.rows.len()), 0);
    // The part's 32-bit tick counter does not contain the earlier wraps of the recording's time.
    let first = recording.rows.first().map_or(0, |row| row.sample.time.0);
    let epoch = first - first % (TICK_US << 32);
    for (row, frame) in recording.rows.iter().zip(messages(recording)) {
        bytes += frame.len() as u64;
        frame.iter().for_each(|byte| mti.receive(*byte));
        let delivered = mti.next_sample().ok_or_else(|| "no frame was found".to_owned());
        let sample = delivered.and_then(|sample| sample.map_err(|error| error.to_string()));
        let sample = sample.map_err(|why| Part::Xsens.no_sample(recording, row, why))?;
        samples.push(ImuSample { time: Micros(sample.time.0 + epoch), ..sample });
    }
    Ok((samples, bytes))
}

/// Returns the bytes of each row's message.
pub fn messages(recording: &Recording) -> impl Iterator<Item = Vec<u8>> {
    let rows = recording.rows.iter().enumerate();
    rows.map(|(number, row)| message(number, &row.sample).emit().to_vec())
}

/// Encodes a sample as a message. The sample's codes come from f32, so decoding gives the same codes.
pub fn message(number: usize, sample: &ImuSample) -> MtData2 {
    MtData2 {
        packet_counter: Some(number as u16),
        sample_time_fine: Some((sample.time.0 / TICK_US) as u32),
        acceleration: Some(sample.specific_force.map(|force| force.metre_per_sec2() as f32)),
        rate_of_turn: Some(sample.angular_rate.map(|rate| rate.rad_per_sec() as f32)),
        temperature: sample.temperature.map(|code| f32::from(code.0) / 100.0),
        status: Some(GOOD | if !sample.validity.is_good() { CLIPPED } else { 0 }),
    }
}

//! The board's main loop on the host: bytes of an Xsens MTi in, SLCAN lines out.

use crate::recordings::Row;
use gyronet::can::config::Config;
use gyronet::can::feeds::Feeds;
use gyronet::can::{DataFrame, slcan};
use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
use gyronet::pipeline::{Pipeline, PipelineConfig};
use gyronet::sensor::xsens::{MtData2, Mti};

/// What the image sends.
pub const CONFIG: Config = Config::DEFAULT;

/// The message that an MTi would send for a row.
#[must_use]
pub fn message(number: usize, row: &Row) -> MtData2 {
    MtData2 {
        packet_counter: Some(number as u16),
        sample_time_fine: Some((row.time * 10_000.0).round() as u32),
        acceleration: Some(row.acceleration),
        rate_of_turn: Some(row.rate_of_turn),
        temperature: None,
        status: Some(3),
    }
}

/// What it sends when the vehicle is level and turns at `yaw_rate`, rad/s, 10 ms after 10 ms.
#[must_use]
pub fn turning(number: usize, yaw_rate: f32) -> Vec<u8> {
    let row = Row {
        time: number as f64 * 0.01,
        acceleration: [0.0, 0.0, 9.81],
        rate_of_turn: [0.0, 0.0, yaw_rate],
        reference: 0.0,
    };
    message(number, &row).emit().to_vec()
}

/// What the board must send for these bytes, line by line without the CR.
///
/// # Panics
/// When the library's own weights are refused.
#[must_use]
pub fn lines(bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut network =
        GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library"));
    let mut mti = Mti::new();
    let mut pipeline = Pipeline::new(PipelineConfig::DEFAULT);
    let mut feeds = Feeds::new(CONFIG);
    let mut lines = Vec::new();
    for byte in bytes {
        mti.push(*byte);
        while let Some(sample) = mti.next_sample() {
            let Ok(Ok(output)) = sample.map(|sample| pipeline.process(sample)) else { continue };
            if let Some(due) = output.window {
                pipeline.deliver(due.end, network.estimate(&due.features));
            }
            for frame in feeds.process::<DataFrame>(&output.vehicle) {
                let line = slcan::emit(&frame).expect("a data frame");
                lines.push(line.strip_suffix(b"\r").expect("a CR").to_vec());
            }
        }
    }
    lines
}

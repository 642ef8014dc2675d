//! Every entry point for bytes from outside, as a function that accepts any bytes and panics if the result breaks a
//! guarantee. `host-tests/fuzz` runs them under coverage; `tests/library/entrances.rs` runs them over the corpus and over
//! damaged copies of it.

mod can;
mod diagnosis;
pub mod records;
mod sensors;
mod slcan;
mod weights;

use gyronet_tools::drive::recording::Reader;
use gyronet_tools::drive::stream::Recording;

#[derive(Debug, Clone, Copy)]
pub struct Entrance {
    /// Also that of its folder in the corpus.
    pub name: &'static str,
    pub run: fn(&[u8]),
    /// The number of damaged copies that a test runs in well under a second.
    pub mutations: u64,
}

pub const ALL: [Entrance; 15] = [
    Entrance { name: "xsens", run: sensors::xsens, mutations: 20_000 },
    Entrance { name: "dsp1760", run: sensors::dsp1760, mutations: 20_000 },
    Entrance { name: "asm330lhh", run: sensors::asm330lhh, mutations: 20_000 },
    Entrance { name: "bmi088", run: sensors::bmi088, mutations: 20_000 },
    Entrance { name: "icm42688", run: sensors::icm42688, mutations: 20_000 },
    Entrance { name: "gnss", run: sensors::gnss, mutations: 20_000 },
    Entrance { name: "slcan_board", run: slcan::board, mutations: 20_000 },
    Entrance { name: "slcan_host", run: slcan::host, mutations: 20_000 },
    Entrance { name: "can_wheels", run: can::wheels, mutations: 20_000 },
    Entrance { name: "can_messages", run: can::messages, mutations: 20_000 },
    Entrance { name: "diagnosis", run: diagnosis::frames, mutations: 5_000 },
    Entrance { name: "records", run: records::flash, mutations: 5_000 },
    Entrance { name: "gyronet_blob", run: weights::gyronet, mutations: 100 },
    Entrance { name: "fognet_blob", run: weights::fognet, mutations: 50 },
    Entrance { name: "recording", run: recording, mutations: 1_000 },
];

/// Reads bytes as a user's recording. The rows that are read must have rising times and finite values, and an error must
/// name the file.
fn recording(data: &[u8]) {
    if let Err(error) = Recording::parse("fuzz.csv", data) {
        assert!(error.to_string().starts_with("fuzz.csv"));
    }
    let Ok(reader) = Reader::new("fuzz.csv", data) else { return };
    let mut last = None;
    for row in reader.map_while(Result::ok) {
        assert!(last < Some(row.sample.time));
        assert!(row.wheels.iter().chain([&row.reference]).flatten().all(|value| value.is_finite()));
        last = Some(row.sample.time);
    }
}

/// Takes `len` bytes off the front, or all if there are fewer.
fn take<'d>(data: &mut &'d [u8], len: usize) -> &'d [u8] {
    let (head, tail) = data.split_at(len.min(data.len()));
    *data = tail;
    head
}

/// Takes a byte off the front, or zero at the end.
fn byte(data: &mut &[u8]) -> u8 {
    take(data, 1).first().copied().unwrap_or_default()
}

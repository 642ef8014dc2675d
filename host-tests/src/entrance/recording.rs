//! Reads recordings as CSV files, as a user passes them to the tools.

use gyronet_tools::drive::recording::{Reader, Recording};

/// Reads bytes as a file. The rows that are read must have rising times and finite values, and an error must name the
/// file.
pub fn csv(data: &[u8]) {
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

//! Reads recordings as CSV files, as a user passes them to the tools.

use super::Seed;
use gyronet::sample::PERIOD_US;
use gyronet_tools::drive::recording::{Reader, Recording};
use std::fmt::Write as _;

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

pub fn seeds() -> Vec<Seed> {
    let mut still = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n");
    for k in 0..301 {
        let _ = writeln!(still, "{},0,0,9.8,0,0,0", f64::from(k) * PERIOD_US as f64 * 1e-6);
    }
    let every = "\u{feff}t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z,wheel1_rate,other\n\
                 0.00,0.1,-0.2,9.81,0.01,-0.01,1e-3,0.25,,\"a,b\"\n\
                 0.01, 0.1 ,-0.2,9.81,0.01,-0.01,1e-3,,0.5,\n";
    vec![("still", still.into_bytes()), ("every_column", every.into()), ("nothing", b"t_s\n".to_vec())]
}

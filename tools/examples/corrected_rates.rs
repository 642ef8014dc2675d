//! Prints the corrected yaw rates of a recorded drive as CSV.
//!
//! `cargo run --release -p gyronet-tools --example corrected_rates -- tools/data/simulated_drive.csv`
//!
//! Each line is a sample after static initialisation: time, s; the yaw rate of the gyro, the live rate, the
//! delayed rate, which is sent 70 ms later, and its expected error, rad/s. An empty field is unknown.

use gyronet::coprocessor::Config;
use gyronet::model::{Blob, GyroNet, weights};
use gyronet_tools::board::Board;
use gyronet_tools::drive::replay::Steps;
use gyronet_tools::drive::stream::Drive;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("no drive given: pass the path of a CSV file")?;
    let drive = Drive::open(Path::new(&file))?;
    let network = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0)?);
    // If the drive has wheels, they show when the vehicle stands.
    let board = Board::new(Config::DEFAULT, drive.wheels(), network);

    println!("t_s,gyro,live,delayed,sigma");
    for step in Steps::new(&drive, board)? {
        let step = step?;
        if !step.is_initialised {
            continue;
        }
        let [.., gyro] = step.input.sample.angular_rate;
        let delayed = step.delayed.map(|rate| format!("{:.6}", rate.rate.rad_per_sec()));
        let sigma = step.delayed.and_then(|rate| rate.sigma);
        println!(
            "{:.2},{:.6},{:.6},{},{}",
            step.time.0 as f64 * 1e-6,
            gyro.rad_per_sec(),
            step.vehicle.live.rate.rad_per_sec(),
            delayed.unwrap_or_default(),
            sigma.map(|sigma| format!("{:.6}", sigma.rad_per_sec())).unwrap_or_default(),
        );
    }
    Ok(())
}

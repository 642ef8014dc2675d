//! Corrected yaw rates of a recorded drive, as CSV.
//!
//! `cargo run --release -p gyronet-tools --example corrected_rates -- tools/data/simulated_drive.csv`
//!
//! A line a sample, from the end of static initialisation on: its time, s; the gyro's yaw rate, the
//! corrected one as it is sent at once, the one that is sent for navigation 70 ms later, and the error
//! to expect of the last, all in rad/s (empty: not known).

use gyronet::model::{Blob, GyroNet, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::drive::wheel_frames::WheelFrames;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("which drive? Name a CSV file")?;
    let recording = Recording::read(Path::new(&file))?;
    let mut network = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0)?);
    // The wheels, where the drive has them, say when it stands still.
    let wheels = WheelFrames::new(&recording);
    let drive = Replay::run(&recording, &PipelineConfig::DEFAULT, wheels, &mut network, || {})?;

    println!("t_s,gyro,prompt,navigation,sigma");
    for step in &drive.steps[drive.compared()] {
        let [.., gyro] = recording.rows[step.row].sample.angular_rate;
        let navigation = step.navigation.map(|rate| format!("{:.6}", rate.rate.rad_per_sec()));
        let sigma = step.navigation.and_then(|rate| rate.sigma);
        println!(
            "{:.2},{:.6},{:.6},{},{}",
            step.time.0 as f64 * 1e-6,
            gyro.rad_per_sec(),
            step.vehicle.prompt.rate.rad_per_sec(),
            navigation.unwrap_or_default(),
            sigma.map(|sigma| format!("{:.6}", sigma.rad_per_sec())).unwrap_or_default(),
        );
    }
    Ok(())
}

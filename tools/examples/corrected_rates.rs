//! This example prints the corrected yaw rates of a recorded drive as CSV.
//!
//! `cargo run --release -p gyronet-tools --example corrected_rates -- tools/data/simulated_drive.csv`
//!
//! Each line is a sample after static initialisation: time, s; the yaw rate of the gyro, the prompt rate, the
//! navigation rate, which is sent 70 ms later, and its expected error, rad/s. An empty field is unknown.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::drive::wheel_frames::WheelFrames;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).ok_or("no drive given: pass the path of a CSV file")?;
    let recording = Recording::read(Path::new(&file))?;
    let mut network = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0)?);
    // If the drive has wheels, they show when the vehicle stands.
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

//! Calibrates a board that stands still, and reads and changes its calibration.

use super::{Board, print_value};
use clap::ValueEnum;
use gyronet::service::calibrate::{State, Task};
use gyronet_tools::calibrate::unit_file;
use gyronet_tools::client::device::calibration::to_value;
use std::path::Path;
use std::time::{Duration, Instant};

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum What {
    /// Measure the gyro's bias at rest.
    Static,
    /// Measure roll and pitch of the sensor at rest on level ground.
    Mounting,
    /// Store the gain and mounting that `gyronet calibrate` found; needs --file.
    Unit,
    /// Remove the stored gain and mounting.
    NoUnit,
    /// Erase what the board has learnt, after another sensor was fitted or the sensor was moved.
    Forget,
    /// Print the calibration, and what the board has learnt: the bias curve, the tilt and the forward direction.
    Show,
    /// Cancel the running calibration without a result.
    Cancel,
}

/// Longest time for the 3 s at rest, with a margin for a slow line.
const LIMIT: Duration = Duration::from_secs(10);
const POLL: Duration = Duration::from_millis(200);

pub fn run(
    device: &mut Board,
    what: What,
    file: Option<&Path>,
    store: bool,
    json: bool,
) -> crate::commands::Result {
    let task = match what {
        What::Show => None,
        What::Unit => {
            let path = file.ok_or("give the file of `gyronet calibrate` with --file")?;
            device.set_unit(Some(unit_file::read(path)?))?;
            None
        }
        What::NoUnit => {
            device.set_unit(None)?;
            None
        }
        What::Forget => {
            device.forget_learned()?;
            None
        }
        What::Cancel => {
            device.cancel_calibration()?;
            None
        }
        What::Static => Some(Task::Static),
        What::Mounting => Some(Task::Mounting),
    };
    if let Some(task) = task {
        device.start_calibration(task)?;
    }
    let until = Instant::now() + LIMIT;
    loop {
        match device.calibration_state()? {
            State::Running(_) if task.is_some() => {
                if Instant::now() > until {
                    device.cancel_calibration()?;
                    return Err("the sensor has not sent 3 s of samples".into());
                }
                std::thread::sleep(POLL);
            }
            State::Failed(_, fault) if task.is_some() => {
                return Err(format!("the calibration failed: {fault}").into());
            }
            _ => {
                if store {
                    device.store_calibration()?;
                }
                let (forward, tilt) = (device.forward_deg()?, device.level_deg()?);
                let learned = to_value(&device.calibration()?, &device.learned()?, forward, tilt)?;
                return print_value(&learned, json);
            }
        }
    }
}

//! The calibration of a board that stands still.

use super::{Board, mismatch, print_value};
use clap::ValueEnum;
use gyronet::service::calibrate::{State, Task};
use gyronet::service::message::Calibrate;
use gyronet::service::{Reply, Request};
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
    /// Store the gain and mounting that `gyronet calibrate` found; wants --file.
    Unit,
    /// Remove the stored gain and mounting.
    NoUnit,
    /// Print the calibration.
    Show,
    /// Stop without a result.
    Cancel,
}

/// Three seconds at rest, and as many again for a slow line.
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
            device.ask(&Request::Calibrate(Calibrate::SetUnit(Some(unit_file::read(path)?))))?;
            None
        }
        What::NoUnit => {
            device.ask(&Request::Calibrate(Calibrate::SetUnit(None)))?;
            None
        }
        What::Cancel => {
            device.ask(&Request::Calibrate(Calibrate::Cancel))?;
            None
        }
        What::Static => Some(Task::Static),
        What::Mounting => Some(Task::Mounting),
    };
    if let Some(task) = task {
        device.ask(&Request::Calibrate(Calibrate::Start(task)))?;
    }
    let until = Instant::now() + LIMIT;
    loop {
        let Reply::Calibration { state, calibration, .. } = device.ask(&Request::GetCalibration)? else {
            return mismatch();
        };
        match state {
            State::Running(_) if task.is_some() => {
                if Instant::now() > until {
                    device.ask(&Request::Calibrate(Calibrate::Cancel))?;
                    return Err("no three seconds of samples have come from the sensor".into());
                }
                std::thread::sleep(POLL);
            }
            State::Failed(_, fault) if task.is_some() => {
                return Err(format!("nothing was found: {fault}").into());
            }
            _ => {
                if store {
                    device.ask(&Request::Calibrate(Calibrate::Store))?;
                }
                return print_value(&to_value(&calibration)?, json);
            }
        }
    }
}

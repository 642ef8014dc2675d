//! Reads and changes the calibration of a board, and what it has learnt.

use super::{Board, print_value};
use crate::commands::Common;
use clap::ValueEnum;
use gyronet_tools::calibrate::unit_file;
use gyronet_tools::client::device::calibration::to_value;
use std::path::Path;

#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum What {
    /// Store the gain and mounting that `gyronet calibrate` found; needs --file.
    Unit,
    /// Remove the stored gain and mounting.
    NoUnit,
    /// Erase what the board has learnt, after another sensor was fitted or the sensor was moved.
    Forget,
    /// Print the calibration, and what the board has learnt: the bias by temperature, the tilt and the forward direction.
    Show,
}

pub fn run(device: &mut Board, what: What, file: Option<&Path>, common: Common) -> crate::commands::Result {
    match what {
        What::Show => {}
        What::Unit => {
            let path = file.ok_or("give the file of `gyronet calibrate` with --file")?;
            device.set_unit(Some(unit_file::read(path)?))?;
        }
        What::NoUnit => device.set_unit(None)?,
        What::Forget => device.forget_learned()?,
    }
    let (forward, tilt) = (device.forward_deg()?, device.level_deg()?);
    print_value(&to_value(&device.calibration()?, &device.learned()?, forward, tilt), common)
}

//! Writes a sequence as one CSV file, with the columns of [`gyronet_tools::drive::recording`] and further columns
//! that only a sequence has.

use super::{Sequence, Step};
use gyronet_tools::drive::DT;
use std::io::{self, Write};

/// Header of the file. Wheels are rear right and rear left; `fog_rad`, `left_m` and `right_m` count from the previous
/// row.
pub const HEADER: &str = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z,wheel2_rate,wheel4_rate,\
                          fog_rad,left_m,right_m,ref_x_m,ref_y_m,ref_yaw_rad,vendor_yaw_rad";

/// Writes all steps except those in a gap of the inertial sensor; returns the number of rows.
pub fn write_csv(sequence: &Sequence, out: impl Write) -> io::Result<u64> {
    write(sequence, out, |step| !step.imu_gap)
}

/// Writes the steps that are not in a gap of any file; returns the number of rows.
pub fn write_whole(sequence: &Sequence, out: impl Write) -> io::Result<u64> {
    write(sequence, out, |step| !step.imu_gap && !step.other_gap)
}

fn write(sequence: &Sequence, out: impl Write, kept: impl Fn(&Step) -> bool) -> io::Result<u64> {
    let mut out = csv::WriterBuilder::new().has_headers(false).from_writer(out);
    out.write_record(HEADER.split(','))?;
    let mut rows = 0;
    for (k, (step, turn)) in sequence.steps.iter().zip(sequence.turns()).enumerate() {
        if !kept(step) {
            continue;
        }
        // The time is printed in whole hundredths, because 0.01 times a count would show rounding.
        let time = format!("{}.{:02}", k / 100, k % 100);
        let [left, right] = step.wheels;
        let [left_rate, right_rate] = sequence.wheel_rates(step);
        let [x, y] = step.position;
        let rest = [turn / DT, right_rate, left_rate, step.fog, left, right, x, y, step.yaw];
        let vendor_yaw = sequence.simulated.is_none().then_some(step.vendor_yaw);
        out.serialize((time, step.specific_force, step.angular_rate, rest, vendor_yaw))?;
        rows += 1;
    }
    out.flush()?;
    Ok(rows)
}

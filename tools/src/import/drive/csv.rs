//! Writes an imported drive as the CSV that every command reads.

use super::{Drive, Seen, channels};
use std::io::{self, Write};

impl Drive<'_> {
    /// Writes the drive as CSV; columns that are empty in every row are left out.
    pub fn write_csv(&self, mut out: impl Write) -> io::Result<()> {
        let Seen { reference, course, wheels, .. } = self.seen;
        write!(out, "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z")?;
        if reference {
            write!(out, ",ref_gyr_z")?;
        }
        if course {
            write!(out, ",ref_yaw,ref_yaw_sigma,gnss_speed")?;
        }
        for wheel in (0..4).filter(|wheel| wheels[*wheel]) {
            write!(out, ",wheel{}_rate", wheel + 1)?;
        }
        writeln!(out)?;
        for row in self.rows() {
            write!(out, "{:.2}", row.seconds)?;
            for value in row.imu {
                write!(out, ",{value:.7}")?;
            }
            if reference {
                field(&mut out, row.reference)?;
            }
            if course {
                for k in 0..3 {
                    field(&mut out, row.course.map(|course| course[k]))?;
                }
            }
            for wheel in (0..4).filter(|wheel| wheels[*wheel]) {
                field(&mut out, row.wheels[wheel])?;
            }
            writeln!(out)?;
        }
        if let Some(error) = channels(&self.selection).find_map(|channel| channel.samples.failure()) {
            return Err(error);
        }
        out.flush()
    }
}

fn field(out: &mut impl Write, value: Option<f64>) -> io::Result<()> {
    match value {
        Some(value) => write!(out, ",{value:.6}"),
        None => write!(out, ","),
    }
}

//! The faults of a data set's files and of trajectories; the error that carries one names the file.

use gyronet_tools::drive::error::DataFault;

#[derive(Debug, thiserror::Error)]
pub enum SequenceFault {
    #[error("no KAIST Urban sequence, which is a folder with sensor_data in it")]
    UnknownLayout,
    #[error("{found} columns, expected {expected}")]
    Columns { found: usize, expected: usize },
    #[error("time goes backwards from {last} to {at}")]
    Backwards { last: i64, at: i64 },
    /// The gap before a row is so long that the rows after it belong to another drive.
    #[error("silent for {seconds:.0} s before this row; a gap of a drive is at most {most} s long")]
    Silent { seconds: f64, most: f64 },
    #[error("its files have {seconds:.2} s in common, needed are {needed} s")]
    TooLittleInCommon { seconds: f64, needed: f64 },
    #[error(
        "starts moving: its wheels roll {metres:.2} m in the first 3 s; at most {most} m count as standing"
    )]
    Rolling { metres: f64, most: f64 },
    #[error("no usable parameter {0:?}")]
    Parameter(&'static str),
    #[error("a quaternion of norm {norm:.3}, which is no attitude")]
    Quaternion { norm: f64 },
    #[error("{seconds:.2} s after the previous pose; at most {most} s can be interpolated")]
    FarApart { seconds: f64, most: f64 },
    #[error(
        "has poses from {from_s:.2} to {to_s:.2} s, but {begin_s:.2} to {end_s:.2} s are needed: wrong length or clock"
    )]
    Span { from_s: f64, to_s: f64, begin_s: f64, end_s: f64 },
    #[error("{metres:.2} m and {degrees:.1} deg from the truth at the start: the frames differ")]
    Frame { metres: f64, degrees: f64 },
    #[error("{metres:.0} m from the truth, where at most {most:.0} m are possible: it has diverged")]
    Diverged { metres: f64, most: f64 },
    #[error("xsens_imu.csv has 8 columns: no gyro and no accelerometer")]
    NoGyro,
    #[error(transparent)]
    Marker(#[from] serde_json::Error),
}

impl From<SequenceFault> for DataFault {
    fn from(fault: SequenceFault) -> Self {
        Self::Other(fault.into())
    }
}

//! This module calibrates one unit: gain and mounting of its gyro, from drives with a reference of their heading.
//!
//! A yaw rate that the coprocessor has corrected still contains a share of the roll rate and of the pitch rate (the
//! sensor is not level in the vehicle, or the reference is not) and a share of itself (gain). Over a second or more
//! these errors add up to an angle, and the reference shows it. The shares are fitted to those angles, each drive with
//! a constant of its own, because bias belongs to the drive and not to the unit. They are the last row of a 3 x 3 map
//! ([`gyronet::mounting::GyroMap`]) that the board applies to every sample. The rows above it stay those of the
//! identity, because a heading does not depend on them.

mod fit;
mod spans;
pub mod unit_file;

use crate::drive::recording::Recording;
use crate::drive::replay::{Replay, ReplayError};
use fit::Fit;
use gyronet::mounting::GyroMap;
use spans::Span;
use unit_file::UnitFile;

/// A drive needs at least this many seconds after static initialisation.
const SHORTEST_S: f64 = 30.0;
/// The sigma of another axis's share may be at most this: 1.1 deg of mounting.
const MAX_CROSS_SIGMA: f64 = 0.02;
/// The sigma of the gain may be at most this.
const MAX_GAIN_SIGMA: f64 = 0.005;
/// The robust deviation of the spans' angles from the fit may be at most this, rad: no corrected gyro has so large an
/// error in so short a time.
const MAX_RESIDUAL_RAD: f64 = 0.05;

/// The reason why a drive gives no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// The drive cannot be run.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The drive has no reference of its heading.
    #[error("{path}: no {columns}, which a calibration needs")]
    NoReference {
        /// The recording.
        path: String,
        /// The columns that would serve as one.
        columns: &'static str,
    },
    /// The drive is too short.
    #[error("{path}: {seconds:.0} s with a reference, a calibration needs {SHORTEST_S:.0}")]
    TooShort {
        /// The recording.
        path: String,
        /// The time with a reference, s.
        seconds: f64,
    },
    /// Reference and gyro contradict each other, whatever the calibration.
    #[error("{path}: reference and gyro differ by {rad:.3} rad from span to span: they are not of one drive")]
    Contradiction {
        /// The recording.
        path: String,
        /// The robust deviation.
        rad: f64,
    },
    /// An element is further from the identity than a real unit's can be.
    #[error("{what} {value:+.4}: no unit is so far off; configure how the sensor is mounted")]
    Implausible {
        /// The name of the element.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Holds a share of the map, with its sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The name of the share.
    pub name: &'static str,
    /// The value; 0 where it is refused.
    pub value: f64,
    /// Its standard deviation, from fits that leave out one block of time each.
    pub sigma: f64,
    /// The reason why it is refused: the drives do not show it.
    pub refused: Option<&'static str>,
}

/// Holds a drive, replayed with the weights that the board runs.
pub struct Drive<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// Its replay, without a map.
    pub replay: Replay,
}

/// Lists the shares: the name, the largest sigma, and what the drives lack if the share is not found.
const SHARES: [(&str, f64, &str); 3] = [
    ("roll", MAX_CROSS_SIGMA, "no rolling: the drives do not show it"),
    ("pitch", MAX_CROSS_SIGMA, "no pitching: the drives do not show it"),
    ("gain", MAX_GAIN_SIGMA, "no turns, or all alike: the drives do not tell it from a bias"),
];

/// Fits the map of a unit to its drives.
///
/// # Errors
/// [`CalibrateError`].
pub fn calibrate(drives: &[Drive<'_>], weights: u32) -> Result<UnitFile, CalibrateError> {
    let spans: Vec<Vec<Span>> = drives.iter().map(spans::of).collect::<Result<_, _>>()?;
    // A share that the drives hardly show makes the others uncertain, so the least certain one goes first.
    let (mut fitted, mut refused) = ([true; 3], [None; 3]);
    let fit = loop {
        let fit = Fit::new(&spans, fitted);
        let excess = |k: &usize| fit.sigmas[*k] / SHARES[*k].1;
        let worst = (0..3).filter(|k| fitted[*k]).max_by(|a, b| excess(a).total_cmp(&excess(b)));
        match worst.filter(|k| excess(k) > 1.0) {
            Some(k) => (fitted[k], refused[k]) = (false, Some(fit.sigmas[k])),
            None => break fit,
        }
    };
    let shares: [Share; 3] = std::array::from_fn(|k| {
        let (name, _, lacking) = SHARES[k];
        match refused[k] {
            None => Share { name, value: fit.shares[k], sigma: fit.sigmas[k], refused: None },
            Some(sigma) => Share { name, value: 0.0, sigma, refused: Some(lacking) },
        }
    });
    for (drive, deviation) in drives.iter().zip(&fit.deviations) {
        if *deviation > MAX_RESIDUAL_RAD {
            let path = drive.recording.path.clone();
            return Err(CalibrateError::Contradiction { path, rad: *deviation });
        }
    }
    let [roll, pitch, gain] = shares.map(|share| share.value);
    let elements = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [roll, pitch, 1.0 + gain]];
    let gyro_map = GyroMap::from_elements(elements.map(|row| row.map(|element| element as f32)));
    let gyro_map = gyro_map.ok_or_else(|| {
        let farthest = shares.iter().max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
        let (what, value) = farthest.map_or(("map", 0.0), |share| (share.name, share.value));
        CalibrateError::Implausible { what, value }
    })?;
    Ok(UnitFile { gyro_map, shares, weights, drives: unit_file::drives(drives, &fit) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Config, csv};
    use gyronet::model::window::{Features, WINDOW};
    use gyronet::model::{Estimate, WindowNetwork};
    use gyronet::pipeline::PipelineConfig;
    use gyronet::units::AngularRate;

    struct Nothing;

    impl WindowNetwork for Nothing {
        fn estimate(&mut self, _window: &[Features; WINDOW]) -> Estimate {
            Estimate::NONE
        }
    }

    /// Simulates 20 minutes of a unit that reads 2 % too much about z. The reference is a course once a second, which is
    /// known to 0.02 rad, missing for a minute, and ends at a sample.
    fn by_course(end: usize) -> Result<UnitFile, CalibrateError> {
        let mut bytes = Vec::new();
        csv::write(&Config { seconds: 1_200, seed: 5, ..Config::DEFAULT }, &mut bytes).unwrap();
        let mut recording = Recording::parse("course.csv", &bytes[..]).unwrap();
        let mut random = crate::random::Random::new(1, 0);
        let mut heading = 0.0;
        for (k, row) in recording.rows.iter_mut().enumerate() {
            let rate = row.reference.take().unwrap();
            heading += rate * crate::drive::DT;
            let known = k % 100 == 0 && !(30_000..36_000).contains(&k) && k < end;
            row.course = known.then(|| heading + 0.02 * random.normal());
            let yaw_rate = &mut row.sample.angular_rate[2];
            *yaw_rate = AngularRate((f64::from(yaw_rate.0) * 1.02) as i32);
        }
        let replay = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut Nothing, || {}).unwrap();
        calibrate(&[Drive { recording: &recording, replay }], 0)
    }

    #[test]
    fn a_course_shows_the_gain() {
        let [.., gain] = by_course(usize::MAX).unwrap().shares;
        assert_eq!(gain.refused, None, "{gain:?}");
        // The true rate is the reading over 1.02; the part has a gain of its own, 0.1 % of sigma.
        assert!((gain.value + 0.02).abs() < 0.003 + 3.0 * gain.sigma, "{gain:?}");
    }

    #[test]
    fn half_a_minute_of_course_is_too_short() {
        assert!(matches!(by_course(3_000), Err(CalibrateError::TooShort { .. })), "{:?}", by_course(3_000));
    }
}

//! Calibrates the gain and the mounting of one unit's gyro, from drives with a heading reference.
//!
//! The yaw rate that the coprocessor has corrected still contains a share of the roll rate and of the pitch rate (the
//! sensor or the reference is not level in the vehicle) and a share of itself (gain). Over a second or more these
//! errors add up to an angle, which a reference yaw rate shows. The shares are fitted to those angles, with a separate
//! constant for each drive, because bias belongs to the drive and not to the unit. A course is too inaccurate for mounting; the
//! gain it shows is that which the board learns from it (`by_course`). The shares are the last row of a 3
//! x 3 map ([`gyronet::mounting::GyroMap`]) that the board applies to every sample. The other rows stay those of the
//! identity, because the heading does not depend on them.

mod by_course;
mod fit;
mod normal_equations;
mod spans;
pub mod unit_file;

pub use normal_equations::NormalEquations;

use crate::board::Board;
use crate::drive::error::DataError;
use crate::drive::replay::{Steps, initialise};
use crate::drive::stream::Drive;
use by_course::Learnt;
use fit::Fit;
use gyronet::coprocessor::Config;
use gyronet::heading::CourseConfig;
use gyronet::model::WindowNetwork;
use gyronet::mounting::GyroMap;
use gyronet::pipeline::PipelineConfig;
use gyronet::units::AngularRate;
use spans::{Span, Spans};
use unit_file::UnitFile;

/// Shortest reference that a drive needs after static initialisation, s.
const SHORTEST_S: f64 = 30.0;
/// Largest sigma of the share of the roll or pitch rate: 1.1 deg of mounting.
const MAX_CROSS_SIGMA: f64 = 0.02;
const MAX_GAIN_SIGMA: f64 = 0.005;
/// Gain of a unit of which nothing is known, 1 sigma.
const UNKNOWN_GAIN: f32 = 0.02;
/// Least angle turned in all drives for a gain, as the doctor says, rad; and in a second that turns.
pub const LEAST_TURNED_RAD: f64 = 6.0;
pub const STRAIGHT_RAD: f64 = 0.02;
/// Least share of the turns to either side.
const LEAST_OTHER_SIDE: f64 = 0.1;
/// Largest robust deviation of the spans' angles from the fit, rad. No corrected gyro has an error that large in that
/// time.
const MAX_RESIDUAL_RAD: f64 = 0.05;

fn too_short(path: &str, seconds: f64) -> DataError {
    let reason = format!("only {seconds:.0} s with a reference; a calibration needs {SHORTEST_S:.0} s");
    DataError::because(path, reason)
}

/// A share that the fit has found, with its sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    pub name: &'static str,
    /// The value; 0 if the share is refused.
    pub value: f64,
    /// Standard deviation of the value, from fits that each leave out one block of time, or by the board, and the largest that is
    /// taken.
    pub sigma: f64,
    pub limit: f64,
    /// The reason why the share is refused: what the drives lack to show it.
    pub refused: Option<&'static str>,
    /// The reason to doubt a share that is not refused.
    pub remark: Option<&'static str>,
}

/// A drive, replayed with the weights that the board runs: cut into spans by its reference yaw rate, or what the board has
/// learnt by its course.
#[derive(Debug)]
pub struct Cut {
    path: String,
    name: String,
    /// The gyro's static bias, rad/s.
    gyro_bias: [f64; 3],
    /// The sums of all turns to the left and to the right, rad.
    turned: [f64; 2],
    spans: Vec<Span>,
    by_course: Option<Learnt>,
}

/// The configuration of the board that a drive is cut with: nothing is known of the gain.
pub fn config() -> Config {
    let course = CourseConfig { gain: UNKNOWN_GAIN, ..CourseConfig::DEFAULT };
    Config { pipeline: PipelineConfig { course, ..PipelineConfig::DEFAULT }, ..Config::DEFAULT }
}

impl Cut {
    /// Runs a drive on a board that applies no map, of [`config`]; `tick` is called for each step. The drive is read twice: its
    /// beginning for the static bias, then as a whole.
    pub fn new(
        drive: &Drive<'_>,
        board: Board<impl WindowNetwork>,
        mut tick: impl FnMut(),
    ) -> Result<Self, DataError> {
        let (path, name) = (drive.path.clone(), drive.name().to_owned());
        if !drive.facts.has_rate {
            let learnt = by_course::learn(drive, board, tick)?;
            let (gyro_bias, by_course) = (learnt.gyro_bias, Some(learnt));
            return Ok(Self { path, name, gyro_bias, turned: [0.0; 2], spans: Vec::new(), by_course });
        }
        let gyro_bias = initialise(drive)?.map(AngularRate::rad_per_sec);
        let mut spans = Spans::default();
        for step in Steps::new(drive, board)? {
            tick();
            spans.add(&step?, &gyro_bias);
        }
        let (turned, spans) = (spans.turned(), spans.finish(&drive.path)?);
        Ok(Self { path, name, gyro_bias, turned, spans, by_course: None })
    }
}

/// Name of each share, its largest sigma, and the reason for a refusal.
const SHARES: [(&str, f64, &str); 3] = [
    ("roll", MAX_CROSS_SIGMA, "too little rolling in the drives to observe it"),
    ("pitch", MAX_CROSS_SIGMA, "too little pitching in the drives to observe it"),
    (
        "gain",
        MAX_GAIN_SIGMA,
        "turns all alike, or a reference that scatters: the drives cannot tell it from a bias",
    ),
];

pub fn calibrate(drives: &[Cut], weights: u32) -> Result<UnitFile, DataError> {
    let by_rate: Vec<&Cut> = drives.iter().filter(|drive| drive.by_course.is_none()).collect();
    let spans: Vec<&[Span]> = by_rate.iter().map(|drive| drive.spans.as_slice()).collect();
    // A share that the drives hardly show makes the others uncertain, so the least certain one is removed first.
    let (mut fitted, mut refused) = ([!spans.is_empty(); 3], [spans.is_empty().then_some(f64::INFINITY); 3]);
    let [left, right] = [0, 1].map(|side| drives.iter().map(|drive| drive.turned[side]).sum::<f64>());
    let (has_turned, has_two_sides) =
        (left + right >= LEAST_TURNED_RAD, left.min(right) > LEAST_OTHER_SIDE * (left + right));
    let fit = loop {
        let fit = Fit::new(&spans, fitted);
        let excess =
            |k: &usize| if *k < 2 || has_turned { fit.sigmas[*k] / SHARES[*k].1 } else { f64::INFINITY };
        let worst = (0..3).filter(|k| fitted[*k]).max_by(|a, b| excess(a).total_cmp(&excess(b)));
        match worst.filter(|k| excess(k) > 1.0) {
            Some(k) => (fitted[k], refused[k]) = (false, Some(fit.sigmas[k])),
            None => break fit,
        }
    };
    let shares: [Share; 3] = std::array::from_fn(|k| {
        let (name, limit, lacking) = SHARES[k];
        let lacking = match (k, spans.is_empty()) {
            (0 | 1, true) => "a course is too inaccurate to show it",
            (2, false) if !has_turned => "too few turns, 6 rad are needed",
            _ => lacking,
        };
        let by_fit = [fit.shares[k], refused[k].map_or(fit.sigmas[k], |_| f64::INFINITY)];
        let by_course = drives.iter().filter_map(|drive| drive.by_course).filter(|_| k == 2);
        let [value, sigma] = by_course.fold(by_fit, |found, learnt| combined(found, learnt.gain));
        if sigma <= limit {
            let remark = match (value.abs() < sigma, has_two_sides || spans.is_empty()) {
                (false, true) => None,
                (true, true) => Some("smaller than its sigma"),
                (false, false) => Some("turns to one side only"),
                (true, false) => Some("smaller than its sigma; turns to one side only"),
            };
            return Share { name, value, sigma, limit, refused: None, remark };
        }
        let sigma = refused[k].unwrap_or(sigma).min(sigma);
        Share { name, value: 0.0, sigma, limit, refused: Some(lacking), remark: None }
    });
    for (drive, deviation) in by_rate.iter().zip(&fit.deviations) {
        if *deviation > MAX_RESIDUAL_RAD {
            let reason = format!(
                "reference and gyro differ by {deviation:.3} rad from span to span: a wrong unit or clock, or another drive; \
                 `gyronet doctor` says which"
            );
            return Err(DataError::because(&drive.path, reason));
        }
    }
    let [roll, pitch, gain] = shares.map(|share| share.value);
    let elements = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [roll, pitch, 1.0 + gain]];
    let gyro_map = GyroMap::from_elements(elements.map(|row| row.map(|element| element as f32)));
    let gyro_map = gyro_map.ok_or_else(|| {
        let farthest = shares.iter().max_by(|a, b| a.value.abs().total_cmp(&b.value.abs()));
        let (what, value) = farthest.map_or(("map", 0.0), |share| (share.name, share.value));
        let reason = "is too large for any unit; configure how the sensor is mounted";
        DataError::because("calibration", format!("{what} {value:+.4} {reason}"))
    })?;
    Ok(UnitFile { gyro_map, shares, weights, drives: unit_file::drives(drives, &fit) })
}

/// The mean of two values, each with its sigma, weighted with their variances.
fn combined([one, sigma]: [f64; 2], [other, other_sigma]: [f64; 2]) -> [f64; 2] {
    let [weight, other_weight] = [sigma, other_sigma].map(|sigma| sigma.powi(-2));
    let sum = (weight + other_weight).max(f64::MIN_POSITIVE);
    [(weight * one + other_weight * other) / sum, sum.sqrt().recip()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Uncorrected;
    use crate::drive::stream::Recording;
    use crate::simulate::{self, csv};

    /// Simulates 20 minutes of a unit that reads 2 % too much about z. The reference is a course once a second with a
    /// sigma of 0.02 rad, times `sign`. It is missing for a minute, and ends at the sample `end`.
    fn by_course(end: usize, sign: f64) -> Result<UnitFile, DataError> {
        let mut bytes = Vec::new();
        csv::write(&simulate::Config { seconds: 1_200, seed: 5, ..simulate::Config::DEFAULT }, &mut bytes)
            .unwrap();
        let mut recording = Recording::parse("course.csv", &bytes[..]).unwrap();
        let mut random = crate::random::Random::new(1, 0);
        let mut heading = 0.0;
        for (k, row) in recording.rows.iter_mut().enumerate() {
            let rate = row.reference.take().unwrap();
            heading += rate * crate::drive::DT;
            let known = k % 100 == 0 && !(30_000..36_000).contains(&k) && k < end;
            row.course = known.then(|| sign * heading + 0.02 * random.normal());
            let yaw_rate = &mut row.sample.angular_rate[2];
            *yaw_rate = AngularRate((f64::from(yaw_rate.0) * 1.02) as i32);
        }
        calibrate(&[Cut::new(&Drive::from(&recording), Board::new(config(), None, Uncorrected), || {})?], 0)
    }

    #[test]
    fn a_course_shows_the_gain() {
        let [.., gain] = by_course(usize::MAX, 1.0).unwrap().shares;
        assert_eq!(gain.refused, None, "{gain:?}");
        // The true rate is the reading over 1.02; the simulated part adds a gain with a sigma of 0.1 %.
        assert!((gain.value + 0.02).abs() < 0.003 + 3.0 * gain.sigma, "{gain:?}");
    }

    #[test]
    fn few_turns_show_no_gain_however_well_they_fit() {
        let gain = |turn: f64| {
            let span = |k: u32| Span {
                error: 0.01 * turn,
                turns: [0.0, 0.0, turn],
                seconds: 1.0 + f64::from(k % 2),
            };
            let (path, name, spans) = (String::new(), String::new(), (0..100).map(span).collect());
            calibrate(
                &[Cut {
                    path,
                    name,
                    gyro_bias: [0.0; 3],
                    turned: [100.0 * turn, 0.0],
                    spans,
                    by_course: None,
                }],
                0,
            )
            .unwrap()
            .shares[2]
        };
        let found = gain(0.061);
        assert!(gain(0.059).refused.is_some() && (found.value - 0.01).abs() < 1e-6, "{found:?}");
        assert_eq!(found.remark, Some("turns to one side only"));
    }

    #[test]
    fn half_a_minute_of_course_is_too_short() {
        let error = by_course(3_000, 1.0).unwrap_err().to_string();
        assert!(error.contains(" s with a reference; a calibration needs 30 s"), "{error}");
    }

    #[test]
    fn a_course_of_the_wrong_sign_is_refused() {
        let error = by_course(usize::MAX, -1.0).unwrap_err().to_string();
        assert!(error.contains("the gyro contradicts"), "{error}");
    }
}

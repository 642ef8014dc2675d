//! Another unit of the same part: a gyro off by 0.5 deg/s, 1 % of gain, mounted 2 degrees askew.
//!
//! Two readings, on real drives. On the network's inputs alone: its correction must not move, and
//! the 1 s error stays within 10 %, but for a bias that static initialisation has not taken: the
//! network takes 3 % of the pitch rate off the yaw rate, for that is how the training car's sensor
//! is mounted, and a pitch rate that is off is a pitch rate to it. Of that it bears what a gyro
//! drifts by in minutes.
//!
//! On the recording as a whole: static initialisation takes the bias before the network sees it, and
//! nothing changes. Gain and mounting act on the yaw rate itself, which no window of 0.1 s can see:
//! 1 % of gain is 1 % of the yaw rate, whatever the network sees. What that does by itself is
//! printed: to one that estimates the unmodified drive without any error (`perfect`), and to the
//! estimates of the unmodified drive, held as they were (`unmoved`). There the network must not add
//! to it: the error stays within 10 % of `unmoved`, and is not within 10 % of the unmodified drive's.

use gyronet::coprocessor::Config;
use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Blob, Estimate, GyroNet, WindowNetwork, weights};
use gyronet::mounting::GyroMap;
use gyronet::pipeline::PipelineConfig;
use gyronet::units::{AngularRate, SpecificForce};
use gyronet_host_tests::{parallel, recordings};
use gyronet_tools::board::Board;
use gyronet_tools::calibrate::{self, Cut};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::{Replay, Step};
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::metrics::YawError;
use std::path::Path;

/// Largest ratio of 1 s errors.
const WITHIN: f64 = 1.1;
/// Validation first, then the test trials, on which nothing is chosen.
const TRIALS: [u32; 3] = [8, 9, 11];

/// The differences of a unit.
#[derive(Debug, Clone, Copy)]
struct Unit {
    name: &'static str,
    /// Each gyro axis, rad/s.
    bias: f64,
    /// Each gyro axis.
    gain: f64,
    /// Rotation vector of the mounting, rad.
    mounting: [f64; 3],
}

const BIAS: f64 = 0.5_f64.to_radians();
/// The drift of a gyro after static initialisation, rad/s.
const DRIFT: f64 = 0.03_f64.to_radians();
const TILT: f64 = 2.0_f64.to_radians();
const SAME: Unit = Unit { name: "unmodified", bias: 0.0, gain: 1.0, mounting: [0.0; 3] };
const UNITS: [Unit; 6] = [
    Unit { name: "bias 0.5 deg/s", bias: BIAS, ..SAME },
    Unit { name: "bias 0.03 deg/s", bias: DRIFT, ..SAME },
    Unit { name: "2 deg about x", mounting: [TILT, 0.0, 0.0], ..SAME },
    Unit { name: "2 deg about y", mounting: [0.0, TILT, 0.0], ..SAME },
    Unit { name: "gain 1 %", gain: 1.01, ..SAME },
    Unit { name: "all, 2 deg about x", bias: BIAS, gain: 1.01, mounting: [TILT, 0.0, 0.0] },
];

impl Unit {
    /// The vector in the frame of this unit: turned the other way by small angles in a row.
    fn turned(&self, [mut x, mut y, mut z]: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.mounting.map(f64::sin_cos);
        (y, z) = (a.1 * y + a.0 * z, a.1 * z - a.0 * y);
        (z, x) = (b.1 * z + b.0 * x, b.1 * x - b.0 * z);
        (x, y) = (c.1 * x + c.0 * y, c.1 * y - c.0 * x);
        [x, y, z]
    }

    /// Codes as this unit would give them: specific force, then angular rate.
    fn codes(&self, codes: Features) -> Features {
        let [fx, fy, fz, wx, wy, wz] = codes.map(f64::from);
        let bias = self.bias * f64::from(AngularRate::PER_RAD_PER_SEC);
        let rate = self.turned([wx, wy, wz]).map(|rate| self.gain * rate + bias);
        let [force, rate] = [self.turned([fx, fy, fz]), rate].map(|v| v.map(|code| code.round() as i32));
        [force, rate].concat().try_into().expect("three and three")
    }

    /// A recording with this unit.
    fn recording(&self, recording: &Recording) -> Recording {
        let mut recording = recording.clone();
        for row in &mut recording.rows {
            let [fx, fy, fz] = row.sample.specific_force.map(|force| force.0);
            let [wx, wy, wz] = row.sample.angular_rate.map(|rate| rate.0);
            let [fx, fy, fz, wx, wy, wz] = self.codes([fx, fy, fz, wx, wy, wz]);
            row.sample.specific_force = [fx, fy, fz].map(SpecificForce);
            row.sample.angular_rate = [wx, wy, wz].map(AngularRate);
        }
        recording
    }
}

/// A network that sees this unit, while the rate that it corrects is the recorded one.
struct Seen<'w>(GyroNet<'w>, Unit);

impl WindowNetwork for Seen<'_> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.0.estimate(&window.map(|features| self.1.codes(features)))
    }
}

/// The yaw rates of the settled part of a recording, rad/s.
struct Rates {
    settled: Vec<f64>,
    /// Gyro less its static mean.
    uncorrected: Vec<f64>,
    reference: Vec<f64>,
}

impl Rates {
    /// Runs a recording without wheels, so that nothing but the network corrects.
    fn new(recording: &Recording, seen: Unit) -> Self {
        Self::of(recording, replay(recording, seen, GyroMap::IDENTITY))
    }

    fn of(recording: &Recording, drive: Replay) -> Self {
        let steps = &drive.steps[drive.start..];
        let reference = steps.iter().map(|step| recording.rows[step.row].reference);
        let [.., bias] = drive.gyro_bias;
        let gyro = |step: &Step| {
            let [.., yaw_rate] = recording.rows[step.row].sample.angular_rate;
            yaw_rate.rad_per_sec() - bias.rad_per_sec()
        };
        Self {
            settled: steps.iter().map(|step| step.settled.rad_per_sec()).collect(),
            uncorrected: steps.iter().map(gyro).collect(),
            reference: reference.map(|rate| rate.expect("the trials have one")).collect(),
        }
    }

    /// Returns the difference of this unit's gyro from another's at each sample, rad/s.
    fn difference(&self, other: &Self) -> Vec<f64> {
        self.uncorrected.iter().zip(&other.uncorrected).map(|(ours, theirs)| ours - theirs).collect()
    }

    /// 1 s error of such rates, rad.
    fn error(&self, rates: &[f64]) -> f64 {
        YawError::new(rates, &self.reference).expect("a whole second").mean_1s_rad
    }
}

fn network() -> GyroNet<'static> {
    GyroNet::new(Blob::new_checked(&weights::GYRONET.0).expect("they come with the library"))
}

fn replay(recording: &Recording, seen: Unit, gyro_map: GyroMap) -> Replay {
    let network = network();
    let config = PipelineConfig { gyro_map, ..PipelineConfig::DEFAULT };
    Replay::run(recording, &config, None, &mut Seen(network, seen), || {}).expect("it stands still first")
}

/// Lines of the table, and what does not hold.
fn judge(trial: u32, path: &Path) -> (String, Vec<String>) {
    let (mut table, mut failures) = (String::new(), Vec::new());
    let recorded = Recording::read(path).expect("a recording");
    let same = Rates::new(&recorded, SAME);
    let base = same.error(&same.settled);
    table += &format!(
        "{trial:02}  {:18}  {:.6} |  {base:.6}  1.000 |  {base:.6}  1.000 |  0.000000   {base:.6}  1.000\n",
        SAME.name,
        same.error(&same.uncorrected),
    );
    // All of them on the validation drive, all at once on the others.
    for unit in UNITS.into_iter().skip(if trial == TRIALS[0] { 0 } else { UNITS.len() - 1 }) {
        let seen = Rates::new(&recorded, unit);
        let inputs = seen.error(&seen.settled);
        let modified = Rates::new(&unit.recording(&recorded), SAME);
        let whole = modified.error(&modified.settled);
        let own = modified.difference(&same);
        let [perfect, unmoved] = [&same.reference, &same.settled].map(|rates| {
            same.error(&rates.iter().zip(&own).map(|(rate, own)| rate + own).collect::<Vec<_>>())
        });
        table += &format!(
            "{trial:02}  {:18}  {:.6} |  {inputs:.6}  {:.3} |  {whole:.6}  {:.3} |  {perfect:.6}   {unmoved:.6}  {:.3}\n",
            unit.name,
            modified.error(&modified.uncorrected),
            inputs / base,
            whole / base,
            unmoved / base,
        );
        let mut must = |holds: bool, what: &str| {
            failures.extend((!holds).then(|| format!("trial {trial:02}, {}: {what}", unit.name)));
        };
        must(unit.bias > DRIFT || inputs <= WITHIN * base, "the correction moves");
        let unseen = unit.gain == 1.0 && unit.mounting == [0.0; 3];
        must(!unseen || whole <= WITHIN * base, "static initialisation leaves the bias");
        must(whole <= WITHIN * unmoved, "the network adds to the unit's own error");
    }
    (table, failures)
}

#[test]
fn another_unit_of_the_part_moves_no_correction() {
    let test = "another_unit_of_the_part_moves_no_correction";
    let Some(paths) = recordings::trials(test, &TRIALS) else { return };
    let drives: Vec<_> = TRIALS.into_iter().zip(paths).collect();
    let heading = "1 s errors, rad           static |    inputs  ratio | recording  ratio |   perfect    unmoved  ratio";
    parallel::table(heading, &drives, |(trial, path)| judge(*trial, path));
}

/// Criterion: calibrated on one drive, the errors of such a unit on other drives are within 10 % of the unmodified
/// unit's.
#[test]
fn one_drive_calibrates_another_unit() {
    const TEST: &str = "one_drive_calibrates_another_unit";
    /// A training drive with turns.
    const CALIBRATED_ON: u32 = 7;
    let Some(shown) = recordings::trial(TEST, CALIBRATED_ON) else { return };
    let shown = Recording::read(&shown).expect("a recording");
    let all = Unit { name: "all, 2 deg about x", bias: BIAS, gain: 1.01, mounting: [TILT, 0.0, 0.0] };
    for unit in [all, Unit { name: "all, 2 deg about y", mounting: [0.0, TILT, 0.0], ..all }] {
        let recording = unit.recording(&shown);
        let board = Board::new(Config::DEFAULT, None, network());
        let cut = Cut::new(&Drive::from(&recording), board, || {}).expect("it turns and tilts");
        let found = calibrate::calibrate(&[cut], 0).expect("it turns and tilts");
        println!("{}: {:?}", unit.name, found.shares);
        for trial in TRIALS {
            let Some(path) = recordings::trial(TEST, trial) else { return };
            let drive = Recording::read(&path).expect("a recording");
            let error = |recording: &Recording, map| {
                let rates = Rates::of(recording, self::replay(recording, SAME, map));
                rates.error(&rates.settled)
            };
            let (base, other) = (error(&drive, GyroMap::IDENTITY), unit.recording(&drive));
            let [before, after] = [GyroMap::IDENTITY, found.gyro_map].map(|map| error(&other, map) / base);
            println!("  trial {trial:02}: {before:.3} of the unmodified unit's error, calibrated {after:.3}");
            assert!(after < WITHIN, "{}, trial {trial:02}: {after}", unit.name);
        }
    }
}

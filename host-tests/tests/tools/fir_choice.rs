//! Length and corner of the low pass that the tables compare with are those that do best on the training drives.

use gyronet::bias::STATIC_SAMPLES;
use gyronet_host_tests::recordings;
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::evaluate::fir::LowPass;
use gyronet_tools::evaluate::heading_error::AgainstRate;

/// The training drives: none on which the rows are judged.
const TRIALS: [u32; 5] = [2, 3, 4, 6, 7];
/// Samples on either side, up to the delay of the delayed rate.
const HALVES: std::ops::RangeInclusive<usize> = 1..=7;
/// Corners, Hz.
const CORNERS: [f64; 9] = [2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0];
/// The largest lead of the best one of the grid: the grid is flat around it.
const FLAT: f64 = 1.001;

/// A drive's gyro less its static bias, and its reference, rad/s.
struct Drive {
    gyro: Vec<f64>,
    reference: Vec<f64>,
}

impl Drive {
    fn new(recording: &Recording) -> Self {
        let gyro = recording.rows.iter().map(|row| row.sample.angular_rate[2].rad_per_sec());
        let bias = gyro.clone().take(STATIC_SAMPLES as usize).sum::<f64>() / f64::from(STATIC_SAMPLES);
        let reference = recording.rows.iter().map(|row| row.reference.expect("the trials have one"));
        Self { gyro: gyro.map(|rate| rate - bias).collect(), reference: reference.collect() }
    }

    /// 1 s error of such rates behind static initialisation.
    fn error(&self, rates: &[f64]) -> f64 {
        let mut against = AgainstRate::default();
        let behind = self.reference.iter().zip(rates).skip(STATIC_SAMPLES as usize);
        behind.for_each(|(truth, rate)| against.add(*rate, *truth));
        against.errors().and_then(|errors| errors.figures.mean_1s_rad).expect("whole seconds")
    }
}

#[test]
fn no_other_low_pass_is_better_on_the_training_drives() {
    let Some(paths) = recordings::trials(&TRIALS) else { return };
    let drives: Vec<Drive> =
        paths.iter().map(|path| Drive::new(&Recording::read(path).expect("a recording"))).collect();
    let ratio = |filter: &LowPass| {
        let ratios =
            drives.iter().map(|drive| drive.error(&filter.filter(&drive.gyro)) / drive.error(&drive.gyro));
        ratios.sum::<f64>() / drives.len() as f64
    };
    let grid = HALVES.flat_map(|half| CORNERS.map(|corner| (half, corner)));
    let (best, half, corner) = grid
        .map(|(half, corner)| (ratio(&LowPass::new(half, corner)), half, corner))
        .min_by(|(a, ..), (b, ..)| a.total_cmp(b))
        .expect("a grid");
    let chosen = ratio(&LowPass::chosen());
    println!(
        "1 s error over static initialisation's, mean of 02 03 04 06 07: {chosen:.4}; best of the grid {best:.4}, {} \
         taps, {corner} Hz",
        2 * half + 1
    );
    assert!(chosen <= best * FLAT, "{chosen:.4}, the best is {best:.4}");
    assert!(chosen < 1.0, "{chosen:.4}: it gains nothing");
}

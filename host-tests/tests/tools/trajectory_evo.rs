//! The trajectory error against evo itself, the program that the paper used: its results for three pairs of paths stand
//! here as numbers, so that no machine needs it.

use gyronet_host_tests::noise::Noise;
use gyronet_tools::drive::track::Track;
use gyronet_tools::evaluate::trajectory_error::{Point, TrajectoryError};

/// Rmse, mean, and both after alignment without scale, m: evo 1.38.1 (`APE`, translation part; `align`) for the paths
/// of seeds 0 to 2.
const EVO: [[f64; 4]; 3] = [
    [31.267_143_607_106_842, 25.472_743_218_721_153, 9.179_933_643_931_616, 8.208_198_292_481_514],
    [25.373_624_426_876_05, 20.316_676_141_206_962, 7.805_004_407_353_264, 6.724_025_721_223_064_5],
    [25.431_534_545_339_26, 19.138_112_414_819_357, 10.654_575_137_962_013, 8.800_297_577_178_778],
];

/// Returns a drive of ten minutes by dead reckoning with a bad gyro, and as it is.
fn paths(seed: u64) -> (Vec<Point>, Vec<Point>) {
    let mut noise = Noise::new(seed);
    let (mut good, mut bad, mut rate) = (Track::default(), Track::default(), 0.0);
    (0..6_000)
        .map(|_| {
            rate = 0.98 * rate + 0.02 * noise.normal();
            good.step([1.0; 2], 0.1 * rate);
            bad.step([1.01; 2], 0.1 * rate + 1e-5 + 1e-5 * noise.normal());
            (bad.position, good.position)
        })
        .unzip()
}

#[test]
fn trajectory_errors_equal_those_of_evo() {
    for (seed, evo) in (0..).zip(EVO) {
        let (estimate, truth) = paths(seed);
        let raw = TrajectoryError::new(&estimate, &truth).expect("points");
        let aligned = TrajectoryError::aligned(&estimate, &truth).expect("points");
        let ours = [raw.rmse_m, raw.mean_m, aligned.rmse_m, aligned.mean_m];
        assert!(ours[0] > 2.0 * ours[2], "there is something to align");
        for (ours, evo) in ours.into_iter().zip(evo) {
            assert!((ours - evo).abs() < 1e-9, "seed {seed}: {ours} {evo}");
        }
    }
}

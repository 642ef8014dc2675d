//! The default model's mounting is the training car's: it stays on that car's drives, and goes out on simulated vehicles,
//! whose units are mounted otherwise. There the delayed rate is then better, on average, than static initialisation
//! and zero-rate updates alone.

use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Blob, Estimate, GyroNet, WindowNetwork, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet_host_tests::{parallel, recordings};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::drive::wheel_frames::WheelFrames;
use gyronet_tools::evaluate::metrics::YawError;
use gyronet_tools::simulate::{Config, csv};

/// All drives of the training car that have wheel speeds.
const TRIALS: [u32; 8] = [2, 3, 4, 6, 7, 8, 9, 11];
/// Simulated vehicles: their mean decides, since the bias of one standstill is a drive's own luck.
const SEEDS: std::ops::Range<u64> = 101..149;

struct Nothing;

impl WindowNetwork for Nothing {
    fn estimate(&mut self, _window: &[Features; WINDOW]) -> Estimate {
        Estimate::NONE
    }
}

/// Runs a drive; returns how often the mounting went out, and the 1 s error of the delayed rate, rad.
fn run(recording: &Recording, network: &mut impl WindowNetwork) -> (u32, f64) {
    let wheels = WheelFrames::new(recording);
    let drive = Replay::run(recording, &PipelineConfig::DEFAULT, wheels, network).expect("it stands first");
    let rates: Vec<f64> = drive.delayed().map(|rate| rate.rate.rad_per_sec()).collect();
    let steps = &drive.steps[drive.compared()];
    let reference: Vec<f64> =
        steps.iter().map(|step| recording.rows[step.row].reference.expect("it has one")).collect();
    let error = YawError::new(&rates, &reference).expect("a whole second").mean_1s_rad;
    (drive.counters.foreign_mountings, error)
}

fn default_model() -> GyroNet<'static> {
    GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).expect("it comes with the library"))
}

#[test]
fn the_training_car_keeps_its_mounting() {
    let test = "the_training_car_keeps_its_mounting";
    let drives: Vec<_> = TRIALS.iter().filter_map(|trial| recordings::trial(test, *trial)).collect();
    for (path, found) in drives.iter().zip(parallel::map(&drives, |path| {
        run(&Recording::read(path).expect("a recording"), &mut default_model()).0
    })) {
        assert_eq!(found, 0, "{}", path.display());
    }
}

#[test]
fn simulated_vehicles_lose_it_and_gain_on_average() {
    let seeds: Vec<u64> = SEEDS.collect();
    let ran = parallel::map(&seeds, |seed| {
        let mut bytes = Vec::new();
        csv::write(&Config { seed: *seed, ..Config::DEFAULT }, &mut bytes).expect("memory");
        let recording = Recording::parse("simulated.csv", &bytes[..]).expect("a drive");
        (run(&recording, &mut default_model()), run(&recording, &mut Nothing))
    });
    let (mut default, mut without, mut worse) = (0.0, 0.0, 0);
    for (seed, ((found, with), (_, alone))) in SEEDS.zip(ran) {
        assert_eq!(found, 1, "seed {seed}");
        default += with;
        without += alone;
        worse += u32::from(with > alone);
    }
    println!(
        "1 s error {:.3} of that without a correction, {worse} of {} worse",
        default / without,
        seeds.len()
    );
    assert!(default < without, "{default} rad, {without} rad without a correction");
}

//! Real drives that training has not seen: the README's ratios to static initialisation, drive by drive, and what
//! quantisation costs, the integer network against the f32 one in its output and in the yaw that comes of it.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet_host_tests::{parallel, recordings};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::evaluate::methods::{Method, PerMethod};
use gyronet_tools::evaluate::rates::{Network, Networks, Rates};
use gyronet_tools::evaluate::report::{Comparisons, DriveErrors};
use gyronet_tools::network::quantization_error::{Both, QuantizationError};
use std::path::Path;
use std::sync::OnceLock;

/// The test trials.
const TRIALS: [u32; 2] = [9, 11];
/// Largest departure of the integer network's 1 s yaw error from the f32 network's.
const YAW_ERROR: f64 = 0.03;
/// Largest RMS of the difference of outputs, over the f32 output's own RMS.
const OUTPUT: f64 = 0.02;
/// The largest such difference of the scale of the expected error.
const SCALE: f64 = 0.02;

/// 1 s yaw error over that of static initialisation, trials 09 and 11, by `cargo gyronet evaluate`: the README's rows
/// of what is sent. A change for the worse by more than [`WORSE`] fails, and one for the better is worth a new number.
const HEADLINE: [(Method, [f64; 2]); 3] = [
    (Method::PROMPT, [0.951, 0.715]),
    (Method::NAVIGATION, [0.670, 0.516]),
    (Method::LINEAR, [0.649, 0.551]),
];
/// The README's ratio of the rate for navigation to the best classical method, drive by drive.
const OVER_BEST_CLASSICAL: [f64; 2] = [0.81, 0.58];
const WORSE: f64 = 0.05;

/// The results of one trial that both tests look at.
struct Trial {
    number: u32,
    /// Mean yaw errors of a second, rad.
    errors: PerMethod<f64>,
    ours: Comparisons,
    quantization: QuantizationError,
}

impl Trial {
    fn new(number: u32, path: &Path) -> Self {
        let checkpoint = gyronet_tools::bundled::checkpoint().expect("the committed checkpoint");
        let recording = Recording::read(path).expect("a recording");
        let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
        let (mut integer, mut float, mut beside) =
            (GyroNet::new(blob), checkpoint.network(), checkpoint.network());
        let mut both = Both::new(&mut integer, &mut beside);
        let blob = Blob::new_checked(&weights::LINEAR_WINDOW.0).expect("they come with the library");
        let mut linear = GyroNet::new(blob);
        let of_linear = linear.blob().shape;
        let mut networks = Networks {
            float: Network::new(&mut float, checkpoint.shape()),
            integer: Network::new(&mut both, checkpoint.shape()),
            linear: Network::new(&mut linear, of_linear),
            sent: None,
        };
        let rates = Rates::new(&recording, &mut networks, || {}).expect("it stands still first");
        let drive = DriveErrors::new(&recording, &rates).expect("the trials have a reference");
        let errors = drive.methods.map(|row| row.error.mean_1s_rad.expect("whole seconds"));
        let ours = drive.over_best_classical.expect("whole seconds");
        Self { number, errors, ours, quantization: both.error() }
    }
}

/// The trials, run once for both tests; `None` without the recordings.
fn trials(test: &str) -> Option<&'static [Trial]> {
    static RUN: OnceLock<Vec<Trial>> = OnceLock::new();
    let paths = TRIALS.map(|trial| recordings::trial(test, trial));
    let [Some(first), Some(second)] = paths else { return None };
    let drives: Vec<_> = TRIALS.into_iter().zip([first, second]).collect();
    Some(RUN.get_or_init(|| parallel::map(&drives, |(trial, path)| Trial::new(*trial, path))))
}

#[test]
fn rates_are_as_good_as_the_readme_says() {
    let Some(trials) = trials("rates_are_as_good_as_the_readme_says") else { return };
    for (drive, Trial { number, errors, ours, .. }) in trials.iter().enumerate() {
        for (method, readme) in HEADLINE {
            let (ratio, due) = (errors[method] / errors[Method::STATIC], readme[drive]);
            println!("trial {number:02}, {method:?}: {ratio:.3} of static, the README says {due:.3}");
            assert!(ratio <= due * (1.0 + WORSE), "trial {number:02}, {method:?}: {ratio:.3}, not {due:.3}");
        }
        let (ratio, due) = (ours.default.ratio, OVER_BEST_CLASSICAL[drive]);
        println!("trial {number:02}: {ours}; the README says {due:.2}");
        assert!(
            ratio <= due * (1.0 + WORSE),
            "trial {number:02}: {ratio:.3} of the best classical, not {due:.3}"
        );
    }
}

#[test]
fn the_integer_network_is_as_good_as_f32_on_real_drives() {
    let Some(trials) = trials("the_integer_network_is_as_good_as_f32_on_real_drives") else { return };
    for Trial { number, errors, quantization, .. } in trials {
        let ratio = errors[Method::GYRONET_INT] / errors[Method::GYRONET_F32];
        println!("trial {number:02}: 1 s error {ratio:.4} times that of f32; {quantization:?}");
        assert!(
            (ratio - 1.0).abs() <= YAW_ERROR,
            "trial {number:02}: 1 s yaw errors differ by more than 3 %"
        );
        assert!(
            quantization.relative_rms() <= OUTPUT,
            "trial {number:02}: outputs differ by more than 2 % RMS"
        );
        assert!(quantization.scale_rms() <= SCALE, "trial {number:02}: scales differ by more than 2 % RMS");
        assert_eq!(quantization.clamped_inputs, 0, "trial {number:02}: inputs were clamped");
        assert!(quantization.windows > 2_000, "trial {number:02}: too few windows were run");
    }
}

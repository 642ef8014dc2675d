//! Real drives that training has not seen: the README's ratios to static initialisation, drive by drive, and what
//! quantisation costs, the integer network against the f32 one in its output and in the yaw that comes of it.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet_host_tests::{parallel, recordings};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::evaluate::methods::{Method, Rates};
use gyronet_tools::evaluate::metrics::YawError;
use gyronet_tools::network::quantization_error::Both;
use std::path::Path;

/// The test trials.
const TRIALS: [u32; 2] = [9, 11];
/// Largest departure of the integer network's 1 s yaw error from the f32 network's.
const YAW_ERROR: f64 = 0.03;
/// Largest RMS of the difference of outputs, over the f32 output's own RMS.
const OUTPUT: f64 = 0.02;
/// The largest such difference of the scale of the expected error.
const SCALE: f64 = 0.02;

/// 1 s yaw error over that of static initialisation, trials 09 and 11, by `cargo gyronet evaluate`: the README's rows of
/// what is sent. A change for the worse by more than [`WORSE`] fails, and one for the better is worth a new number.
const HEADLINE: [(Method, [f64; 2]); 2] =
    [(Method::PROMPT, [1.100, 0.687]), (Method::NAVIGATION, [0.688, 0.487])];
const WORSE: f64 = 0.05;

#[test]
fn rates_are_as_good_as_the_readme_says() {
    let paths = TRIALS.map(|trial| recordings::trial("rates_are_as_good_as_the_readme_says", trial));
    let [Some(first), Some(second)] = paths else { return };
    let drives = [(0, first), (1, second)];
    let heading = "trial   method    1 s to static   README";
    parallel::table(heading, &drives, |(drive, path)| {
        let recording = Recording::read(path).expect("a recording");
        let checkpoint = gyronet_tools::bundled::checkpoint().expect("the committed checkpoint");
        let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
        let (mut integer, mut float) = (GyroNet::new(blob), checkpoint.network());
        let rates = Rates::new(&recording, &mut float, &mut integer, || {}).expect("it stands still first");
        let reference = rates.reference.as_ref().expect("the trials have a reference");
        let errors =
            rates.rates.map(|rates| YawError::new(rates, reference).expect("whole seconds").mean_1s_rad);
        let (mut rows, mut failures) = (String::new(), Vec::new());
        for (method, readme) in HEADLINE {
            let (ratio, due) = (errors[method] / errors[Method::STATIC], readme[*drive]);
            let trial = TRIALS[*drive];
            rows += &format!("{trial:02}      {method:?}   {ratio:.3}   {due:.3}\n");
            if ratio > due * (1.0 + WORSE) {
                failures.push(format!(
                    "trial {trial:02}, {method:?}: {ratio:.3} of static, the README says {due:.3}"
                ));
            }
        }
        (rows, failures)
    });
}

/// Returns a line of the table, and what does not hold.
fn judge(trial: u32, path: &Path) -> (String, Vec<String>) {
    let checkpoint = gyronet_tools::bundled::checkpoint().expect("the committed checkpoint");
    let recording = Recording::read(path).expect("a recording");
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let (mut integer, mut float, mut beside) =
        (GyroNet::new(blob), checkpoint.network(), checkpoint.network());
    let mut both = Both::new(&mut integer, &mut beside);
    let rates = Rates::new(&recording, &mut float, &mut both, || {}).expect("it stands still first");
    let reference = rates.reference.as_ref().expect("the trials have a reference");
    let errors = rates.rates.map(|rates| YawError::new(rates, reference).expect("whole seconds").mean_1s_rad);
    let ratio = errors[Method::GYRONET_INT] / errors[Method::GYRONET_F32];
    let difference = both.error();
    let row = format!(
        "{trial:02}      {:.6}  {:.6}  {:.6}  {ratio:.4}      {:.4}     {:.4}   {:6}  {:7}\n",
        errors[Method::STATIC],
        errors[Method::GYRONET_F32],
        errors[Method::GYRONET_INT],
        difference.relative_rms(),
        difference.scale_rms(),
        difference.windows,
        difference.clamped_inputs,
    );
    let mut failures = Vec::new();
    let mut must =
        |holds: bool, what: &str| failures.extend((!holds).then(|| format!("trial {trial:02}: {what}")));
    must((ratio - 1.0).abs() <= YAW_ERROR, "1 s yaw errors differ by more than 3 %");
    must(difference.relative_rms() <= OUTPUT, "outputs differ by more than 2 % RMS");
    must(difference.scale_rms() <= SCALE, "scales differ by more than 2 % RMS");
    must(difference.clamped_inputs == 0, "inputs were clamped");
    must(difference.windows > 2_000, "too few windows were run");
    (row, failures)
}

#[test]
fn the_integer_network_is_as_good_as_f32_on_real_drives() {
    let paths =
        TRIALS.map(|trial| recordings::trial("the_integer_network_is_as_good_as_f32_on_real_drives", trial));
    let [Some(_), Some(_)] = paths else { return };
    let drives: Vec<_> = TRIALS.into_iter().zip(paths.into_iter().flatten()).collect();
    let heading = "trial      static   1 s f32  1 s int    ratio  output RMS  scale RMS  windows  clamped";
    parallel::table(heading, &drives, |(trial, path)| judge(*trial, path));
}

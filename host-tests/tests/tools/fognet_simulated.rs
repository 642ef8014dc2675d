//! FoGNet behind the board, on simulated sequences that training has not seen: on its own gyro it must make the turns of
//! minutes better, on another one it must not run. The figures of whole sequences are a report: `cargo paper tables`.

use gyronet::model::fognet::FogNetState;
use gyronet::model::{FogBlob, FogNet, weights};
use gyronet_host_tests::sequence::simulate;
use gyronet_paper::fog_replay::{after_base, check_weights, run};
use gyronet_paper::sequence::Sequence;
use gyronet_paper::simulate::Spec;

const SECONDS: u32 = 10 * 60;
/// Runs of the gyro that FoGNet was trained for; none of them is in a set.
const RUNS: std::ops::Range<u64> = 501..503;
/// Largest mean error of the turn in a minute with FoGNet, over that without a network.
const RATIO: f64 = 0.9;

fn simulated(device: u64, run: u64) -> Sequence {
    simulate(&Spec { name: "made".into(), seconds: SECONDS, device, run })
}

/// The sum over a drive's minutes of the error of each one's turn, rad.
fn error_of_minutes(sequence: &Sequence, turns: impl Iterator<Item = f64>) -> f64 {
    let error: Vec<f64> = turns.zip(sequence.turns()).map(|(by, turn)| by - turn).collect();
    error.chunks_exact(6_000).map(|minute| minute.iter().sum::<f64>().abs()).sum()
}

#[test]
fn fognet_makes_the_turns_of_minutes_better() {
    let mut state = FogNetState::ZERO;
    let mut network = FogNet::new(FogBlob::new_checked(&weights::FOGNET.0).expect("checked"), &mut state);
    let mut errors = [0.0; 2];
    for number in RUNS {
        let sequence = simulated(1, number);
        let base = after_base(&sequence);
        let fognet = run(&base, &mut network);
        let seconds = u64::from(SECONDS);
        assert!((seconds - 5..=seconds).contains(&fognet.windows) && fognet.implausible == 0, "{fognet:?}");
        errors[0] += error_of_minutes(&sequence, base.steps.iter().map(|step| step.fog));
        errors[1] += error_of_minutes(&sequence, fognet.turns.iter().copied());
    }
    let [default, fognet] = errors;
    println!("sum of the minutes' errors: {default:.6} rad by default, {fognet:.6} rad with FoGNet");
    assert!(fognet <= RATIO * default, "{fognet} of {default} rad");
}

#[test]
fn fognet_does_not_run_on_another_gyro() {
    let trained = FogBlob::new_checked(&weights::FOGNET.0).expect("checked").training;
    let refused = check_weights(&simulated(2, 504), trained).expect_err("device 2");
    assert!(refused.ends_with("number 2"), "{refused}");
}

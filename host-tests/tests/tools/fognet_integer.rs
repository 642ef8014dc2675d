//! The integer FoGNet against the f32 one on the golden windows, in the part of the correction that is not
//! linear in the gyro's turns: the linear one is exact, and so large that it hides the other.

use gyronet::model::fognet::{FogNetState, MinuteNetwork};
use gyronet::model::fognet_blob::INPUTS;
use gyronet::model::seconds::{Minute, STEPS, Second};
use gyronet::model::{FogBlob, FogNet, weights};
use gyronet::units::{Angle, AngularRate, SpecificForce, WheelSpeed};
use gyronet_host_tests::golden::{Golden, WINDOWS};
use gyronet_host_tests::recordings::workspace;
use gyronet_tools::network::checkpoint::{self, Checkpoint};
use gyronet_tools::network::reference::fognet::FogNetF32;

/// Features in m/s^2, rad/s, m and rad.
type Window = [[f32; INPUTS]; STEPS];

/// RMS of integer less f32, of the spread between the windows. An input that is missing makes it 1.
const WINDOW: f64 = 0.03;
/// The largest such difference of what an input moves, and of what rounding makes of an input that hardly counts, rad.
const INPUT: f64 = 0.3;
const ROUNDING: f64 = 2.5e-7;

fn windows() -> Vec<Window> {
    let input = Golden::read("fognet").tensor("input", &[WINDOWS, STEPS, INPUTS]);
    input.as_chunks::<INPUTS>().0.as_chunks::<STEPS>().0.to_vec()
}

fn minute(window: &Window) -> Minute {
    let mut minute = Minute::EMPTY;
    for [fx, fy, fz, rx, ry, rz, left, right, turn] in *window {
        let force = [fx, fy, fz].map(|force| SpecificForce::from_metre_per_sec2(force).expect("in range").0);
        let rate = [rx, ry, rz].map(|rate| AngularRate::from_rad_per_sec(rate).expect("in range").0);
        let way = [left, right].map(|way| (way * (1u32 << WheelSpeed::FRACTION_BITS) as f32) as i32);
        let features = [force.as_slice(), &rate, &way].concat().try_into().expect("eight of them");
        minute.add(Second { features, turn: Angle::from_rad(turn).expect("in range") });
    }
    minute
}

/// The part of a correction that is not linear, by both networks, rad.
fn bent(integer: &mut FogNet<'_, '_>, float: &mut FogNetF32<'_>, window: &Window) -> [f64; 2] {
    let minute = minute(window);
    let window = minute.window().expect("a minute");
    [integer.estimate(&window), float.estimate(&window)]
        .map(|estimate| estimate.correction.rad() - estimate.linear.rad())
}

pub fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    (values.clone().map(|value| value * value).sum::<f64>() / values.count() as f64).sqrt()
}

#[test]
fn every_input_counts_as_in_f32() {
    let file = workspace().join("tools/weights/fognet.safetensors");
    let checkpoint = Checkpoint::<checkpoint::FogNet>::read(&file).expect("the committed checkpoint");
    let mut float = checkpoint.network();
    let mut state = FogNetState::ZERO;
    let mut integer = FogNet::new(FogBlob::new_checked(&weights::FOGNET.0).expect("checked"), &mut state);
    let windows = windows();
    let base: Vec<_> = windows.iter().map(|window| bent(&mut integer, &mut float, window)).collect();
    let mean = base.iter().map(|[_, theirs]| theirs).sum::<f64>() / base.len() as f64;
    let between = rms(base.iter().map(|[_, theirs]| theirs - mean));
    let difference = rms(base.iter().map(|[ours, theirs]| ours - theirs));
    println!("windows: {between:.2e} rad apart, networks {:.2} % of that", 100.0 * difference / between);
    assert!(difference <= WINDOW * between);
    let spread = float.input_std;
    for input in 0..INPUTS {
        let moves: Vec<[f64; 2]> = windows
            .iter()
            .zip(&base)
            .map(|(window, base)| {
                let mut window = *window;
                for (step, features) in window.iter_mut().enumerate() {
                    // Not in all steps alike: what stands in the wrong row must show, too.
                    features[input] += spread[input] * if step % 4 < 2 { 1.0 } else { -0.5 };
                }
                let moved = bent(&mut integer, &mut float, &window);
                [moved[0] - base[0], moved[1] - base[1]]
            })
            .collect();
        let difference = rms(moves.iter().map(|[ours, theirs]| ours - theirs));
        let size = rms(moves.iter().map(|[_, theirs]| *theirs));
        println!("input {input}: moves {size:.2e} rad, differs by {:.2} %", 100.0 * difference / size);
        assert!(difference <= INPUT * size + ROUNDING, "input {input}");
    }
}

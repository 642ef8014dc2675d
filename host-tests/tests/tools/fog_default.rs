//! The corrections of a fibre-optic gyro without a network on simulated sequences that stop now and then, each of a device of its own:
//! what standstills add to the Earth's rate, and whether the expected errors are as large as the true ones.

use gyronet_host_tests::sequence::{path_error, simulate};
use gyronet_paper::fog_replay::run_board;
use gyronet_paper::simulate::fog::{self, Fog};
use gyronet_paper::simulate::vehicles::FOG;
use gyronet_paper::simulate::world::EARTH_RATE;
use gyronet_paper::simulate::{Set, Spec};

/// One device says little: its scale, 200 ppm, makes as much of a drive's net turn as its bias.
const DEVICES: u64 = 16;
/// 1 rad/s in deg/h.
const DEG_PER_HOUR: f64 = 206_264.8;

#[derive(Default)]
struct Errors {
    /// Sums of the path errors, m.
    by_earth: f64,
    by_default: f64,
    /// Less the Earth's rate and the bias that the simulation gave the device.
    by_truth: f64,
    /// Sum of the squares of what the bias is off at the end, (deg/h)^2.
    off: f64,
    drives: usize,
    inside: usize,
    seconds: usize,
}

impl Errors {
    fn of_devices() -> Self {
        let mut errors = Self::default();
        for number in 0..DEVICES {
            let base = Set::Transfer.specs().swap_remove(0);
            let name = format!("device{number}");
            errors.add(&Spec { device: 900 + number, run: 400 + number, name, ..base });
        }
        let Self { by_earth, by_default, by_truth, drives, .. } = errors;
        println!(
            "{drives} devices: {:.3} of the error by the Earth's rate ({:.3} with the true bias), bias off by \
             {:.3} deg/h, {:.3} of the seconds inside one sigma",
            by_default / by_earth,
            by_truth / by_earth,
            errors.bias_off(),
            errors.share_inside(),
        );
        errors
    }

    fn bias_off(&self) -> f64 {
        (self.off / self.drives as f64).sqrt()
    }

    fn share_inside(&self) -> f64 {
        self.inside as f64 / self.seconds as f64
    }

    fn add(&mut self, spec: &Spec) {
        let sequence = simulate(spec);
        let sent = run_board(&sequence);
        let quiet = fog::Config { angle_walk: 0.0, ..FOG };
        let [.., bias] = Fog::of_device(&quiet, spec.device, spec.run).increment([0.0; 3], 1.0);
        let earth = EARTH_RATE * sequence.latitude_deg().to_radians().sin();
        let less =
            |rate: f64| path_error(&sequence, sequence.steps.iter().map(|step| step.fog - 0.01 * rate));
        self.by_earth += less(earth);
        self.by_truth += less(earth + bias);
        self.by_default += path_error(&sequence, sent.iter().map(|sent| 0.01 * sent.rate.rad_per_sec()));
        // The last steps are not over when the sequence ends.
        let reading = sent[sent.len() - 10].correction.rad_per_sec() - earth;
        self.off += ((reading - bias) * DEG_PER_HOUR).powi(2);
        self.drives += 1;
        let turns = sequence.turns();
        for (sent, turns) in sent.chunks_exact(100).zip(turns.chunks_exact(100)) {
            let sigma: Option<Vec<f64>> = sent.iter().map(|sent| Some(sent.sigma?.rad_per_sec())).collect();
            let Some(sigma) = sigma else { continue };
            let rate = sent.iter().map(|sent| 0.01 * sent.rate.rad_per_sec()).sum::<f64>();
            let is_inside = (rate - turns.iter().sum::<f64>()).abs() <= sigma.iter().sum::<f64>() / 100.0;
            self.inside += usize::from(is_inside);
            self.seconds += 1;
        }
    }
}

/// The bias walks by 0.03 deg/h on the way, five minutes of standing show 0.04, and the street's tilt adds to it.
#[test]
fn standstills_find_the_bias_of_a_dsp_1760() {
    let errors = Errors::of_devices();
    assert!(errors.bias_off() <= 0.12);
    assert!(errors.by_default <= 1.05 * errors.by_earth && errors.by_default <= 1.1 * errors.by_truth);
    assert!((0.60..=0.75).contains(&errors.share_inside()));
}

//! The default lane of a fibre-optic gyro on simulated sequences that stop now and then, of devices that training has
//! seen and has not: what standstills add to the Earth's rate, and whether the expected errors are as large as the true
//! ones.

use gyronet_host_tests::dead_reckoning::error;
use gyronet_tools::paper::fog_replay::{default_config, run_default};
use gyronet_tools::paper::sequence::Sequence;
use gyronet_tools::simulate::layout::{self, Layout, Set};
use gyronet_tools::simulate::world::EARTH_RATE;
use std::path::Path;

/// The errors of one or more drives.
#[derive(Default)]
struct Errors {
    by_earth: f64,
    by_default: f64,
    inside: usize,
    seconds: usize,
}

impl Errors {
    fn ratio(&self) -> f64 {
        self.by_default / self.by_earth
    }

    /// Adds a drive whose gyro has so much more bias, deg/h.
    fn add(&mut self, sequence: &Sequence, bias: f64) {
        let mut sequence = sequence.clone();
        for step in &mut sequence.steps {
            step.fog += 0.01 * (bias / 3600.0).to_radians();
        }
        let (sent, counters) = run_default(&sequence, default_config(&sequence));
        let earth = 0.01 * EARTH_RATE * sequence.latitude_deg().to_radians().sin();
        let by_earth = error(&sequence, sequence.steps.iter().map(|step| step.fog - earth));
        let by_default = error(&sequence, sent.iter().map(|sent| 0.01 * sent.rate.rad_per_sec()));
        let (updates, contradicted) = (counters.zero_rate_updates, counters.contradicted);
        println!(
            "{:?} {}, {bias:+.1} deg/h: {by_earth:.2} m by Earth's rate, {by_default:.2} m by default, {updates} s used, \
             {contradicted} refused",
            sequence.layout, sequence.name
        );
        (self.by_earth, self.by_default) = (self.by_earth + by_earth, self.by_default + by_default);
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

fn sequences(layout: Layout) -> impl Iterator<Item = Sequence> {
    let specs =
        [Set::Test, Set::Transfer].into_iter().flat_map(move |set| set.specs(layout).into_iter().take(2));
    specs.map(move |spec| {
        let folder =
            Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fog_default_{layout:?}_{}", spec.name));
        layout::write(&spec, &folder, || {}).expect("there is room");
        let sequence = Sequence::read(&folder, |_| {}).expect("it has just been written");
        std::fs::remove_dir_all(&folder).expect("it is ours");
        sequence
    })
}

/// On these drives the scale of the gyro, 200 to 350 ppm, makes more of the net turn than the bias does, and a bias can
/// hide it: both devices have 0.1 deg/h by chance. 0.5 deg/h is what the data sheet allows. The limits guard what was
/// measured, 1.15 and 0.95.
#[test]
fn a_small_bias_is_not_what_limits_dead_reckoning() {
    let (mut own, mut allowed) = (Errors::default(), Errors::default());
    for sequence in sequences(Layout::Kaist) {
        own.add(&sequence, 0.0);
        allowed.add(&sequence, 0.5);
        allowed.add(&sequence, -0.5);
    }
    let inside = own.inside as f64 / own.seconds as f64;
    println!(
        "of the error by Earth's rate: {:.2}, with the bias of the data sheet {:.2}; {inside:.3} of {} seconds inside \
         one sigma",
        own.ratio(),
        allowed.ratio(),
        own.seconds
    );
    assert!(own.ratio() <= 1.2 && allowed.ratio() <= 1.0);
    assert!((0.60..=0.75).contains(&inside));
}

#[test]
fn standstills_help_a_gyro_of_a_larger_bias() {
    let mut own = Errors::default();
    sequences(Layout::Nclt).for_each(|sequence| own.add(&sequence, 0.0));
    println!("of the error by Earth's rate: {:.2}", own.ratio());
    assert!(own.ratio() <= 0.8);
}

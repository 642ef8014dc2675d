//! FoGNet on the simulated test set, four sequences of twenty minutes that training has not seen:
//! what quantisation costs, and what its corrections are worth on the road.

use gyronet::fog::FogConfig;
use gyronet::fog::seconds::{Padding, SecondsWindow};
use gyronet::model::fognet::{FogEstimate, FogNetState, MinuteNetwork};
use gyronet::model::{FogBlob, FogNet, weights};
use gyronet::odometry::Track;
use gyronet_host_tests::parallel;
use gyronet_tools::evaluate::trajectory_error::TrajectoryError;
use gyronet_tools::network::quantization_error::Both;
use gyronet_tools::paper::fog_replay::{self, FogReplay};
use gyronet_tools::paper::sequence::Sequence;
use gyronet_tools::simulate::layout::{self, Layout, Set};
use gyronet_tools::simulate::world::EARTH_RATE;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Largest RMS of integer less f32 correction, over the f32 correction's own RMS. Nearly all of it is the
/// linear part, which is exact.
const QUANTIZATION: f64 = 0.000_5;
/// Mean ATE with FoGNet over that with the gyro alone.
const ATE_RATIO: f64 = 0.6;
/// One window in so many goes through f32 too.
const EVERY: u64 = 20;

/// The integer network, which does not run a window twice: without padding most are the same.
struct Remembering<'n, 'w, 's> {
    network: &'n mut FogNet<'w, 's>,
    known: HashMap<u64, FogEstimate>,
}

impl MinuteNetwork for Remembering<'_, '_, '_> {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        let mut hasher = DefaultHasher::new();
        window.iter().for_each(|second| (second.features, second.turn.0).hash(&mut hasher));
        *self.known.entry(hasher.finish()).or_insert_with(|| self.network.estimate(window))
    }
}

/// Passes every so many windows on.
struct Sampled<N> {
    network: N,
    windows: u64,
}

impl<N: MinuteNetwork> MinuteNetwork for Sampled<N> {
    fn estimate(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        self.windows += 1;
        if self.windows.is_multiple_of(EVERY) {
            self.network.estimate(window)
        } else {
            FogEstimate {
                correction: gyronet::units::Angle::ZERO,
                linear: gyronet::units::Angle::ZERO,
                gain: 0,
                clamped_inputs: 0,
            }
        }
    }
}

/// ATE, rmse, of dead reckoning with these turns, m.
fn ate(sequence: &Sequence, turns: impl Iterator<Item = f64>) -> f64 {
    let yaw = sequence.steps.first().expect("it has steps").yaw;
    let mut track = Track { yaw, ..Track::default() };
    let estimate: Vec<_> = sequence
        .steps
        .iter()
        .zip(turns)
        .map(|(step, turn)| {
            track.step(step.wheels, turn);
            track.position
        })
        .collect();
    let truth: Vec<_> = sequence.steps.iter().map(|step| step.position).collect();
    TrajectoryError::new(&estimate, &truth).expect("as many of both").rmse_m
}

fn simulated(name: &str) -> Vec<Sequence> {
    let folder = std::env::temp_dir().join(format!("gyronet-{name}-{}", std::process::id()));
    let sequences = Set::Test
        .specs(Layout::Kaist)
        .iter()
        .map(|spec| {
            let folder = folder.join(&spec.name);
            layout::write(spec, &folder, || {}).expect("there is room");
            Sequence::read(&folder, |_| {}).expect("it has just been written")
        })
        .collect();
    let _ = std::fs::remove_dir_all(&folder);
    sequences
}

/// What comes of a sequence: ATE, a line of the table, and what does not hold.
fn judge(sequence: &Sequence) -> ([f64; 5], String, Vec<String>) {
    let checkpoint = gyronet_tools::bundled::fog_checkpoint().expect("the committed checkpoint");
    let blob = FogBlob::new_checked(&weights::FOGNET.0).expect("they come with the library");
    let mut state = FogNetState::ZERO;
    let mut network = FogNet::new(blob, &mut state);
    let mut known = Remembering { network: &mut network, known: HashMap::new() };
    let mut drive = |padding| -> FogReplay {
        let config = FogConfig { padding, ..FogConfig::DEFAULT };
        fog_replay::run(sequence, &mut known, config, || {})
    };
    let [repeat, edge, none] = [Padding::Repeat, Padding::Edge, Padding::None].map(&mut drive);
    let earth = EARTH_RATE * sequence.latitude_deg().to_radians().sin() / 100.0;
    let ates = [
        ate(sequence, sequence.steps.iter().map(|step| step.fog)),
        ate(sequence, sequence.steps.iter().map(|step| step.fog - earth)),
        ate(sequence, repeat.turns.iter().copied()),
        ate(sequence, edge.turns.iter().copied()),
        ate(sequence, none.turns.iter().copied()),
    ];
    let (mut integer, mut reference) =
        (Sampled { network: known, windows: 0 }, Sampled { network: checkpoint.network(), windows: 0 });
    let mut both = Both::new(&mut integer, &mut reference);
    fog_replay::run(sequence, &mut both, FogConfig::DEFAULT, || {});
    let error = both.error();
    let [fog, fog_earth, fognet, fognet_edge, fognet_nopad] = ates;
    let row = format!(
        "{} {fog:6.2}  {fog_earth:9.2}  {fognet:6.2}  {fognet_edge:11.2}  {fognet_nopad:12.2}  {:11.3} %\n",
        sequence.name,
        100.0 * error.relative_rms()
    );
    let mut failures = Vec::new();
    let mut must =
        |holds: bool, what: &str| failures.extend((!holds).then(|| format!("{}: {what}", sequence.name)));
    must(error.relative_rms() > 0.0, "nothing was compared");
    must(error.relative_rms() <= QUANTIZATION, "integer and f32 differ");
    must(repeat.windows > 1_100 && none.windows + 59 == repeat.windows, "a window each second");
    must(repeat.implausible + repeat.broken + repeat.clamped_inputs == 0, "a clean drive");
    (ates, row, failures)
}

#[test]
fn corrections_on_the_road() {
    let mut table =
        String::from("ATE, m   fog  fog_earth  fognet  fognet_edge  fognet_nopad  quantisation\n");
    let (mut ates, mut failures) = (Vec::new(), Vec::new());
    for (ate, row, failed) in parallel::map(&simulated("fognet"), judge) {
        ates.push(ate);
        table += &row;
        failures.extend(failed);
    }
    let mean = |column: usize| ates.iter().map(|ates| ates[column]).sum::<f64>() / ates.len() as f64;
    table += &format!(
        "mean   {:6.2}  {:9.2}  {:6.2}  {:11.2}  {:12.2}\n",
        mean(0),
        mean(1),
        mean(2),
        mean(3),
        mean(4)
    );
    println!("simulated KAIST-like test set\n{table}");
    assert!(failures.is_empty(), "{failures:?}\n{table}");
    assert!(mean(2) <= ATE_RATIO * mean(0), "{table}");
    let better = ates.iter().filter(|ates| ates[2] < ates[1]).count();
    assert!(2 * better > ates.len(), "better than the gyro less Earth's rate in {better} only\n{table}");
    assert!(mean(2) < mean(4), "padding must help\n{table}");
}

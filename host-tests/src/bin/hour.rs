//! An hour without GNSS after ten minutes with it, on simulated drives along streets with short stops: the error of the
//! heading after each ten minutes of it, and how far that moves the end of each kilometre.
//!
//! The simulated receiver is lost in the last minute of every five, so the newest course is a minute old. Ideal filters, by
//! standstills alone, stand beside: they know the simulation's noise and walk of the bias, and see each standstill from its first
//! sample to its last. One expects, as the board does, that the bias at rest differs from that in motion as much as on recorded
//! drives; the other knows that on simulated ones it does not.

use gyronet::bias::ZeroRateConfig;
use gyronet::can;
use gyronet::coprocessor;
use gyronet::model::GyroNet;
use gyronet::sample::RATE_HZ;
use gyronet_host_tests::parallel;
use gyronet_tools::board::{Board, Step};
use gyronet_tools::drive::DT;
use gyronet_tools::drive::recording::Row;
use gyronet_tools::drive::stream::Recording;
use gyronet_tools::simulate::{Config, Sample, Simulation, csv, gnss, mems};

/// Seeds of the drives, on which nothing was chosen.
const SEEDS: std::ops::RangeInclusive<u64> = 601..=620;
const METHODS: [&str; 4] =
    ["gyronet without courses", "gyronet", "ideal filter that expects offsets at rest", "ideal filter"];
const TEN_MINUTES: usize = 600 * RATE_HZ as usize;
/// The drive ends with some samples whose delayed rate is not known.
const SECONDS: u32 = 4_201;
const NEAR_M: f64 = 5.0;

/// Errors of the heading after ten minutes each, deg, and of the ends of kilometres, m.
type Errors = [Vec<f64>; 2];

/// Returns the errors since GNSS was lost by a method with these errors of its rate, rad/s.
fn errors(rates: &[f64], drive: &[Sample]) -> Errors {
    let off: Vec<f64> =
        rates.iter().scan(0.0, |off, error| Some(std::mem::replace(off, *off + error * DT))).collect();
    let hour = TEN_MINUTES..off.len();
    let changes =
        hour.clone().step_by(TEN_MINUTES).map(|k| Some((off.get(k + TEN_MINUTES)? - off[k]).to_degrees()));
    let mut ends = Vec::new();
    let (mut heading, mut driven, mut from, mut apart) = (0.0f64, 0.0, TEN_MINUTES, [0.0; 2]);
    for k in hour {
        let (by, turned) = (drive[k].speed * DT, heading + off[k] - off[from]);
        apart =
            [apart[0] + by * (turned.cos() - heading.cos()), apart[1] + by * (turned.sin() - heading.sin())];
        (heading, driven) = (heading + drive[k].reference[2] * DT, driven + by);
        if driven >= 1_000.0 {
            ends.push(apart[0].hypot(apart[1]));
            (driven, from, apart) = (0.0, k, [0.0; 2]);
        }
    }
    [changes.flatten().collect(), ends]
}

/// Returns the errors of the delayed rate, rad/s, of a board that gets courses until the hour begins, or none.
fn sent(drive: &Recording, gets_courses: bool) -> Vec<f64> {
    let config = coprocessor::Config { can: can::config::Config::SILENT, ..coprocessor::Config::DEFAULT };
    let network = GyroNet::shipped().expect("the built-in weights");
    let mut board = Board::new(config, drive.wheels(), network).moving(gets_courses);
    let steps = drive.rows.iter().enumerate().filter_map(|(k, row)| {
        let heading = row.heading.filter(|_| k < TEN_MINUTES);
        board.row(&Row { heading, ..*row }).expect("a start at rest")
    });
    let off = |step: Step| Some(step.delayed?.rate.rad_per_sec() - step.input.reference?);
    steps.map(|step| off(step).unwrap_or_default()).collect()
}

/// Returns the errors of a rate, rad/s, whose bias is what an ideal filter of the standstills so far shows, each with an
/// offset of this sigma, rad/s.
fn ideal(drive: &[Sample], offset: f64) -> Vec<f64> {
    let mems::Config { gyro_noise, gyro_walk, gyro_bias, .. } = mems::Config::DEFAULT;
    let (mut bias, mut variance, mut stood, mut sum) = (0.0, gyro_bias * gyro_bias, 0.0, 0.0);
    let error = |sample: &Sample| {
        let own = sample.angular_rate[2] - sample.reference[2];
        variance += gyro_walk * gyro_walk * DT;
        if sample.speed == 0.0 {
            (stood, sum) = (stood + DT, sum + own * DT);
            return 0.0;
        }
        if stood > 0.0 {
            let gain = variance / (variance + offset * offset + gyro_noise * gyro_noise / stood);
            bias += gain * (sum / stood - bias);
            variance *= 1.0 - gain;
            (stood, sum) = (0.0, 0.0);
        }
        own - bias
    };
    drive.iter().map(error).collect()
}

fn unaided(seed: u64) -> [Errors; METHODS.len()] {
    let gnss = Some(gnss::Config { latency_s: 0.5, spoofed_from_s: None });
    let config = Config { seconds: SECONDS, seed, gnss, ..Config::DEFAULT };
    let mut text = Vec::new();
    csv::write(&config, &mut text).expect("a vector");
    let recording = Recording::parse("hour.csv", &text[..]).expect("a drive that begins at rest");
    let drive: Vec<Sample> = Simulation::new(&config).take(recording.rows.len()).collect();
    let offset = f64::from(ZeroRateConfig::DEFAULT.standstill);
    [sent(&recording, false), sent(&recording, true), ideal(&drive, offset), ideal(&drive, 0.0)]
        .map(|rates| errors(&rates, &drive))
}

fn main() {
    let seeds: Vec<u64> = SEEDS.collect();
    let drives = parallel::map(&seeds, |seed| unaided(*seed));
    println!(
        "| method | ten minutes, RMS, deg | kilometres | within {NEAR_M} m | 90 %, m | worst, m |\n|---|---|---|---|---|---|"
    );
    for (of, method) in METHODS.into_iter().enumerate() {
        let all = |what: usize| drives.iter().flat_map(move |drive| drive[of][what].iter().copied());
        let rms = (all(0).map(|error| error * error).sum::<f64>() / all(0).count() as f64).sqrt();
        let mut ends: Vec<f64> = all(1).collect();
        ends.sort_by(f64::total_cmp);
        let (number, near) = (ends.len(), ends.iter().filter(|end| **end <= NEAR_M).count());
        let (share, most, worst) = (100 * near / number, ends[number * 9 / 10], ends[number - 1]);
        println!("| {method} | {rms:.2} | {number} | {share} % | {most:.1} | {worst:.1} |");
    }
}

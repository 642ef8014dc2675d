//! A recording through the bytes of a part: the corrected yaw is that of the direct replay, within
//! what the part rounds. `cargo gyronet replay --via PART FILE` prints the same figures.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::{PERIOD_US, Validity};
use gyronet::units::{AngularRate, Micros};
use gyronet_host_tests::recordings;
use gyronet_tools::bundled;
use gyronet_tools::drive::recording::{Recording, Row};
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::drive::wheel_frames::WheelFrames;
use gyronet_tools::parts::compare::{Bound, Difference};
use gyronet_tools::parts::{Part, Quantisation, Via};

fn network() -> GyroNet<'static> {
    GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library"))
}

fn drive(recording: &Recording) -> Replay {
    Replay::run(recording, &PipelineConfig::DEFAULT, WheelFrames::new(recording), &mut network(), || {})
        .expect("it stands still first")
}

/// Largest departures of rate and acceleration, rad/s and m/s^2.
fn departures(recording: &Recording, via: &Via) -> (f64, f64) {
    let (mut rate, mut force) = (0.0f64, 0.0f64);
    for (one, other) in recording.rows.iter().zip(&via.recording.rows) {
        for axis in 0..3 {
            let (a, b) = (one.sample.angular_rate[axis], other.sample.angular_rate[axis]);
            rate = rate.max((a.rad_per_sec() - b.rad_per_sec()).abs());
            let (a, b) = (one.sample.specific_force[axis], other.sample.specific_force[axis]);
            force = force.max((a.metre_per_sec2() - b.metre_per_sec2()).abs());
        }
    }
    (rate, force)
}

fn same_time_and_place(one: &Row, other: &Row) -> bool {
    (one.line, one.sample.time, one.sample.validity) == (other.line, other.sample.time, other.sample.validity)
}

/// Replays one recording through all parts.
fn check(recording: &Recording) {
    let direct = drive(recording);
    for part in Part::ALL {
        let via = part.send(recording).expect("every row comes back");
        assert_eq!(via.recording.rows.len(), recording.rows.len());
        assert!(recording.rows.iter().zip(&via.recording.rows).all(|(a, b)| same_time_and_place(a, b)));
        let Quantisation { rate, force } = via.quantisation;
        let (worst_rate, worst_force) = departures(recording, &via);
        let bound =
            Bound::new(via.quantisation, recording, &direct, &mut network(), || {}).expect("initialises");
        let difference = Difference::of_rates(&direct, &drive(&via.recording));
        println!(
            "{} via {part}: rate step {rate:.3e} rad/s, worst {worst_rate:.3e}; acceleration step {force:.3e} \
             m/s^2, worst {worst_force:.3e}; yaw {:.3e} rad at most, {:.3e} at the end, bound {:.3e}; rate rms \
             {:.3e} rad/s, bound {:.3e}",
            recording.name(),
            difference.yaw_largest,
            difference.yaw_final,
            bound.yaw(),
            difference.rate_rms,
            bound.rate_rms,
        );
        assert!(worst_rate <= rate / 2.0, "{part}: a rate is off by {worst_rate} rad/s");
        assert!(worst_force <= force / 2.0, "{part}: an acceleration is off by {worst_force} m/s^2");
        assert_eq!(difference.rows, direct.steps.len() - direct.start);
        assert!(bound.holds(&difference), "{part}: {difference:?} {bound:?}");
        if part == Part::Xsens {
            assert_eq!(via.recording, *recording, "the samples are the same to the last bit");
        }
    }
}

#[test]
fn every_part_stays_within_its_rounding_on_the_simulated_drive() {
    check(&bundled::simulated_drive().expect("it comes with the tools"));
}

#[test]
fn every_part_stays_within_its_rounding_on_a_real_drive() {
    let Some(path) = recordings::trial("every_part_stays_within_its_rounding_on_a_real_drive", 11) else {
        return;
    };
    check(&Recording::read(&path).expect("a recording"));
}

/// The bound is one: a gyro that is off by two steps once static initialisation is over breaks it.
#[test]
fn a_wrong_rate_breaks_the_bound() {
    let mut recording = bundled::simulated_drive().expect("it comes with the tools");
    recording.rows.truncate(3_000);
    let direct = drive(&recording);
    let via = Part::Icm42688.send(&recording).expect("every row comes back");
    let bound =
        Bound::new(via.quantisation, &recording, &direct, &mut network(), || {}).expect("initialises");
    let mut wrong = via.recording;
    let off = (2.0 * via.quantisation.rate / AngularRate(1).rad_per_sec()) as i32;
    for row in &mut wrong.rows[300..] {
        row.sample.angular_rate[2].0 += off;
    }
    let difference = Difference::of_rates(&direct, &drive(&wrong));
    assert!(!bound.holds(&difference), "{difference:?} {bound:?}");
}

/// Time stamps that jitter by a millisecond, a missing row, a second and a half of silence, and
/// time of the board's own clock beyond what 32 bits of the parts' stamps hold.
#[test]
fn gaps_and_jitter_come_back_as_they_are() {
    let mut recording = bundled::simulated_drive().expect("it comes with the tools");
    recording.rows.truncate(2_000);
    for (n, row) in recording.rows.iter_mut().enumerate() {
        let n = n as u64;
        let gaps = u64::from(n >= 700) + 150 * u64::from(n >= 900) + 7 * u64::from(n >= 1_200);
        let jitter = n * 7 % 11 * 100;
        row.sample.time = Micros((u64::from(u32::MAX) * 100 / PERIOD_US + n + gaps) * PERIOD_US + jitter);
        row.sample.validity = Validity::reported(n == 1_500);
    }
    for part in Part::ALL {
        let via = part.send(&recording).expect("every row comes back");
        for (row, back) in recording.rows.iter().zip(&via.recording.rows) {
            // An ICM-42688-P counts 32/30 us.
            let step = u64::from(part == Part::Icm42688);
            let off = row.sample.time.0.abs_diff(back.sample.time.0);
            assert!(off <= step, "{part}: line {}: {off} us", row.line);
        }
        let (rate, force) = departures(&recording, &via);
        assert!(rate <= via.quantisation.rate / 2.0 && force <= via.quantisation.force / 2.0, "{part}");
    }
}

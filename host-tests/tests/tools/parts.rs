//! A recording through the bytes of a part and the parser that the board runs: every sample comes back, within what
//! the part rounds.

use gyronet::sample::{PERIOD_US, Validity};
use gyronet::units::Micros;
use gyronet_host_tests::recordings;
use gyronet_tools::bundled;
use gyronet_tools::drive::recording::{Recording, Row};
use gyronet_tools::parts::{Part, Quantisation, Via};

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

/// Sends one recording through all parts.
fn check(recording: &Recording) {
    for part in Part::ALL {
        let via = part.send(recording).expect("every row comes back");
        assert_eq!(via.recording.rows.len(), recording.rows.len());
        assert!(recording.rows.iter().zip(&via.recording.rows).all(|(a, b)| same_time_and_place(a, b)));
        let Quantisation { rate, force } = via.quantisation;
        let (worst_rate, worst_force) = departures(recording, &via);
        assert!(worst_rate <= rate / 2.0, "{part}: a rate is off by {worst_rate} rad/s");
        assert!(worst_force <= force / 2.0, "{part}: an acceleration is off by {worst_force} m/s^2");
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

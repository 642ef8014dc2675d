//! These tests create recordings with one defect each.

mod course;
mod mounting;

use super::line::{DEGREES, KMH};
use super::*;
use crate::drive::recording::Reader;
use crate::random::Random;
use std::fmt::Write;

/// Examines a drive of a car that rests for 20 s, turns for 40 s and rests for 20 s. `edit` changes a row's time,
/// force, rate, wheels 2 and 4, and reference; it returns false to drop the row.
fn doctor(edit: impl Fn(usize, &mut [f64; 10]) -> bool) -> Doctor {
    let mut random = Random::new(1, 0);
    let mut text =
        String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel2_rate,wheel4_rate,ref_gyr_z\n");
    for k in 0..8_000 {
        let time = 0.01 * k as f64;
        let moves = (2_000..6_000).contains(&k);
        let yaw = if moves { 0.4 * (0.21 * time).sin() * (0.05 * time + 0.4).cos() } else { 0.0 };
        let speed = if moves { 20.0 } else { 0.0 };
        let mut noise = || 0.002 * random.normal();
        let shakes = if moves { 10.0 } else { 1.0 };
        let mut row = [
            time,
            0.17 + noise(),
            noise(),
            9.8 + noise(),
            shakes * noise(),
            shakes * noise(),
            yaw + 0.01 + shakes * noise(),
            speed + 2.5 * yaw,
            speed - 2.5 * yaw,
            yaw,
        ];
        if edit(k, &mut row) {
            writeln!(text, "{}", row.map(|value| format!("{value:.6}")).join(",")).unwrap();
        }
    }
    let reader = Reader::new("made.csv", text.as_bytes()).unwrap();
    Doctor::of(&Rows::parse("made", reader).unwrap())
}

fn found<'d>(doctor: &'d Doctor, what: &str) -> (Verdict, &'d str) {
    let finding = doctor.finding(what).unwrap_or_else(|| panic!("{what}: {:?}", doctor.findings));
    (finding.verdict, &finding.text)
}

#[test]
fn a_good_recording_has_nothing_to_cure() {
    let doctor = doctor(|_, _| true);
    assert!(doctor.findings.iter().all(|finding| finding.verdict != Verdict::Bad), "{:?}", doctor.findings);
    assert_eq!(doctor.standstills.len(), 2);
    let Some(Mounting { pitch_deg, .. }) = doctor.mounting else { panic!() };
    assert!((pitch_deg + 1.0).abs() < 0.05, "{pitch_deg}");
    let Some([.., Some(noise)]) = doctor.noise else { panic!() };
    // 0.002 rad/s at 100 Hz.
    assert!((noise.random_walk / 2e-4 - 1.0).abs() < 0.15, "{noise:?}");
    let (verdict, wheels) = found(&doctor, "wheels");
    assert!(verdict == Verdict::Good && wheels.contains("track 1.44 m"), "{wheels}");
    let (verdict, reference) = found(&doctor, "reference");
    assert!(verdict == Verdict::Good && reference.contains(" ms early"), "{reference}");
    let scope = found(&doctor, "what it can judge").1;
    assert!(scope.contains("later stops: 1; length: 80 s"), "{scope}");
}

#[test]
fn a_source_slower_than_the_board_takes_is_named_behind_an_import() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("car.csv");
    std::fs::write(&csv, crate::bundled::SIMULATED_DRIVE).unwrap();
    for (rates, named) in [("imu = 25.0", true), ("imu = 50.0\nposition = 1.0", false)] {
        std::fs::write(csv.with_extension("toml"), format!("[recording.rates]\n{rates}\n")).unwrap();
        let doctor = Doctor::examine(&csv).unwrap();
        let found = doctor.finding("source rate").filter(|finding| finding.text.starts_with("imu 25 Hz: "));
        assert_eq!(found.is_some(), named, "{rates}: {:?}", doctor.findings);
    }
}

#[test]
fn a_standing_sensor_neither_turns_nor_stops() {
    let doctor = doctor(|k, row| {
        row[6..].copy_from_slice(&[0.01 + 0.002 * (k % 3) as f64, 0.0, 0.0, 0.0]);
        !(1_000..1_400).contains(&k)
    });
    let scope = found(&doctor, "what it can judge").1;
    assert!(scope.starts_with("Turns of more than 45 deg: 0; turned in all: 0.0 rad;"), "{scope}");
    assert!(scope.contains("length: 80 s"), "gaps included: {scope}");
    let wheels = found(&doctor, "wheels").1;
    assert!(wheels.starts_with("2 recorded; no axle has both"), "{wheels}");
}

#[test]
fn a_gain_is_said_in_per_cent() {
    let doctor = doctor(|_, row| {
        row[6] *= 1.007;
        true
    });
    let (verdict, reference) = found(&doctor, "reference");
    let (_, gain) = reference.split_once("gain is ").unwrap_or_else(|| panic!("{reference}"));
    let numbers: Vec<f64> = gain.split(' ').filter_map(|word| word.parse().ok()).collect();
    assert!(verdict == Verdict::Good && gain.ends_with(" % too high."), "{reference}");
    assert!((numbers[0] - 0.7).abs() < 3.0 * numbers[1] && numbers[1] < 0.3, "{reference}");
}

#[test]
fn each_defect_is_found() {
    let bad = |what: &str, text: &str, edit: &dyn Fn(usize, &mut [f64; 10]) -> bool| {
        let doctor = doctor(edit);
        let (verdict, found) = found(&doctor, what);
        assert!(verdict == Verdict::Bad && found.contains(text), "{what}: {found}");
    };
    let changed = |what: &str, text: &str, change: &dyn Fn(usize, &mut [f64; 10])| {
        bad(what, text, &|k, row| {
            change(k, row);
            true
        });
    };
    let degrees = |_: usize, row: &mut [f64; 10]| row[4..7].iter_mut().for_each(|rate| *rate *= DEGREES);
    bad("gaps", "1 with 150 missing rows", &|k, _| !(3_000..3_150).contains(&k));
    changed("gyro range", "samples at the limit of 11.5 deg/s", &|_, row| row[6] = row[6].clamp(-0.2, 0.2));
    changed("stuck samples", "12 samples repeat", &|k, row| {
        if (4_000..4_012).contains(&k) {
            row[1..7].fill(0.5);
        }
    });
    let third = "33.33 Hz by the median period: the board and the other commands use 50 to 1000 Hz; `cargo gyronet import \
                 made.csv --out made_100hz.csv` makes 100 Hz";
    bad("rate", third, &|k, _| k % 3 == 0);
    bad(
        "rate",
        "20.00 Hz by the median period: the board and the other commands use 50 to 1000 Hz; record it again",
        &|k, _| k % 5 == 0,
    );
    changed("unreadable rows", "time goes backwards", &|k, row| row[0] -= if k == 500 { 1.0 } else { 0.0 });
    changed("mounting", "z is not up", &|_, row| row[3] = -row[3]);
    changed("mounting", "imu is in g; `cargo gyronet import made.csv --unit imu=g --out", &|_, row| {
        row[1..4].iter_mut().for_each(|force| *force /= 9.8)
    });
    changed("gyro unit", "imu is in deg/s; `cargo gyronet import made.csv --unit imu=deg/s --out", &degrees);
    changed("rate", "t_s is in ms; `cargo gyronet import made.csv --unit t_s=ms --out", &|_, row| {
        row[0] *= 1e3
    });
    changed("wheels", "swapped", &|_, row| row.swap(7, 8));
    changed("reference", "imu is in deg/s; `cargo gyronet import made.csv --unit imu=deg/s --out", &degrees);
    changed("wheels", "imu is in deg/s", &degrees);
    changed("reference", "ref_gyr_z is in deg/s", &|_, row| row[9] *= DEGREES);
    changed("reference", "the opposite sign", &|_, row| row[9] = -row[9]);
    changed("reference", "it shows no turn, and the gyro turns by ", &|_, row| row[9] = 0.0);
    changed("wheels", "--unit wheel2_rate=km/h --unit wheel4_rate=km/h", &|_, row| {
        row[7..9].iter_mut().for_each(|rate| *rate *= KMH)
    });
    changed("reference", "does not fit the gyro", &|k, row| {
        row[9] = (0.3 * row[0] + 1e-4 * k as f64 * row[0]).sin()
    });
}

#[test]
fn a_drive_that_starts_moving_is_told_where_it_can_start() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("car.csv");
    // In another unit no standstill is found, which is no reason to record it again.
    let stem = folder.path().join("car").display().to_string();
    let cut = format!(
        "it can start at 21 s: `cargo gyronet import {stem}.csv --from 21 --out {stem}_from_21.csv`."
    );
    let cases = [
        (9.8, 9_000, &*cut),
        (9.8, 8_600, "where a course is known (ref_yaw)."),
        (1.0, 9_000, "first mend the unit, below."),
    ];
    for (gravity, rows, end) in cases {
        let mut random = Random::new(1, 0);
        let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n");
        for k in 0..rows {
            let time = 0.01 * f64::from(k);
            let shakes = if (2_030..2_700).contains(&k) { 1.0 } else { 20.0 };
            let mut noise = || shakes * (0.002 * random.normal());
            let yaw = if shakes > 1.0 { 0.3 * time.sin() } else { 0.0 };
            let row = [noise(), noise(), gravity + noise(), noise(), noise(), yaw + noise()];
            writeln!(text, "{time:.2},{}", row.map(|value| format!("{value:.6}")).join(",")).unwrap();
        }
        std::fs::write(&csv, text).unwrap();
        let doctor = Doctor::examine(&csv).unwrap();
        let (verdict, start) = found(&doctor, "start");
        assert!(verdict == Verdict::Bad && start.ends_with(end), "{start}");
    }
}

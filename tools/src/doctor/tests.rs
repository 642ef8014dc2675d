//! These tests create recordings with one defect each.

use super::line::{DEGREES, KMH};
use super::*;
use crate::bundled;
use crate::drive::recording::Reader;
use crate::drive::vehicle::Vehicle;
use gyronet::mounting::Rotation;
use gyronet::units::SpecificForce;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use std::fmt::Write;

/// Examines a drive of a car that rests for 20 s, turns for 40 s and rests for 20 s. `edit` changes a row's time,
/// force, rate, wheels 2 and 4, and reference; it returns false to drop the row.
fn doctor(edit: impl Fn(usize, &mut [f64; 10]) -> bool) -> Doctor {
    let (mut random, normal) = (ChaCha8Rng::seed_from_u64(1), Normal::new(0.0, 0.002).unwrap());
    let mut text =
        String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel2_rate,wheel4_rate,ref_gyr_z\n");
    for k in 0..8_000 {
        let time = 0.01 * k as f64;
        let moves = (2_000..6_000).contains(&k);
        let yaw = if moves { 0.4 * (0.21 * time).sin() * (0.05 * time + 0.4).cos() } else { 0.0 };
        let speed = if moves { 20.0 } else { 0.0 };
        let mut noise = || normal.sample(&mut random);
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

/// A car that rests for 10 s and then drives with turns of both sides, in a drive with a course and a speed by GNSS.
/// The gyro and the wheels are multiplied by `gyro` and `wheels`, and the course comes `late` seconds late.
fn with_course(gyro: f64, wheels: f64, late: usize, toml: &str) -> Doctor {
    let mut text =
        String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel2_rate,wheel4_rate,ref_yaw,gnss_speed\n");
    let (mut random, normal) = (ChaCha8Rng::seed_from_u64(2), Normal::new(0.0, 0.002).unwrap());
    let mut courses = Vec::new();
    let mut angle = 0.0;
    for k in 0..9_000 {
        let time = 0.01 * f64::from(k);
        let speed = (1.5 * (time - 10.0)).clamp(0.0, 12.0);
        let turn = if time < 10.0 {
            0.0
        } else {
            0.3 * (0.21 * time).sin() * (0.05 * time + 0.4 + 1e-4 * time * time).cos()
        };
        angle += 0.01 * turn;
        courses.push((speed > 1.0).then_some((angle, speed)));
        let mut noise = || normal.sample(&mut random);
        let (rate, wheel) = (gyro * (turn + noise()), wheels * speed / 0.289);
        let side = speed * turn + noise();
        write!(
            text,
            "{time:.2},{},{side},{},{},{},{rate},{wheel},{wheel},",
            noise(),
            9.81 + noise(),
            gyro * noise(),
            gyro * noise()
        )
        .unwrap();
        match (k % 20, k as usize >= late) {
            (0, true) => match courses[k as usize - late] {
                Some((course, speed)) => writeln!(text, "{course:.6},{speed:.6}").unwrap(),
                None => text.push_str(",\n"),
            },
            _ => text.push_str(",\n"),
        }
    }
    let vehicle = Vehicle::parse("made.toml", toml).unwrap();
    let reader = Reader::new("made.csv", text.as_bytes()).unwrap();
    Doctor::of(&Rows { vehicle, ..Rows::parse("made", reader).unwrap() })
}

#[test]
fn speed_and_course_show_units_and_clocks() {
    let named = "[signals]\nimu = '/imu'\nposition = '/fix'\n[wheels]\nrear_left = 'W.RL'\nrear_right = 'W.RR'\n\
                 [recording.units]\n'/imu' = 'm/s^2, rad/s'\n";
    let good = with_course(1.0, 1.0, 0, named);
    assert!(good.findings.iter().all(|finding| finding.verdict != Verdict::Bad), "{:?}", good.findings);
    assert_eq!(found(&good, "speed").1, "Wheels turn 1.000 times as fast as the speed by GNSS.");
    for (what, doctor, remedy) in [
        ("reference", with_course(DEGREES, 1.0, 0, named), "import the log again with `--unit /imu=deg/s`"),
        (
            "reference",
            with_course(1.0, 1.0, 1_800, named),
            "(GPS time against UTC); import the log again with `--offset /fix=-18.0`",
        ),
        (
            "speed",
            with_course(1.0, KMH, 0, named),
            "in km/h; import the log again with `--unit W.RL=km/h --unit W.RR=km/h`",
        ),
    ] {
        let (verdict, text) = found(&doctor, what);
        assert!(verdict == Verdict::Bad && text.contains(remedy), "{text}");
    }
    let smaller = with_course(1.0, 1.05, 0, named);
    assert!(found(&smaller, "speed").1.contains("radius_m = 0.275 in the vehicle file fits"));
}

#[test]
fn each_defect_is_found() {
    let bad = |what: &str, text: &str, edit: &dyn Fn(usize, &mut [f64; 10]) -> bool| {
        let doctor = doctor(edit);
        let (verdict, found) = found(&doctor, what);
        assert!(verdict == Verdict::Bad && found.contains(text), "{what}: {found}");
    };
    bad("gaps", "1 with 150 missing rows", &|k, _| !(3_000..3_150).contains(&k));
    bad("gyro range", "samples at the limit of 11.5 deg/s", &|_, row| {
        row[6] = row[6].clamp(-0.2, 0.2);
        true
    });
    bad("stuck samples", "12 samples repeat", &|k, row| {
        if (4_000..4_012).contains(&k) {
            row[1..7].fill(0.5);
        }
        true
    });
    bad("rate", "33.33 Hz", &|k, _| k % 3 == 0);
    bad("unreadable rows", "time goes backwards", &|k, row| {
        row[0] -= if k == 500 { 1.0 } else { 0.0 };
        true
    });
    bad("mounting", "z is not up", &|_, row| {
        row[3] = -row[3];
        true
    });
    bad("mounting", "is not m/s^2", &|_, row| {
        row[1..4].iter_mut().for_each(|force| *force /= 9.8);
        true
    });
    bad("wheels", "swapped", &|_, row| {
        row.swap(7, 8);
        true
    });
    bad("reference", "imu is in deg/s; `gyronet import made.csv --unit imu=deg/s --out", &|_, row| {
        row[4..7].iter_mut().for_each(|rate| *rate *= DEGREES);
        true
    });
    bad("wheels", "imu is in deg/s", &|_, row| {
        row[4..7].iter_mut().for_each(|rate| *rate *= DEGREES);
        true
    });
    bad("reference", "ref_gyr_z is in deg/s", &|_, row| {
        row[9] *= DEGREES;
        true
    });
    bad("reference", "the opposite sign", &|_, row| {
        row[9] = -row[9];
        true
    });
    bad("wheels", "--unit wheel2_rate=km/h --unit wheel4_rate=km/h", &|_, row| {
        row[7..9].iter_mut().for_each(|rate| *rate *= KMH);
        true
    });
    bad("reference", "does not fit the gyro", &|k, row| {
        row[9] = (0.3 * row[0] + 1e-4 * k as f64 * row[0]).sin();
        true
    });
}

/// The simulated drive as a sensor with this mounting records it.
fn mounted(path: &Path, mounting: Rotation) {
    let inverse = |v: [f64; 3]| {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        axes.map(|axis| {
            let turned = mounting.force(axis.map(|value| SpecificForce::from_metre_per_sec2(value).unwrap()));
            turned.iter().zip(v).map(|(one, other)| one.metre_per_sec2() * other).sum::<f64>()
        })
    };
    let mut lines = bundled::SIMULATED_DRIVE.lines();
    let mut text = lines.next().unwrap().to_owned() + "\n";
    for line in lines {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        for first in [1, 4] {
            let vector = [0, 1, 2].map(|k| fields[first + k].parse().unwrap());
            for (k, value) in inverse(vector).into_iter().enumerate() {
                fields[first + k] = value.to_string();
            }
        }
        text += &(fields.join(",") + "\n");
    }
    std::fs::write(path, text).unwrap();
}

#[test]
fn obeying_the_doctor_converges_in_one_step() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("car.csv");
    for angles in
        [[0.0, 0.0, 90.0], [180.0, 0.0, 0.0], [90.0, 0.0, -60.0], [25.0, -10.0, 120.0], [-5.0, 70.0, -150.0]]
    {
        let [roll, pitch, yaw] = angles;
        mounted(&csv, Rotation::from_mounting(roll, pitch, yaw).unwrap());
        // No file; one of an older import, whose angles do not count; one with a mounting that is wrong.
        for toml in
            ["", "[mounting]\nyaw_deg = 35\napplied = true\n", "[mounting]\nroll_deg = 40\nyaw_deg = 10\n"]
        {
            let file = csv.with_extension("toml");
            std::fs::write(&file, toml).unwrap();
            let remedies = |doctor: &Doctor| -> Vec<String> {
                let all = doctor
                    .findings
                    .iter()
                    .filter_map(|finding| finding.text.split_once("under [mounting], set "));
                all.map(|(_, settings)| settings.trim_end_matches('.').to_owned()).collect()
            };
            let first = remedies(&Doctor::examine(&csv).unwrap());
            assert!(
                !first.is_empty() && first.iter().all(|remedy| *remedy == first[0]),
                "{angles:?} {first:?}"
            );
            std::fs::write(&file, format!("[mounting]\n{}\n", first[0].replace(", ", "\n"))).unwrap();
            let doctor = Doctor::examine(&csv).unwrap();
            assert_eq!(remedies(&doctor), Vec::<String>::new(), "{angles:?} {toml:?} {first:?}");
            let bad = doctor.findings.iter().filter(|finding| finding.verdict == Verdict::Bad);
            assert_eq!(bad.count(), 0, "{angles:?} {:?}", doctor.findings);
            let (_, forward) = found(&doctor, "forward");
            assert!(forward.starts_with("x points "), "{forward}");
        }
    }
}

#[test]
fn a_drive_that_starts_moving_is_told_where_it_can_start() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("car.csv");
    let (mut random, normal) = (ChaCha8Rng::seed_from_u64(1), Normal::new(0.0, 0.002).unwrap());
    let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n");
    for k in 0..6_000 {
        let time = 0.01 * f64::from(k);
        let shakes = if (2_030..2_700).contains(&k) { 1.0 } else { 20.0 };
        let mut noise = || shakes * normal.sample(&mut random);
        let yaw = if shakes > 1.0 { 0.3 * time.sin() } else { 0.0 };
        let row = [noise(), noise(), 9.8 + noise(), noise(), noise(), yaw + noise()];
        writeln!(text, "{time:.2},{}", row.map(|value| format!("{value:.6}")).join(",")).unwrap();
    }
    std::fs::write(&csv, text).unwrap();
    let doctor = Doctor::examine(&csv).unwrap();
    let (verdict, start) = found(&doctor, "start");
    assert!(verdict == Verdict::Bad, "{start}");
    assert!(
        start.ends_with("it can start at 21 s: `gyronet import car.csv --from 21 --out car_from_21.csv`."),
        "{start}"
    );
}

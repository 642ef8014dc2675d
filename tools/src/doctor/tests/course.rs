//! Drives with a course and a speed by GNSS, whose units and clocks they show.

use super::super::line::{DEGREES, KMH};
use super::super::recording::Rows;
use super::super::{Doctor, Verdict};
use super::found;
use crate::drive::recording::Reader;
use crate::drive::vehicle::Vehicle;
use crate::random::Random;
use std::fmt::Write;

/// A car that rests for 10 s and then drives with turns of both sides, in a drive with a course and a speed by GNSS.
/// The gyro and the wheels are multiplied by `gyro` and `wheels`, and the course comes `late` seconds late.
fn with_course(gyro: f64, wheels: f64, late: usize, toml: &str) -> Doctor {
    let mut text =
        String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel2_rate,wheel4_rate,ref_yaw,gnss_speed\n");
    let (mut random, mut courses, mut angle) = (Random::new(2, 0), Vec::new(), 0.0);
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
        let mut noise = || 0.002 * random.normal();
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
    let odometry = "[signals]\nodometry = '/odom'\n[recording.units]\n'/imu' = 'm/s^2, rad/s'\n";
    let doctor = with_course(1.0, KMH, 0, odometry);
    assert!(found(&doctor, "speed").1.ends_with("import the log again with `--unit /odom=km/h`."));
    let smaller = with_course(1.0, 1.05, 0, named);
    assert!(found(&smaller, "speed").1.contains("radius_m = 0.275 in the vehicle file fits"));
    let larger = with_course(1.0, 0.576, 0, named);
    let (verdict, text) = found(&larger, "speed");
    assert!(verdict == Verdict::Bad && text.contains("radius_m = 0.502 in the vehicle file fits"), "{text}");
}

#[test]
fn positions_give_the_speed_that_a_receiver_does_not() {
    let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,wheel2_rate,gnss_lat,gnss_lon\n");
    let mut north = 0.0;
    for k in 0..6_000 {
        let (time, flicker) = (0.01 * f64::from(k), 1e-3 * f64::from(k % 3));
        let speed = 8.0 + 3.0 * (0.2 * time).sin();
        north += 0.01 * speed / 111_132.0;
        let place = if k % 20 == 0 { format!("{north:.9},11.0") } else { ",".to_owned() };
        let wheel = 0.576 * speed / 0.289;
        writeln!(text, "{time:.2},{flicker},{flicker},9.81,{flicker},0,{flicker},{wheel:.4},{place}")
            .unwrap();
    }
    let doctor = Doctor::of(&Rows::parse("made", Reader::new("made.csv", text.as_bytes()).unwrap()).unwrap());
    assert!(found(&doctor, "speed").1.contains("radius_m = 0.50"), "{}", found(&doctor, "speed").1);
}

//! `gyronet doctor` on real recordings: figures that are known from elsewhere.

use gyronet_host_tests::recordings::{found, trial};
use gyronet_tools::bundled;
use gyronet_tools::doctor::{Doctor, Mounting, Noise, Verdict};
use std::fmt::Write as _;

#[test]
fn a_car_is_fit_and_its_reference_has_the_known_floor() {
    for number in [8, 11] {
        let Some(path) = trial(number) else { return };
        let doctor = Doctor::examine(&path).unwrap();
        let bad: Vec<_> = doctor.findings.iter().filter(|finding| finding.verdict == Verdict::Bad).collect();
        assert!(bad.is_empty(), "{bad:?}");
        let reference = &doctor.finding("reference").unwrap().text;
        let floor = reference.split("scatters by ").nth(1).unwrap().split(' ').next().unwrap();
        // 0.00009 to 0.00011 rad in 1 s as a mean absolute difference of neighbours, less as a deviation.
        assert!((5e-5..1.2e-4).contains(&floor.parse::<f64>().unwrap()), "{reference}");
    }
}

/// An ADIS16405 at rest, upside down, in g and deg/s: a table with other names and units.
#[test]
fn a_sensor_at_rest_has_the_noise_of_its_data_sheet() {
    let Some(path) = found("static_adis16405/static_100hz.csv") else { return };
    // In our names and units, the right way up.
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let field = |line: &[f64], name: &str| line[names.iter().position(|known| *known == name).unwrap()];
    let mut csv_text = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n".to_owned();
    let mut rows = 0;
    for line in lines {
        let line: Vec<f64> = line.split(',').map(|text| text.parse().unwrap()).collect();
        write!(csv_text, "{:.2}", field(&line, "t_s")).unwrap();
        for (sensor, unit, scale) in [("acc", "g", 9.806_65), ("gyr", "dps", 1f64.to_radians())] {
            for (axis, sign) in [("x", 1.0), ("y", -1.0), ("z", -1.0)] {
                let value = sign * scale * field(&line, &format!("{sensor}_{axis}_{unit}"));
                write!(csv_text, ",{value:.7}").unwrap();
            }
        }
        csv_text.push('\n');
        rows += 1;
    }
    assert_eq!(rows, 180_000);
    let csv = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("static_doctor.csv");
    std::fs::write(&csv, csv_text).unwrap();

    let doctor = Doctor::examine(&csv).unwrap();
    let Some(Mounting { roll_deg, pitch_deg, force, .. }) = doctor.mounting else { panic!() };
    assert!(roll_deg.abs() < 2.0 && pitch_deg.abs() < 2.0 && (9.6..10.2).contains(&force), "{force}");
    // The data sheet has 2.0 deg/sqrt(h) and 0.007 deg/s at 25 degrees, typical.
    let noise = doctor.noise.unwrap().map(|noise| noise.unwrap());
    for Noise { random_walk, instability } in noise {
        assert!((1.0..3.0).contains(&(random_walk.to_degrees() * 60.0)), "{random_walk}");
        // An axis whose curve still falls at its end, after half an hour, has none.
        if let Some((rate, tau)) = instability {
            assert!((0.003..0.015).contains(&rate.to_degrees()) && tau > 10.0, "{rate} {tau}");
        }
    }
    // A few lines of NumPy on the same column give 0.0082 deg/s at the bottom of z, at 42 s.
    let (rate, tau) = noise[2].instability.unwrap();
    assert!((rate.to_degrees() * 0.664 - 0.0082).abs() < 2e-4 && (30.0..55.0).contains(&tau), "{rate} {tau}");
}

/// The angle from x to forward, to the left, and its sigma, as the finding names them.
fn forward(doctor: &Doctor) -> [f64; 2] {
    let text = &doctor.finding("forward").unwrap().text;
    let mut numbers = text.split(' ').filter_map(|word| word.parse().ok());
    let [angle, sigma] = [(); 2].map(|()| numbers.next().unwrap_or_else(|| panic!("{text}")));
    [if text.contains("to the right of forward") { angle } else { -angle }, sigma]
}

#[test]
fn wheels_and_accelerometer_show_where_forward_is() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    for mounted in [0.0, 90.0, -120.0] {
        let csv = folder.join(format!("forward_{mounted}.csv"));
        std::fs::write(&csv, bundled::SIMULATED_DRIVE).unwrap();
        std::fs::write(csv.with_extension("toml"), format!("[mounting]\nyaw_deg = {mounted}\n")).unwrap();
        let [yaw, sigma] = forward(&Doctor::examine(&csv).unwrap());
        assert!((yaw - mounted).abs() < 3.0 * sigma && sigma < 5.0, "{mounted}: {yaw} +- {sigma}");
    }
    // The recorded car's sensor looks to the right; five of its drives agree.
    for number in [2, 3, 4, 7, 8] {
        let Some(path) = trial(number) else { return };
        let [yaw, sigma] = forward(&Doctor::examine(&path).unwrap());
        assert!((yaw - 98.0).abs() < 2.0 * sigma && sigma < 10.0, "{number}: {yaw} +- {sigma}");
    }
}

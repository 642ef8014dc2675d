//! A drive whose mounting is wrong is mended by doing once what the doctor says.

use super::super::{Doctor, Verdict};
use super::found;
use crate::bundled;
use gyronet::mounting::Rotation;
use gyronet::units::SpecificForce;
use std::path::Path;

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

use super::*;
use std::fs;
use tempfile::tempdir;

fn spec(seconds: u32) -> Spec {
    Spec { name: "one".into(), seconds, device: 1, run: 7 }
}

/// Returns all rows of a file, each with its stamp separated.
fn rows(path: &Path) -> Vec<(i64, Vec<f64>)> {
    let text = fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let (stamp, rest) = line.split_once(',').unwrap();
        (stamp.parse().unwrap(), rest.split(',').map(|field| field.parse().unwrap()).collect())
    };
    text.lines().map(row).collect()
}

#[test]
fn kaist_has_its_columns_and_rates() {
    let folder = tempdir().unwrap();
    write(&spec(120), folder.path()).unwrap();
    for (file, count, columns) in [
        ("sensor_data/xsens_imu.csv", 12_000, 16),
        ("sensor_data/fog.csv", 120_000, 3),
        ("sensor_data/encoder.csv", 12_000, 2),
        ("global_pose.csv", 12_000, 12),
    ] {
        let rows = rows(&folder.path().join(file));
        assert_eq!(rows.len(), count, "{file}");
        assert!(rows.iter().all(|(_, fields)| fields.len() == columns), "{file}");
        assert!(rows.windows(2).all(|pair| pair[0].0 < pair[1].0), "{file}: time rises");
        assert!(rows[0].0 > 1_500_000_000_000_000_000, "{file}: nanoseconds");
    }
    let parameters = fs::read_to_string(folder.path().join("calibration/EncoderParameter.txt")).unwrap();
    assert_eq!(
        parameters,
        "Encoder calibrated parameter\nEncoder resolution: 4096\n\
         Encoder left wheel diameter: 0.623022\nEncoder right wheel diameter: 0.622356\n\
         Encoder wheel base: 1.5285\n"
    );
}

/// The increments sum to the turn of the pose, except for the Earth's rate and the gyro's errors, and the counts give
/// the distance.
#[test]
fn kaist_sensors_agree_with_the_pose() {
    let folder = tempdir().unwrap();
    write(&spec(600), folder.path()).unwrap();
    let fog: f64 = rows(&folder.path().join("sensor_data/fog.csv")).iter().map(|row| row.1[2]).sum();
    let poses = rows(&folder.path().join("global_pose.csv"));
    let mut yaw = 0.0;
    let mut metres = 0.0;
    for pair in poses.windows(2) {
        let heading = |pose: &(i64, Vec<f64>)| libm::atan2(pose.1[4], pose.1[0]);
        let step = heading(&pair[1]) - heading(&pair[0]);
        yaw += libm::atan2(libm::sin(step), libm::cos(step));
        let moved = |k: usize| pair[1].1[k] - pair[0].1[k];
        metres += (moved(3) * moved(3) + moved(7) * moved(7) + moved(11) * moved(11)).sqrt();
    }
    let earth = 600.0 * 7.292_115e-5 * libm::sin(36.37f64.to_radians());
    assert!((fog - yaw - earth).abs() < 0.02, "{fog} {yaw} {earth}");
    let counts = rows(&folder.path().join("sensor_data/encoder.csv"));
    let last = &counts[counts.len() - 1].1;
    let wheels = (last[0] * 0.623_022 + last[1] * 0.622_356) / 2.0 / 4096.0 * std::f64::consts::PI;
    assert!(metres > 1_500.0, "{metres}");
    assert!((wheels / metres - 1.0).abs() < 0.005, "{wheels} {metres}");
}

#[test]
fn sets_share_devices_and_no_run() {
    let all: Vec<Spec> = [Set::Train, Set::Test, Set::Transfer].iter().flat_map(|set| set.specs()).collect();
    assert_eq!(all.len(), 16);
    let mut runs: Vec<u64> = all.iter().map(|spec| spec.run).collect();
    runs.sort_unstable();
    runs.dedup();
    assert_eq!(runs.len(), 16);
    assert!(all[..12].iter().all(|spec| spec.device == 1) && all[12..].iter().all(|spec| spec.device == 2));
}

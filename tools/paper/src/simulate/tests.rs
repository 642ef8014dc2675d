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

//! Reads trajectories of other programs, as a user passes them to the tables.

use super::Seed;
use gyronet_paper::trajectory::Trajectory;

/// Reads bytes as a file. Poses must have rising times and finite values, and an error must name the file.
pub fn tum(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else { return };
    match Trajectory::parse("fuzz.txt".into(), text) {
        Ok(trajectory) => {
            let poses = &trajectory.poses;
            assert!(!poses.is_empty() && poses.windows(2).all(|pair| pair[0].time < pair[1].time));
            let is_finite = |[x, y]: [f64; 2], yaw: f64| [x, y, yaw].iter().all(|value| value.is_finite());
            assert!(poses.iter().all(|pose| is_finite(pose.position, pose.yaw)));
        }
        Err(error) => assert!(error.to_string().starts_with("fuzz.txt: ")),
    }
}

pub fn seeds() -> Vec<Seed> {
    let rows = "# time x y z qx qy qz qw\n1524000000.010292 355000.0 4025000.0 60.0 0 0 0.929636563 0.368477762\n\
                1524000000.020292 354999.99998 4025000.000016 60.000028 0 0 -0.929631102 -0.36849154\n";
    vec![("rows", rows.into()), ("short", b"1.5 1e3 -2 nan 0 0 0\n".to_vec())]
}

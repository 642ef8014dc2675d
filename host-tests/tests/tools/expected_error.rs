//! The errors of recorded good seconds lie inside the expected error at least as often as is said, and none is off by
//! more than four of them.

use crate::accuracy::by_default;
use gyronet_host_tests::{parallel, recordings};
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::expected_error::{ExpectedError, Seconds};

/// A car and a truck with two units: the drives with a yaw rate as reference that begin at rest.
const VEHICLES: [(&str, &[&str]); 2] = [
    ("wid_car", &["trial02", "trial03", "trial04", "trial06", "trial07", "trial08", "trial09", "trial11"]),
    ("truck", &["joined_memsense", "joined_xsens"]),
];
/// Least share of a vehicle's seconds, straight and turning apart.
const LEAST: f64 = 0.6;
const LARGEST: f64 = 4.0;

#[test]
fn recorded_errors_lie_inside_it() {
    if recordings::trial(9).is_none() {
        return;
    }
    for (vehicle, drives) in VEHICLES {
        let folder = recordings::folder().join(vehicle);
        let named = |drive: &&str| {
            let rate = if drive.starts_with("trial") { "_100hz" } else { "" };
            folder.join(format!("{drive}{rate}.csv"))
        };
        let paths: Vec<_> = drives.iter().map(named).collect();
        let found = parallel::map(&paths, |path| {
            let drive = Drive::open(path).expect("a recording");
            by_default(&drive).expected_error.expect("against a yaw rate")
        });
        for (drive, found) in drives.iter().zip(&found) {
            println!("{vehicle}/{drive}: {found}");
        }
        let kinds: [fn(&ExpectedError) -> Seconds; 2] = [|found| found.straight, |found| found.turning];
        for (kind, name) in kinds.into_iter().zip(["straight", "turning"]) {
            let all: Vec<Seconds> = found.iter().map(kind).collect();
            let seconds: usize = all.iter().map(|kind| kind.seconds).sum();
            let inside =
                all.iter().map(|kind| kind.inside * kind.seconds as f64).sum::<f64>() / seconds as f64;
            let worst = all.iter().map(|kind| kind.worst).fold(0.0, f64::max);
            println!("{vehicle}, {name}: {inside:.2} of {seconds} s, worst {worst:.1}");
            assert!(seconds >= 30 && inside >= LEAST && worst <= LARGEST, "{vehicle}, {name}");
        }
    }
}

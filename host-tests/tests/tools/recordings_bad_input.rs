//! Drives that start moving are refused: by their wheels, and by static initialisation where no wheel was recorded.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet_host_tests::recordings;
use gyronet_tools::bundled::SIMULATED_DRIVE;
use gyronet_tools::drive::error::{DataError, DataFault};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::{Replay, ReplayError};

fn parse(text: &str) -> Result<Recording, DataError> {
    Recording::parse("drive.csv", text.as_bytes())
}

/// A recording with its first `skip` rows cut off.
fn cut(text: &str, skip: usize) -> String {
    let (header, rows) = text.split_once('\n').expect("a header");
    let rows: Vec<&str> = rows.lines().skip(skip).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn run(recording: &Recording) -> Result<Replay, ReplayError> {
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    Replay::run(recording, &PipelineConfig::DEFAULT, None, &mut GyroNet::new(blob))
}

#[test]
fn a_simulated_drive_that_starts_moving_is_refused() {
    // With its wheel rates the recording itself is refused.
    let error = parse(&cut(SIMULATED_DRIVE, 2_000)).expect_err("the car drives");
    assert!(matches!(error.fault, DataFault::Moving { .. }), "{error}");
    assert!(error.to_string().starts_with("drive.csv: starts moving: line "), "{error}");
}

#[test]
fn real_drives_that_start_moving_are_refused() {
    let trials = [9, 11].map(|trial| recordings::trial("real_drives_that_start_moving_are_refused", trial));
    for path in trials.into_iter().flatten() {
        let text = std::fs::read_to_string(&path).expect("a recording");
        let without_wheels = text.replacen("wheel", "other", 4);
        for skip in (3_000..9_000).step_by(500) {
            let place = format!("{} from row {skip}", path.display());
            let error = parse(&cut(&text, skip)).expect_err(&place);
            assert!(matches!(error.fault, DataFault::Moving { .. }), "{place}: {error}");
            let recording = parse(&cut(&without_wheels, skip)).expect("nothing else is wrong with it");
            let error = run(&recording).expect_err(&place);
            assert!(matches!(error, ReplayError::StartsMoving { line: 301, .. }), "{place}: {error}");
            let start =
                "drive.csv: starts moving: line 301: the vehicle moves during static initialisation: ";
            assert!(error.to_string().starts_with(start), "{error}");
        }
    }
}

//! Recordings that must not be evaluated: each is refused with its own error, and the message
//! names file, line and column.

use gyronet::model::{Blob, GyroNet, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet_host_tests::recordings;
use gyronet_tools::bundled::SIMULATED_DRIVE;
use gyronet_tools::drive::error::{DataError, DataFault, ValueError};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::{Replay, ReplayError};

fn parse(text: &str) -> Result<Recording, DataError> {
    Recording::parse("drive.csv", text.as_bytes())
}

/// The first rows of the simulated drive, one field of one line (the header is line 1) replaced.
fn with(rows: usize, line: usize, column: &str, field: &str) -> String {
    let header: Vec<&str> = SIMULATED_DRIVE.lines().next().expect("a header").split(',').collect();
    let at = header.iter().position(|name| *name == column).expect("a column of the drive");
    let edit = |(k, text): (usize, &str)| {
        let mut fields: Vec<&str> = text.split(',').collect();
        if k + 1 == line {
            fields[at] = field;
        }
        fields.join(",") + "\n"
    };
    SIMULATED_DRIVE.lines().take(rows + 1).enumerate().map(edit).collect()
}

/// A recording with its first `skip` rows cut off.
fn cut(text: &str, skip: usize) -> String {
    let (header, rows) = text.split_once('\n').expect("a header");
    let rows: Vec<&str> = rows.lines().skip(skip).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn run(recording: &Recording) -> Result<Replay, ReplayError> {
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    Replay::run(recording, &PipelineConfig::DEFAULT, None, &mut GyroNet::new(blob), || {})
}

#[test]
fn the_drive_itself_is_good() {
    let recording = parse(SIMULATED_DRIVE).expect("it is bundled");
    assert_eq!(run(&recording).expect("it stands first").steps.len(), recording.rows.len());
}

#[test]
fn missing_columns_are_named() {
    for missing in ["t_s", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"] {
        let error = parse(&with(400, 1, missing, "other")).expect_err("a column is missing");
        assert!(matches!(error.fault, DataFault::MissingColumn(column) if column == missing), "{error}");
        assert_eq!(error.to_string(), format!("drive.csv: column {missing} is missing"));
    }
    assert!(matches!(parse(""), Err(DataError { fault: DataFault::Empty, .. })));
}

#[test]
fn fields_that_are_no_reading_are_named() {
    for (field, expected, text) in [
        ("fast", ValueError::NotANumber, "not a number"),
        ("1,5", ValueError::NotANumber, ""),
        ("0x10", ValueError::NotANumber, "not a number"),
        ("NaN", ValueError::NotFinite, "not finite"),
        ("-inf", ValueError::NotFinite, "not finite"),
        ("1e9", ValueError::OutOfRange, "out of range"),
        ("", ValueError::Empty, "empty"),
    ] {
        let error = parse(&with(400, 123, "gyr_z", field)).expect_err("it is no reading");
        if field == "1,5" {
            // A decimal comma is a field too many.
            assert!(
                matches!(error, DataError { line: Some(123), fault: DataFault::Fields { .. }, .. }),
                "{error}"
            );
            continue;
        }
        assert!(matches!(error.fault, DataFault::Value { error, .. } if error == expected), "{error}");
        assert_eq!(error.to_string(), format!("drive.csv: line 123, column gyr_z: {field:?} is {text}"));
    }
}

#[test]
fn time_that_does_not_rise_is_refused() {
    for (field, text) in [
        ("1.00", "drive.csv: line 123: time goes backwards from 1.2000 s to 1.0000 s"),
        ("1.20", "drive.csv: line 123: time goes nowhere from 1.2000 s to 1.2000 s"),
    ] {
        let error = parse(&with(400, 123, "t_s", field)).expect_err("time does not rise");
        assert!(matches!(error, DataError { line: Some(123), fault: DataFault::Time { .. }, .. }), "{error}");
        assert_eq!(error.to_string(), text);
    }
}

#[test]
fn less_than_three_seconds_are_refused() {
    let error = parse(&with(299, 1, "t_s", "t_s")).expect_err("2.99 s are too short");
    assert!(matches!(error.fault, DataFault::TooShort { .. }), "{error}");
    assert_eq!(error.to_string(), "drive.csv: is 2.99 s long, static initialisation alone needs 3 s");
    assert!(parse(&with(300, 1, "t_s", "t_s")).is_ok());
    assert!(matches!(parse(&with(0, 1, "t_s", "t_s")), Err(DataError { fault: DataFault::Empty, .. })));
}

#[test]
fn a_simulated_drive_that_starts_moving_is_refused() {
    // With its wheel rates the recording itself is refused.
    let error = parse(&cut(SIMULATED_DRIVE, 2_000)).expect_err("the car drives");
    assert!(matches!(error.fault, DataFault::Moving { .. }), "{error}");
    assert!(error.to_string().starts_with("drive.csv: starts moving: line "), "{error}");
}

/// Real trials, cut in the middle of the drive: refused by their wheels, and by static
/// initialisation where no wheel was recorded.
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

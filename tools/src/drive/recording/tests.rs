//! These tests provoke each typed error with a suitable recording.

use super::*;
use crate::drive::error::{DataError, DataFault};
use crate::drive::stream::Recording;
use std::fmt::Write;

const HEADER: &str = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z,wheel1_rate,wheel3_rate,remark";

/// Returns the recording of a car that stands still; `edit` may change a line before it is written (line 2 is the
/// first).
fn standing(rows: usize, edit: impl Fn(usize, String) -> String) -> String {
    let mut text = format!("{HEADER}\n");
    for k in 0..rows {
        let row = format!("{:.6},0.1,-0.2,9.8,0.001,0.002,0.003,0.0005,0.01,,x", 12.0 + 0.01 * k as f64);
        writeln!(text, "{}", edit(k + 2, row)).unwrap();
    }
    text
}

fn unedited(rows: usize) -> String {
    standing(rows, |_, row| row)
}

fn parse(text: &str) -> Result<Recording, DataError> {
    Recording::parse("drives/a.csv", text.as_bytes())
}

#[test]
fn reads_what_is_there() {
    let recording = parse(&unedited(400)).unwrap();
    assert_eq!(recording.rows.len(), 400);
    assert_eq!(recording.missing, 0);
    assert!((recording.facts().seconds() - 4.0).abs() < 1e-9);
    let row = recording.rows[1];
    assert_eq!(row.line, 3);
    assert_eq!(row.sample.time.0, 12_010_000);
    assert_eq!(row.sample.angular_rate[2].0, (0.003f32 * 134_217_728.0).round() as i32);
    assert_eq!(row.sample.specific_force[1].0, (-0.2f32 * 1_048_576.0).round() as i32);
    assert_eq!(row.wheels, [Some(0.01), None, None, None]);
}

#[test]
fn the_bias_of_a_reference_shows_at_rest() {
    // From the sixth second the car turns by 0.1 rad/s, with wheels that are reported half a second late.
    let text = |wheel: &str| {
        let turning = |row: String| row.replacen(",0.0005,", ",0.1005,", 1);
        standing(1000, |line, row| match line {
            0..500 => row,
            500..550 => turning(row),
            _ => turning(row).replacen(",0.01,,", wheel, 1),
        })
    };
    let recording = parse(&text(",20.0,,")).unwrap();
    let rate = |row: usize| recording.rows[row].reference.unwrap();
    assert!(rate(0).abs() < 1e-9 && (rate(900) - 0.1).abs() < 1e-9, "{} {}", rate(0), rate(900));
    // Without wheels nothing shows that the car stands.
    let text = text(",,,").replace(",0.01,,", ",,,");
    assert_eq!(parse(&text).unwrap().rows[0].reference, Some(0.0005));
}

#[test]
fn columns_go_by_name_in_any_order() {
    let mut text = String::from("\u{feff}gyr_z, gyr_y ,gyr_x,acc_z,acc_y,acc_x,t_s\r\n");
    for k in 0..300 {
        write!(text, "3,2,1,6,5, 4 ,{:.2}\r\n", 0.01 * f64::from(k)).unwrap();
    }
    let row = parse(&text).unwrap().rows[0];
    assert_eq!(row.sample.angular_rate.map(|rate| rate.rad_per_sec()), [1.0, 2.0, 3.0]);
    assert_eq!(row.sample.specific_force.map(|force| force.metre_per_sec2()), [4.0, 5.0, 6.0]);
    assert_eq!(row.reference, None);
}

#[test]
fn a_missing_column_is_named() {
    for column in ["t_s", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"] {
        let text = unedited(400).replacen(column, "other", 1);
        let error = parse(&text).unwrap_err();
        let error = error.to_string();
        assert!(error.starts_with(&format!("drives/a.csv: column {column} is missing (")), "{error}");
    }
}

#[test]
fn a_bad_row_is_named_with_line_column_and_text() {
    let deg = "\"17\" is outside +-16 rad/s: is it deg/s? `gyronet doctor` says what mends it";
    for (line, from, to, expected) in [
        (40, ",0.003,", ",fast,", "line 40, column gyr_z: \"fast\" is not a number"),
        (40, ",0.003,", ",,", "line 40, column gyr_z: \"\" is empty"),
        (40, ",0.003,", ",NaN,", "line 40, column gyr_z: \"NaN\" is not finite"),
        (40, ",0.003,", ",-inf,", "line 40, column gyr_z: \"-inf\" is not finite"),
        (40, ",0.003,", ",1e39,", "line 40, column gyr_z: \"1e39\" is not finite"),
        (40, ",0.003,", ",17,", &format!("line 40, column gyr_z: {deg}")),
        (2, "12.000000", "-1", "line 2, column t_s: \"-1\" is out of range"),
        (7, ",0.01,", ",?,", "line 7, column wheel1_rate: \"?\" is not a number"),
        (7, ",0.0005,", ",nan,", "line 7, column ref_gyr_z: \"nan\" is not finite"),
        (401, ",0.01,,x", "", "line 401: 8 fields, the header has 11"),
        (50, "12.480000", "12.460000", "line 50: time goes backwards from 12.4700 s to 12.4600 s"),
        (50, "12.480000", "12.47", "line 50: time goes nowhere from 12.4700 s to 12.4700 s"),
    ] {
        let text = standing(400, |at, row| if at == line { row.replacen(from, to, 1) } else { row });
        assert_eq!(parse(&text).unwrap_err().to_string(), format!("drives/a.csv: {expected}"));
    }
}

#[test]
fn a_gap_is_counted() {
    let text: String = unedited(400)
        .lines()
        .enumerate()
        .filter(|(k, _)| !(350..357).contains(k))
        .fold(String::new(), |text, (_, line)| text + line + "\n");
    let recording = parse(&text).unwrap();
    assert_eq!((recording.rows.len(), recording.missing), (393, 7));
}

#[test]
fn too_short_says_how_long() {
    assert!(parse(&unedited(300)).is_ok());
    assert_eq!(
        parse(&unedited(299)).unwrap_err().to_string(),
        "drives/a.csv: is 2.99 s long, static initialisation alone needs 3 s"
    );
}

#[test]
fn nothing_at_all() {
    assert!(matches!(parse(""), Err(DataError { fault: DataFault::Empty, .. })));
    assert!(matches!(parse(&unedited(0)), Err(DataError { fault: DataFault::Empty, .. })));
}

#[test]
fn another_rate_is_brought_to_100_hz_or_refused() {
    let drive = |hz: u32| {
        let mut text = String::from("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z\n");
        for k in 0..=4 * hz {
            let (time, rate) = (f64::from(k) / f64::from(hz), if k < 2 * hz { 0.0 } else { 1.0 });
            writeln!(text, "{time:.4},0,0,9.8,0,0,{rate},{rate}").unwrap();
        }
        parse(&text)
    };
    for hz in [50, 83, 95, 104, 120, 400, 1000] {
        let rows = drive(hz).unwrap().rows;
        assert!((395..=401).contains(&rows.len()), "{hz} Hz: {} rows", rows.len());
        assert!(rows.windows(2).all(|pair| pair[1].sample.time.0 - pair[0].sample.time.0 <= 20_000));
        let turned: f64 = rows.iter().map(|row| row.sample.angular_rate[2].rad_per_sec() * 0.01).sum();
        assert!((turned - 2.0).abs() < 0.021, "{hz} Hz: {turned} rad");
        let off = |row: &Row| (row.reference.unwrap() - row.sample.angular_rate[2].rad_per_sec()).abs();
        assert!(rows.iter().all(|row| off(row) < 1e-6));
    }
    let error = |hz| drive(hz).unwrap_err().to_string();
    assert_eq!(error(40), "drives/a.csv: is sampled at 40.0 Hz, should be 50 to 1000 Hz");
    assert_eq!(error(2_000), "drives/a.csv: is sampled at 2000.0 Hz, should be 50 to 1000 Hz");
}

#[test]
fn a_turning_wheel_is_named() {
    let text = standing(400, |at, row| if at >= 250 { row.replacen(",,x", ",-2.5,x", 1) } else { row });
    assert_eq!(
        parse(&text).unwrap_err().to_string(),
        "drives/a.csv: starts moving: line 250, wheel 3 turns at -2.50 rad/s in the first 3 s; `gyronet doctor` looks for a later rest"
    );
    let later = standing(400, |at, row| if at >= 302 { row.replacen(",,x", ",-2.5,x", 1) } else { row });
    assert!(parse(&later).is_ok());
}

#[test]
fn an_unreadable_file_is_named() {
    let error = Recording::read(Path::new("no/such/drive.csv")).unwrap_err();
    assert!(error.to_string().starts_with("no/such/drive.csv: "), "{error}");
    assert!(matches!(error.fault, DataFault::Io(_)));
}

#[test]
fn bytes_that_are_no_text() {
    let mut bytes = unedited(400).into_bytes();
    let at = bytes.len() - 2;
    bytes[at] = 0xFF;
    assert!(matches!(Recording::parse("a", &bytes[..]), Err(DataError { fault: DataFault::Csv(_), .. })));
}

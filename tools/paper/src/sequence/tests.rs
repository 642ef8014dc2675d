use super::summary::EARLY_S;
use super::*;
use crate::simulate;
use tempfile::{TempDir, tempdir};

struct Scratch(TempDir);

impl Scratch {
    fn new(name: &str, seconds: u32) -> Self {
        let folder = tempdir().unwrap();
        let spec = Spec { name: name.into(), seconds, device: 1, run: 5 };
        simulate::write(&spec, folder.path()).unwrap();
        Self(folder)
    }

    fn edit(&self, file: &str, change: impl FnOnce(&mut Vec<String>)) {
        let path = self.0.path().join(file);
        let mut lines: Vec<String> = fs::read_to_string(&path).unwrap().lines().map(Into::into).collect();
        change(&mut lines);
        fs::write(path, lines.join("\n") + "\n").unwrap();
    }

    fn read(&self) -> Result<Sequence, DataError> {
        Sequence::read(self.0.path())
    }

    fn error(&self) -> String {
        self.read().unwrap_err().to_string()
    }
}

const FOG: &str = "sensor_data/fog.csv";
const IMU: &str = "sensor_data/xsens_imu.csv";
const ENCODER: &str = "sensor_data/encoder.csv";
const CALIBRATION: &str = "calibration/EncoderParameter.txt";

fn set(line: &mut String, column: usize, to: &str) {
    let mut fields: Vec<&str> = line.split(',').collect();
    fields[column] = to;
    *line = fields.join(",");
}

#[test]
fn kaist_is_read_whole() {
    let scratch = Scratch::new("whole", 60);
    let sequence = scratch.read().unwrap();
    assert!((sequence.seconds() - 60.0).abs() < 0.05, "{}", sequence.seconds());
    assert_eq!(sequence.files.each_ref().map(|file| file.rows), [6_000, 60_000, 6_000, 6_000]);
    assert_eq!(sequence.in_gap, [0; 4]);
    assert!(sequence.start_s > 1.5e9 && sequence.wheel_base == 1.5285);
    assert_eq!(sequence.simulated.as_ref().map(|spec| spec.run), Some(5));
    // The gyro's turn is the sum of its file.
    let text = fs::read_to_string(scratch.0.path().join(FOG)).unwrap();
    let all: f64 = text.lines().map(|l| l.rsplit(',').next().unwrap().parse::<f64>().unwrap()).sum();
    let steps: f64 = sequence.steps.iter().map(|step| step.fog).sum();
    assert!((all - steps).abs() < 2e-4, "but for both ends: {all} {steps}");
    // The truth turns as much as the inertial sensor's gyro, except for bias and noise.
    let truth = sequence.steps[5_900].yaw - sequence.steps[0].yaw;
    let fog: f64 = sequence.steps[1..=5_900].iter().map(|step| step.fog).sum();
    assert!((truth - fog).abs() < 0.01, "{truth} {fog}");
    let gyro: f64 = sequence.steps[1..=5_900].iter().map(|step| f64::from(step.angular_rate[2]) * DT).sum();
    assert!((truth - gyro).abs() < 0.6, "{truth} {gyro}");
    // The wheels roll as far as the vehicle moves.
    let way: f64 = sequence.steps.iter().map(|step| (step.wheels[0] + step.wheels[1]) / 2.0).sum();
    let moved = |pair: &[Step]| {
        (pair[1].position[0] - pair[0].position[0]).hypot(pair[1].position[1] - pair[0].position[1])
    };
    let moved: f64 = sequence.steps.windows(2).map(moved).sum();
    assert!(way > 50.0 && (way / moved - 1.0).abs() < 0.005, "{way} {moved}");
    // Without the marker it is a recorded one, and the heading is the vendor's.
    fs::remove_file(scratch.0.path().join(MARKER)).unwrap();
    let recorded = scratch.read().unwrap();
    assert!(recorded.simulated.is_none());
    let off = |step: &Step| step.vendor_yaw - step.yaw;
    assert!((off(&recorded.steps[900]) - off(&recorded.steps[0])).abs() < 0.1);
}

#[test]
fn it_runs_as_a_recording() {
    let scratch = Scratch::new("recording", 30);
    let sequence = scratch.read().unwrap();
    let recording = sequence.recording();
    assert_eq!(recording.rows.len(), sequence.steps.len());
    let mut csv = Vec::new();
    write_csv(&sequence, &mut csv).unwrap();
    let parsed = Recording::parse("a.csv", csv.as_slice()).unwrap();
    for (a, b) in recording.rows.iter().zip(&parsed.rows) {
        assert_eq!((a.sample, a.reference), (b.sample, b.reference));
    }
}

#[test]
fn a_missing_file_is_named() {
    for file in [IMU, FOG, ENCODER, "global_pose.csv", "calibration/EncoderParameter.txt"] {
        let scratch = Scratch::new("missing", 10);
        fs::remove_file(scratch.0.path().join(file)).unwrap();
        let (error, name) = (scratch.error(), file.split(['_', '.']).next().unwrap());
        assert!(error.contains(name) && error.contains(": No such file"), "{error}");
    }
}

/// A file, an edit of its lines, and what the error says then.
type Case<'a> = (&'a str, &'a dyn Fn(&mut Vec<String>), &'a str);

#[test]
fn what_a_file_must_not_hold_is_named_with_its_place() {
    const POSE: &str = "global_pose.csv";
    let cases: [Case<'_>; 14] = [
        (FOG, &|lines| lines[41].push_str(",0.5"), "fog.csv: line 42: 5 columns, expected 4"),
        (IMU, &|lines| lines[1].push_str(",0.5"), "xsens_imu.csv: line 2: 18 columns, expected 17"),
        // As in the early sequences, which have no gyro.
        (IMU, &|lines| lines[0] = "1,0,0,0,1,0,0,0".into(), "xsens_imu.csv: line 1: 8 columns, expected 17"),
        (
            ENCODER,
            &|lines| set(&mut lines[6], 2, "x7"),
            "encoder.csv: line 7, column 3: \"x7\" is not a number",
        ),
        (ENCODER, &|lines| set(&mut lines[6], 2, ""), "encoder.csv: line 7, column 3: \"\" is empty"),
        (
            FOG,
            &|lines| set(&mut lines[2], 0, "1.5e18"),
            "fog.csv: line 3, column 1: \"1.5e18\" is not a number",
        ),
        (FOG, &|lines| lines.swap(500, 501), "fog.csv: line 502: time goes backwards from 15240"),
        // A stamp that is far off gives no endless grid, and a value beyond sense no NaN.
        (POSE, &|lines| set(&mut lines[900], 0, "9223372036854775807"), "line 901: silent for 76993720"),
        (
            FOG,
            &|lines| set(&mut lines[0], 0, "-9223372036854775808"),
            "line 1, column 1: \"-9223372036854775808\" is out of range",
        ),
        (
            FOG,
            &|lines| set(&mut lines[10], 3, "1.7e308"),
            "fog.csv: line 11, column 4: \"1.7e308\" is out of range",
        ),
        (ENCODER, &|lines| lines.clear(), "encoder.csv: holds no samples"),
        (ENCODER, &|lines| lines.truncate(200), "in common, needed are 4 s"),
        (
            CALIBRATION,
            &|lines| lines[2] = "Encoder left wheel diameter: 0".into(),
            "no usable parameter \"Encoder left wheel diameter\"",
        ),
        (CALIBRATION, &|lines| lines.clear(), "no usable parameter"),
    ];
    for (file, edit, expected) in cases {
        let scratch = Scratch::new("bad", 10);
        scratch.edit(file, edit);
        assert!(scratch.error().contains(expected), "{}", scratch.error());
    }
}

#[test]
fn nan_and_duplicates_are_counted_and_bridged() {
    let scratch = Scratch::new("nan", 20);
    let whole = scratch.read().unwrap();
    scratch.edit("global_pose.csv", |lines| {
        set(&mut lines[99], 4, "nan");
        set(&mut lines[100], 4, "inf");
        let twice = lines[300].clone();
        lines.insert(301, twice);
    });
    let sequence = scratch.read().unwrap();
    let [.., pose] = &sequence.files;
    assert_eq!((pose.not_finite.count, pose.not_finite.first_line), (2, Some(100)));
    assert_eq!((pose.duplicates.count, pose.duplicates.first_line), (1, Some(302)));
    assert_eq!(pose.gaps, 1, "30 ms");
    let text = pose.to_string();
    assert!(text.contains("2 rows with NaN skipped (first: line 100)"), "{text}");
    assert!(text.contains("1 duplicate stamps skipped (first: line 302)"), "{text}");
    assert_eq!(sequence.steps.len(), whole.steps.len());
    // The NaN of the gyro loses no angle: the neighbouring rows contain it.
    scratch.edit(FOG, |lines| set(&mut lines[0], 3, "NaN"));
    assert_eq!(scratch.read().unwrap().files[1].not_finite.count, 1);
}

#[test]
fn a_file_whose_download_stopped_is_remarked() {
    let scratch = Scratch::new("cut", 20);
    let whole = scratch.read().unwrap();
    assert!(whole.files.iter().all(|file| file.ends_early_s < EARLY_S && file.cut.count == 0));
    let path = scratch.0.path().join(FOG);
    let text = fs::read_to_string(&path).unwrap();
    let lines = text[..text.len() / 2].lines().count() as u64;
    fs::write(&path, &text[..text.len() / 2]).unwrap();
    let sequence = scratch.read().unwrap();
    let [_, fog, ..] = &sequence.files;
    assert_eq!((fog.rows, fog.cut.first_line), (lines - 1, Some(lines)));
    let text = fog.to_string();
    let missing = whole.seconds() - sequence.seconds();
    assert!(missing > 9.0 && (fog.ends_early_s - missing).abs() < 0.2, "{} {missing}", fog.ends_early_s);
    assert!(
        text.contains("last line skipped, which is cut") && text.contains("s before the others"),
        "{text}"
    );
}

#[test]
fn an_encoder_reset_is_counted_and_bridged() {
    let scratch = Scratch::new("reset", 60);
    let way = |sequence: &Sequence| sequence.steps.iter().map(|step| step.wheels[0]).sum::<f64>();
    let whole = way(&scratch.read().unwrap());
    scratch.edit(ENCODER, |lines| {
        let first: Vec<i64> = lines[4_000].split(',').skip(1).map(|f| f.parse().unwrap()).collect();
        for line in &mut lines[4_000..] {
            let fields: Vec<i64> = line.split(',').map(|f| f.parse().unwrap()).collect();
            *line = format!("{},{},{}", fields[0], fields[1] - first[0], fields[2] - first[1]);
        }
    });
    let sequence = scratch.read().unwrap();
    let [_, _, encoder, _] = &sequence.files;
    assert_eq!((encoder.resets.count, encoder.resets.first_line), (1, Some(4_001)));
    assert!((way(&sequence) - whole).abs() < 0.05, "{} {whole}", way(&sequence));
}

#[test]
fn a_silent_sensor_is_marked() {
    let scratch = Scratch::new("silent", 20);
    scratch.edit(IMU, |lines| {
        lines.drain(1_000..1_050);
    });
    let sequence = scratch.read().unwrap();
    let marked = sequence.steps.iter().filter(|step| step.imu_gap).count();
    assert!((50..=51).contains(&marked), "{marked}");
    assert_eq!(sequence.in_gap[0], marked as u64);
    assert_eq!(sequence.recording().rows.len(), sequence.steps.len() - marked);
}

#[test]
fn a_folder_that_is_no_sequence() {
    let empty = tempdir().unwrap();
    for error in [Sequence::read(empty.path()).err(), find(empty.path()).err()] {
        let error = error.expect("an empty folder").to_string();
        assert!(error.contains("no KAIST Urban sequence"), "{error}");
    }
}

#[test]
fn a_training_drive_has_no_step_in_a_gap_and_no_start_on_the_move() {
    let scratch = tempdir().unwrap();
    let folder = scratch.path().join("urban06");
    let spec = Spec { name: "urban06".into(), seconds: 60, device: 1, run: 1 };
    simulate::write(&spec, &folder).unwrap();
    let steps = Sequence::read(&folder).unwrap().steps.len();
    let path = folder.join("sensor_data/encoder.csv");
    let rows: Vec<String> = fs::read_to_string(&path).unwrap().lines().map(str::to_owned).collect();
    let (stamp, _) = rows[1000].split_once(',').unwrap();
    let odd = format!("{stamp},nan,nan");
    // Half a second without wheels, a row that is not a number, and a repeated row.
    let cut = [&rows[..1000], &[odd], &rows[1001..2000], &rows[1999..2000], &rows[2050..]].concat();
    fs::write(&path, cut.join("\n")).unwrap();
    let sequence = Sequence::read(&folder).unwrap();
    sequence.needs_standstill().unwrap();
    assert_eq!(
        (sequence.steps.len(), sequence.files[2].duplicates.count, sequence.files[2].not_finite.count),
        (steps, 1, 1)
    );
    let whole = write_whole(&sequence, std::io::sink()).unwrap() as usize;
    assert!((steps - 53..=steps - 48).contains(&whole), "{whole} of {steps}");
    assert_eq!(write_csv(&sequence, std::io::sink()).unwrap() as usize, steps);
    let count = |row: &str| row.split(',').nth(1).unwrap().parse::<f64>().unwrap();
    // The file now begins where the wheel has turned ten times: the vehicle is driving.
    let driving = rows.iter().position(|row| (count(row) - count(&rows[0])).abs() > 40_960.0).unwrap();
    fs::write(&path, rows[driving..].join("\n")).unwrap();
    let error = Sequence::read(&folder).unwrap().needs_standstill().unwrap_err().to_string();
    assert!(error.contains("urban06: starts moving: its wheels roll"), "{error}");
}

//! Logs of other people's tools read as the reference readers in Python read them, value by value, and imported or refused
//! with the reason.

use crate::imported::{Imported, import};
use gyronet_host_tests::recordings::{folder, workspace};
use gyronet_host_tests::require::{Need, python, wants};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::vehicle::{Columns, Vehicle};
use gyronet_tools::import::can::Bus;
use gyronet_tools::import::drive::Request;
use gyronet_tools::import::log::Log;
use gyronet_tools::import::value::{Sample, Value};
use gyronet_tools::import::{read_bytes, read_file};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The packages of the reference readers.
const READERS: [&str; 5] = ["rosbags", "mcap", "pyulog", "can", "cantools"];
/// Byte signals of the messages in the logs of CAN.
const DBC: &str = r#"VERSION ""
NS_ :
BS_:
BU_: X
BO_ 2565603072 Transport: 8 X
 SG_ Packet : 0|8@1+ (1,0) [0|255] "" X
 SG_ Word : 15|16@0- (0.5,-3) [0|0] "" X
 SG_ Last : 43|13@1- (0.01,0) [0|0] "m/s" X
BO_ 1785 Small: 8 X
 SG_ First : 0|12@1+ (1,0) [0|0] "" X
BO_ 2147483904 Zero: 8 X
 SG_ Value : 3|9@1+ (2,1) [0|0] "" X
"#;

fn log_file(test: &str, name: &str) -> Option<PathBuf> {
    let path = folder().join("logs").join(name);
    let found = if path.is_file() { Ok(path) } else { Err(format!("no {}", path.display())) };
    wants(test, Need::Data, found)
}

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("import_logs");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

/// The values that the reference reader gives, by channel.
fn reference(python: &str, path: &Path, dbc: Option<&Path>) -> BTreeMap<String, Vec<Vec<f64>>> {
    let script = workspace().join("host-tests/tests/clients/read_log.py");
    let output = Command::new(python).arg(script).arg(path).args(dbc).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut channels: BTreeMap<String, Vec<Vec<f64>>> = BTreeMap::new();
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let (name, numbers) = line.split_once(' ').unwrap();
        let numbers = numbers.split(' ').map(|number| number.parse().unwrap()).collect();
        channels.entry(name.to_owned()).or_default().push(numbers);
    }
    channels
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Imu(force, rate) => force.iter().chain(rate).copied().collect(),
        Value::Odometry(speed, rate) => vec![*speed, *rate],
        Value::Position(fix) => fix.degrees.to_vec(),
        Value::Number(number) => vec![*number],
    }
}

/// Returns the samples of each channel. A second bus stands apart in a log, which python-can leaves to its user.
fn channels(log: &Log) -> BTreeMap<String, Vec<Sample>> {
    let mut channels: BTreeMap<String, Vec<Sample>> = BTreeMap::new();
    for (name, samples) in &log.channels {
        let name = name.split('@').next().unwrap().to_owned();
        channels.entry(name).or_default().extend(samples);
    }
    channels
}

/// Every value that the reference has and that comes in rising order of time is in the log, and no others.
fn assert_same(log: &Log, reference: &BTreeMap<String, Vec<Vec<f64>>>, from_first: bool) -> usize {
    let channels = channels(log);
    assert_eq!(channels.keys().collect::<Vec<_>>(), reference.keys().collect::<Vec<_>>());
    let start = channels.values().flatten().map(|(seconds, _)| *seconds).fold(f64::INFINITY, f64::min);
    let start = if from_first { start } else { 0.0 };
    let mut compared = 0;
    for (name, samples) in &channels {
        let mut last = f64::NEG_INFINITY;
        let rising = reference[name].iter().filter(|row| {
            let rises = row[0] > last;
            last = last.max(row[0]);
            rises
        });
        let rising: Vec<_> = rising.collect();
        assert_eq!(samples.len(), rising.len(), "{name}");
        for ((seconds, value), row) in samples.iter().zip(rising) {
            assert!((seconds - start - row[0]).abs() < 2e-6, "{name}: {seconds} {row:?}");
            let values = numbers(value);
            assert_eq!(values.len(), row.len() - 1);
            for (ours, theirs) in values.iter().zip(&row[1..]) {
                assert!((ours - theirs).abs() <= 1e-9 * theirs.abs().max(1.0), "{name}: {ours} {theirs}");
                compared += 1;
            }
        }
    }
    compared
}

#[test]
fn bags_and_a_ulog_are_read_as_by_rosbags_and_pyulog() {
    let test = "bags_and_a_ulog_are_read_as_by_rosbags_and_pyulog";
    let Some(python) = python(test, &READERS) else { return };
    for (name, least) in
        [("jackal.bag", 24_000), ("xsens_wheels_stereo.bag", 160_000), ("px4_sample_log_small.ulg", 7_800)]
    {
        let Some(path) = log_file(test, name) else { return };
        let log = read_file(&path, None, &Columns::new()).unwrap();
        let compared = assert_same(&log, &reference(&python, &path, None), false);
        assert!(compared >= least, "{name}: {compared}");
    }
}

#[test]
fn can_logs_are_read_as_by_python_can_and_cantools() {
    let test = "can_logs_are_read_as_by_python_can_and_cantools";
    let Some(python) = python(test, &READERS) else { return };
    let dbc = scratch("bytes.dbc");
    std::fs::write(&dbc, DBC).unwrap();
    let bus = Bus::parse("bytes.dbc", DBC).unwrap();
    for (name, least) in [("logfile.asc", 13), ("test_CanMessage_V2_1.trc", 7)] {
        let Some(path) = log_file(test, name) else { return };
        let log = read_file(&path, Some(&bus), &Columns::new()).unwrap();
        let compared = assert_same(&log, &reference(&python, &path, Some(&dbc)), true);
        assert!(compared >= least, "{name}: {compared} {log:?}");
    }
    // Its two frames have an identifier of 27 bits that is marked as one of 11: no DBC file can name it.
    let Some(path) = log_file(test, "test_CanMessage.blf") else { return };
    let log = read_file(&path, Some(&bus), &Columns::new()).unwrap();
    assert_eq!(log.passed_over["CAN message that is not in the DBC file"], 2);
    assert!(log.dropped.is_empty(), "{:?}", log.dropped);
}

fn request(files: &[&Path], toml: &str) -> Request {
    Request {
        files: files.iter().map(|path| path.to_path_buf()).collect(),
        vehicle: Vehicle::parse("vehicle.toml", toml).unwrap(),
        ..Request::default()
    }
}

fn message(request: &Request) -> String {
    import(request).unwrap_err().to_string()
}

#[test]
fn every_log_is_imported_or_refused_for_a_reason() {
    let test = "every_log_is_imported_or_refused_for_a_reason";
    let names = ["jackal.bag", "xsens_wheels_stereo.bag", "px4_sample_log_small.ulg"];
    let Some(files) = names.iter().map(|name| log_file(test, name)).collect::<Option<Vec<_>>>() else {
        return;
    };

    let Imported { rows, dropped, report, .. } = import(&request(&[&files[0]], "")).unwrap();
    assert_eq!((rows.len(), dropped), (6_121, 0), "{report:?}");
    assert!(rows.iter().filter(|row| row.wheels[1].is_some()).count() > 6_000);
    assert!(report.iter().any(|line| line.contains("50.0 Hz to 100 Hz: linear interpolation")), "{report:?}");

    // Two channels are IMUs, and two odometries; one of the former never moves.
    let ambiguous = message(&request(&[&files[1]], ""));
    assert!(ambiguous.contains("several channels fit as imu"), "{ambiguous}");
    assert!(ambiguous.contains("/my_odometry2imu/imu_data (IMU, "), "{ambiguous}");
    let named = "signals = { imu = '/xsens/imu_data', odometry = '/wheel_odometry' }";
    let Imported { rows, .. } = import(&request(&[&files[1]], named)).unwrap();
    assert!((13_200..13_300).contains(&rows.len()), "{}", rows.len());
    let unknown = message(&request(&[&files[1]], "signals = { imu = '/imu' }"));
    assert!(unknown.starts_with("no channel /imu for imu; there are /my_odometry2imu/imu_data"), "{unknown}");

    let Imported { rows, report, .. } = import(&request(&[&files[2]], "")).unwrap();
    assert!((600..=655).contains(&rows.len()), "{}", rows.len());
    assert!(report.iter().any(|line| line.contains("mean of the samples within 5 ms")), "{report:?}");
    // The aircraft stands: gravity is upwards.
    let up = rows.iter().map(|row| row.imu[2]).sum::<f64>() / rows.len() as f64;
    assert!((9.5..10.1).contains(&up), "{up}");

    for name in ["logfile.asc", "test_CanMessage.blf", "test_CanMessage_V2_1.trc"] {
        let Some(path) = log_file(test, name) else { return };
        assert_eq!(message(&request(&[&path], "")), "no IMU in the files");
    }
}

/// A DBC file with the four wheels.
const WHEELS: &str = r#"VERSION ""
NS_ :
BS_:
BU_: ESP
BO_ 1200 WHEELS: 8 ESP
 SG_ FL : 0|16@1+ (0.01,0) [0|655] "km/h" ESP
 SG_ FR : 16|16@1+ (0.01,0) [0|655] "km/h" ESP
 SG_ RL : 39|16@0+ (0.01,0) [0|655] "km/h" ESP
 SG_ RR : 55|16@0+ (0.01,0) [0|655] "km/h" ESP
"#;
const VEHICLE: &str = "[wheels]\nradius_m = 0.3\ntrack_m = 1.5\nfront_left = 'WHEELS.FL'\nfront_right = 'WHEELS.FR'\n\
                       rear_left = 'WHEELS.RL'\nrear_right = 'WHEELS.RR'\n";

#[test]
fn a_bag_and_a_bus_log_on_another_clock_become_one_drive() {
    let test = "a_bag_and_a_bus_log_on_another_clock_become_one_drive";
    let Some(python) = python(test, &READERS) else { return };
    let dbc = scratch("wheels.dbc");
    std::fs::write(&dbc, WHEELS).unwrap();
    let drive = workspace().join("tools/data/simulated_drive.csv");
    let script = workspace().join("host-tests/tests/clients/make_logs.py");
    let made = Command::new(&python).args([&script, &drive, &dbc, dbc.parent().unwrap()]).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));

    let mcap = scratch("drive.mcap");
    let log = read_file(&mcap, None, &Columns::new()).unwrap();
    assert_eq!(assert_same(&log, &reference(&python, &mcap, None), false), 9_000 * 6);

    let bus = Bus::parse("wheels.dbc", WHEELS).unwrap();
    for name in ["bus.blf", "bus.log", "bus.asc", "bus.trc"] {
        let log = read_file(&scratch(name), Some(&bus), &Columns::new()).unwrap();
        let compared = assert_same(&log, &reference(&python, &scratch(name), Some(&dbc)), true);
        assert_eq!(compared, 4_200 * 4, "{name}");
        assert!(log.dropped.is_empty(), "{name}: {:?}", log.dropped);
    }

    let vehicle = format!("{VEHICLE}[bus]\ndbc = '{}'\n", dbc.display());
    let truth = Recording::read(&drive).unwrap();
    for imu in [scratch("drive.bag"), mcap] {
        let Imported { rows, report, dropped } =
            import(&request(&[&imu, &scratch("bus.blf")], &vehicle)).unwrap();
        assert_eq!((rows.len(), dropped), (9_000, 0), "{report:?}");
        let moved = report.iter().find(|line| line.contains("clock moved by")).unwrap();
        let by: f64 = moved.split("moved by ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((by + 86_404.321).abs() < 0.02, "{moved}");
        let mut worst = 0.0f64;
        for (row, truth) in rows.iter().zip(&truth.rows) {
            assert!((row.imu[5] - truth.sample.angular_rate[2].rad_per_sec()).abs() < 1e-5);
            if (6.5..89.9).contains(&row.seconds) {
                for (ours, theirs) in row.wheels.iter().zip(truth.wheels) {
                    worst = worst.max((ours.expect("a wheel") - theirs.unwrap().abs()).abs());
                }
            }
        }
        // 20 ms between frames, and some milliseconds of clock, at up to 0.3 g.
        assert!(worst < 0.6, "{worst} rad/s");
        assert!(rows[..500].iter().all(|row| row.wheels == [None; 4]), "before the bus log begins");
    }

    let missing = format!("{}[bus]\ndbc = '{}'\n", VEHICLE.replace("WHEELS.RL", "WHEELS.XL"), dbc.display());
    let missing = message(&request(&[&scratch("drive.bag"), &scratch("bus.blf")], &missing));
    assert!(
        missing.starts_with("no channel WHEELS.XL for a wheel; there are WHEELS.FL (signal, 50.0 Hz)"),
        "{missing}"
    );
    // A BLF file with its end torn off.
    let bytes = std::fs::read(scratch("bus.blf")).unwrap();
    let cut = read_bytes("bus.blf", &bytes[..bytes.len() - 1_000], Some(&bus), &Columns::new()).unwrap();
    assert!(cut.dropped.contains_key("the file ends within an object"), "{:?}", cut.dropped);
}

#[test]
fn damaged_bags_keep_what_could_be_read() {
    let test = "damaged_bags_keep_what_could_be_read";
    let Some(path) = log_file(test, "jackal.bag") else { return };
    let bytes = std::fs::read(path).unwrap();
    let read = |bytes: &[u8]| read_bytes("a.bag", bytes, None, &Columns::new()).unwrap();
    let whole = read(&bytes).channels["/imu/data"].len();
    let cut = read(&bytes[..bytes.len() / 2]);
    let kept = cut.channels["/imu/data"].len();
    assert!(kept > whole / 4 && kept < whole, "{kept} of {whole}");
    assert_eq!(cut.dropped["the file ends within a record"], 1);
    // One damaged chunk costs its own messages.
    let mut damaged = bytes.clone();
    damaged[150_000..150_064].fill(0xAA);
    let damaged = read(&damaged);
    assert_eq!(damaged.dropped["chunks: corrupt compressed data"], 1, "{:?}", damaged.dropped);
    assert!(damaged.channels["/imu/data"].len() > whole / 2);
}

#[test]
fn formats_that_are_not_read_name_the_way_out() {
    let read = |bytes: &[u8]| read_bytes("a", bytes, None, &Columns::new()).unwrap_err().to_string();
    assert!(
        read(b"SQLite format 3\0....")
            .contains("rosbags-convert --src FOLDER --dst CONVERTED --dst-storage mcap")
    );
    assert!(read(b"MDF     4.10    ").contains("pip install asammdf && python3 -c"));
    assert!(read(b"#ROSBAG V1.2\n").contains("rosbag fix"));
    assert_eq!(read(b""), "a: is empty");
    assert!(read(&[0xFF; 300]).contains("unknown format"));
}

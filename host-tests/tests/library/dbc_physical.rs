//! Every signal that has a unit, in that unit, as cantools reads it by `tools/gyronet.dbc`: a factor or an
//! offset of the file that is not the codec's shows as a number other than the one that was put in.

use can_dbc::Dbc;
use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::can::config::{Config, Settings, Vdc2Settings};
use gyronet::can::encoder::CanEncoder;
use gyronet::can::fog_encoder::FogEncoder;
use gyronet::can::status::{STATUS_ID, SlowStatus, StatusEncoder};
use gyronet::can::yaw::FOG_IDS;
use gyronet::estimate::{VehicleSample, YawEstimate};
use gyronet::health::{Faults, Quality, Source};
use gyronet::units::{AngularRate, CentiCelsius, Yaw};
use gyronet_host_tests::require;
use gyronet_host_tests::synthetic::{force, rate};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

const DBC: &str = include_str!("../../../tools/gyronet.dbc");
const FOLDER: &str = env!("CARGO_MANIFEST_DIR");

/// A message, a signal, the value that was put in, and the least step of the signal.
type Expected = (&'static str, &'static str, f64, f64);

/// The frames of one sample in round numbers, of the board's and of the fibre-optic gyro's messages.
fn frames() -> Vec<DataFrame> {
    let deg = |deg_per_sec: f64| rate(deg_per_sec.to_radians());
    let angle =
        |deg: f64| Yaw((deg.to_radians() * f64::from(AngularRate::PER_RAD_PER_SEC) * 100.0).round() as i64);
    let yaw = |sign: f64| YawEstimate {
        rate: deg(sign * -7.654_321),
        correction: deg(sign * 0.1234),
        yaw: angle(sign * 123.456),
        sigma: Some(deg(0.012_34)),
        source: Source::GyroNet,
        quality: Quality::Good,
        faults: Faults::NONE,
        latency_us: Some(70_000),
        ..YawEstimate::default()
    };
    let sample = VehicleSample {
        prompt: YawEstimate { rate: deg(12.34), quality: Quality::Good, ..YawEstimate::default() },
        navigation: yaw(1.0),
        roll_rate: deg(1.5),
        pitch_rate: deg(-2.5),
        specific_force: [force(1.0), force(-2.0), force(9.806_65)],
        temperature: Some(CentiCelsius(3_100)),
        tick: 5,
    };
    let settings = Settings { vdc2: Some(Vdc2Settings { source: 0x80 }), ..Settings::DEFAULT };
    let mut encoder = CanEncoder::new(Config::new(settings).expect("checked"));
    let mut frames: Vec<DataFrame> = encoder.encode(&sample).iter().copied().collect();
    FogEncoder::new(FOG_IDS).send(&yaw(-1.0), |frame| frames.push(frame));
    frames.extend(StatusEncoder::new(STATUS_ID).and_then(|mut encoder| encoder.frame(SlowStatus::default)));
    frames
}

/// The values in the signals' units, written from the sample above and the conventions of the messages:
/// the Bosch part's roll rate is against the right-hand rule, its forces are in g.
const EXPECTED: [Expected; 22] = [
    ("MM5_10_TX1", "YawRate", 12.34, 0.005),
    ("MM5_10_TX1", "TEMP", 31.0, 1.0),
    ("MM5_10_TX1", "AY", -2.0 / 9.806_65, 1.274_65e-4),
    ("MM5_10_TX2", "RollRate", -1.5, 0.005),
    ("MM5_10_TX2", "AX", 1.0 / 9.806_65, 1.274_65e-4),
    ("MM5_10_TX3", "PitchRate", -2.5, 0.005),
    ("MM5_10_TX3", "AZ", 1.0, 1.274_65e-4),
    ("GyroNet_Rate", "Rate", -7.654_321, 1e-6),
    ("GyroNet_Angle", "Yaw", 123.456, 8.4e-8),
    ("GyroNet_Detail", "Correction", 0.1234, 2e-4),
    // Rounded up: 0.01234 or 0.01235, as f32 takes the one for a little more.
    ("GyroNet_Detail", "ExpectedError", 0.012_345, 1e-5),
    ("GyroNet_Detail", "Latency", 70.0, 0.5),
    // Not available.
    ("GyroNet_Status", "YawDoubt", 655.35, 0.01),
    ("GyroNet_FogRate", "Rate", 7.654_321, 1e-6),
    ("GyroNet_FogAngle", "Yaw", -123.456, 8.4e-8),
    ("GyroNet_FogDetail", "Correction", -0.1234, 2e-4),
    ("GyroNet_FogDetail", "ExpectedError", 0.012_345, 1e-5),
    ("GyroNet_FogDetail", "Latency", 70.0, 0.5),
    // 12.34 deg/s.
    ("VDC2", "YawRate_VDC2", 0.215_373_6, 1.0 / 8192.0),
    ("VDC2", "LateralAccel", -2.0, 1.0 / 2048.0),
    ("VDC2", "LongitudinalAccel", 1.0, 0.1),
    // Not available: 0xFFFF of 2^-10 rad from -31.374.
    ("VDC2", "SteerWhlAngle", 32.625, 2e-3),
];

#[test]
fn no_signal_with_a_unit_is_left_out() {
    let dbc = Dbc::try_from(DBC).expect("a DBC file");
    let of_file: BTreeSet<_> = dbc
        .messages
        .iter()
        .flat_map(|message| message.signals.iter().map(move |signal| (message, signal)))
        .filter(|(_, signal)| !signal.unit.is_empty())
        .map(|(message, signal)| (message.name.as_str(), signal.name.as_str()))
        .collect();
    let expected: BTreeSet<_> = EXPECTED.iter().map(|(message, signal, ..)| (*message, *signal)).collect();
    assert_eq!(of_file, expected);
}

#[test]
fn cantools_reads_what_was_put_in() {
    let Some(python) = require::python("cantools_reads_what_was_put_in", &["cantools"]) else { return };
    let mut client = Command::new(python)
        .arg(Path::new(FOLDER).join("tests/clients/decode.py"))
        .arg(Path::new(FOLDER).join("../tools/gyronet.dbc"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python runs");
    let mut input = client.stdin.take().expect("a pipe");
    for frame in frames() {
        let id = match frame.id() {
            Id::Standard(id) => u32::from(id.as_raw()),
            Id::Extended(id) => id.as_raw(),
        };
        let data: String = frame.data().iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(input, "{id:x} {data}").expect("it reads");
    }
    drop(input);
    let output = client.wait_with_output().expect("it ends");
    assert!(output.status.success());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let read: BTreeMap<(&str, &str), f64> = text
        .lines()
        .map(|line| {
            let [message, signal, value] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("{line}") };
            ((message, signal), value.parse().expect("a number"))
        })
        .collect();
    for (message, signal, expected, step) in EXPECTED {
        let found = read[&(message, signal)];
        println!("{message}.{signal}: {found}, {expected} was put in");
        assert!((found - expected).abs() <= 0.51 * step, "{message}.{signal} is {found}, not {expected}");
    }
}

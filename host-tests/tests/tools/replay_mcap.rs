//! The MCAP of a replayed drive opens in the reference reader, fits its own schemas, and has the frames of the log.

use gyronet::coprocessor::Config;
use gyronet::model::{Blob, GyroNet, weights};
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::require::python;
use gyronet_tools::board::Board;
use gyronet_tools::bundled;
use gyronet_tools::drive::candump::Log;
use gyronet_tools::drive::foxglove;
use gyronet_tools::drive::replay::Steps;
use gyronet_tools::drive::stream::Drive;
use std::path::Path;
use std::process::Command;

#[test]
fn the_reference_reader_finds_every_frame_and_state() {
    let test = "the_reference_reader_finds_every_frame_and_state";
    let Some(python) = python(test, &["mcap", "lz4"]) else { return };
    let mut recording = bundled::simulated_drive().unwrap();
    recording.rows.truncate(1_500);
    let network = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0).unwrap());
    let drive = Drive::from(&recording);
    let board = Board::new(Config::DEFAULT, drive.wheels(), network);
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("replay.mcap");
    let mut file = foxglove::Recorder::new(std::fs::File::create(&path).unwrap()).unwrap();
    let (mut lines, mut yaw) = (Vec::new(), 0.0);
    let mut log = Log::new(&mut lines);
    for step in Steps::new(&drive, board).unwrap() {
        let step = step.unwrap();
        file.step(&step).unwrap();
        step.frames.iter().for_each(|sent| log.frame(sent.time, &sent.frame).unwrap());
        yaw = step.vehicle.delayed.yaw.rad();
    }
    let messages = file.finish().unwrap();

    let script = workspace().join("host-tests/tests/clients/read_replay.py");
    let output = Command::new(python).arg(script).arg(&path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let counts = read["counts"].as_object().unwrap();
    assert_eq!(counts.values().map(|count| count.as_u64().unwrap()).sum::<u64>(), messages);
    for topic in ["/input gyronet.Input", "/rate gyronet.Rate", "/pose foxglove.PoseInFrame"] {
        assert_eq!(counts[topic], 1_500, "{topic}");
    }
    assert_eq!(
        counts["/status foxglove.Log"].as_u64().unwrap() as usize,
        read["statuses"].as_array().unwrap().len()
    );
    assert_eq!(read["statuses"][0], "init");
    assert!(read["statuses"].as_array().unwrap().iter().any(|status| status == "ready"));
    assert!((read["yaw"].as_f64().unwrap() - yaw).abs() < 1e-12 && yaw != 0.0);
    // Line by line what the log in candump's format has.
    log.finish().unwrap();
    let frames: Vec<&str> =
        read["frames"].as_array().unwrap().iter().map(|frame| frame.as_str().unwrap()).collect();
    assert_eq!(frames, String::from_utf8(lines).unwrap().lines().collect::<Vec<_>>());
}

#[test]
fn the_layout_plots_fields_that_the_file_has() {
    let layout: serde_json::Value = serde_json::from_str(foxglove::LAYOUT).unwrap();
    let panels = layout["configById"].as_object().unwrap();
    // Every panel is placed, and every plotted path begins with a topic that is written.
    let placed = layout["layout"].to_string();
    assert!(panels.keys().all(|panel| placed.contains(&format!("\"{panel}\""))));
    let paths = panels.values().flat_map(|panel| panel["paths"].as_array().into_iter().flatten());
    let paths: Vec<&str> = paths.map(|path| path["value"].as_str().unwrap()).collect();
    assert!(paths.len() >= 8);
    let known = ["reference", "live", "delayed", "correction", "sigma", "yaw", "status", "standstill"];
    for path in paths {
        let field = path.strip_prefix("/rate.");
        assert!(
            path == "/input.angular_rate.z" || field.is_some_and(|field| known.contains(&field)),
            "{path}"
        );
    }
}

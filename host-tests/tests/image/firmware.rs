//! The image that is flashed, in QEMU: the same bytes give the same frames as on the host, and
//! as `gyronet replay` makes of the same recording.

use embedded_can::{Frame, Id};
use gyronet::bias::STATIC_SAMPLES;
use gyronet::can::bosch::{SignalStatus, TX1_ID, Tx1};
use gyronet::can::encoder::CanEncoder;
use gyronet::can::{DataFrame, slcan};
use gyronet::model::{Blob, GyroNet, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::recordings::{self, workspace};
use gyronet_host_tests::{image, qemu, replay};
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::target::bench;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// 20 s.
const SAMPLES: usize = 2_000;
/// The time limit for all frames of 20 s: ten times what they take on a busy machine.
const LIMIT: Duration = Duration::from_secs(120);

/// Returns the image, where it can be built and run.
fn coprocessor(test: &str) -> Option<PathBuf> {
    image::coprocessor(test, env!("CARGO_TARGET_TMPDIR"))
}

fn simulated_drive() -> PathBuf {
    workspace().join("tools/data/simulated_drive.csv")
}

/// Returns a recording as an MTi would send it, message by message.
fn messages(recording: &Path) -> Vec<Vec<u8>> {
    let rows = recordings::rows(recording);
    rows.iter().enumerate().map(|(k, row)| replay::message(k, row).emit().to_vec()).collect()
}

/// Returns the frame of a line of SLCAN.
fn frame(line: &[u8]) -> DataFrame {
    slcan::parse(line).expect("a line")
}

/// Sends bytes to the emulated board and compares its lines with the host's.
fn compare(test: &str, elf: &Path, arguments: &[&str], bytes: &[u8]) {
    let mut count = replay::lines(bytes).len();
    let start = Instant::now();
    let mut board = qemu::Board::boot(elf, 2, arguments);
    board.send(1, bytes, LIMIT);
    let (lines, expected, followed) = loop {
        let lines = board.lines(2, b'\r', count, LIMIT);
        let mut host = replay::Board::following(lines.clone());
        host.push(bytes);
        if lines.len() >= host.lines.len() {
            break (lines, host.lines, host.followed as usize);
        }
        count = host.lines.len();
    };
    println!("{test}: {followed} sets because the host was busy");
    // How soon silence is reported is held by `firmware_faults`, and by the virtual board, whose clock waits for the
    // host.
    assert!(followed < SAMPLES / 10, "{followed}");
    // Behind them the board may have reported already that the bytes have ended.
    let lines = &lines[..expected.len()];
    println!("{test}: {} frames from {} bytes in {:.2?}", lines.len(), bytes.len(), start.elapsed());
    replay::assert_same(lines, &expected);
    // All of them are good that come after static initialisation.
    let frames = lines.iter().map(|line| frame(line)).filter(|frame| frame.id() == Id::Standard(TX1_ID));
    let tx1: Vec<Tx1> = frames.map(|frame| Tx1::parse(frame.data()).expect("a good checksum")).collect();
    let good = tx1.iter().filter(|tx1| tx1.yaw_rate_status == SignalStatus::OK);
    assert_eq!(good.count(), tx1.len().saturating_sub(STATIC_SAMPLES as usize + followed), "{test}");
}

/// Checks that the wire and the file give the same frames on the host.
fn wire_against_file(path: &Path) {
    let recording = Recording::read(path).expect("a recording");
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let drive = Replay::run(&recording, &PipelineConfig::DEFAULT, None, &mut GyroNet::new(blob), || {})
        .expect("it stands still first");
    let mut encoder = CanEncoder::new(replay::CONFIG);
    let file: Vec<DataFrame> = drive.steps.iter().flat_map(|step| encoder.encode(&step.vehicle)).collect();
    let wire: Vec<DataFrame> =
        replay::lines(&messages(path).concat()).iter().map(|line| frame(line)).collect();
    assert!(
        file == wire,
        "{}: {} frames from the file, {} from bytes",
        path.display(),
        file.len(),
        wire.len()
    );
}

#[test]
fn replay_of_a_file_equals_its_bytes() {
    wire_against_file(&simulated_drive());
    if let Some(path) = recordings::trial("replay_of_a_file_equals_its_bytes", 11) {
        wire_against_file(&path);
    }
}

#[test]
fn frames_of_a_real_drive_equal_the_hosts() {
    const NAME: &str = "frames_of_a_real_drive_equal_the_hosts";
    let Some(path) = recordings::trial(NAME, 11) else { return };
    let Some(elf) = coprocessor(NAME) else { return };
    compare(NAME, &elf, &[], &messages(&path)[..SAMPLES].concat());
}

#[test]
fn frames_of_the_simulated_drive_equal_the_hosts() {
    const NAME: &str = "frames_of_the_simulated_drive_equal_the_hosts";
    let Some(elf) = coprocessor(NAME) else { return };
    compare(NAME, &elf, &[], &replay::simulated_drive(0..SAMPLES).concat());
}

#[test]
fn frames_of_the_olimex_board_equal_the_hosts() {
    const NAME: &str = "frames_of_the_olimex_board_equal_the_hosts";
    let board = ("olimex-stm32-h405", bench::TARGET);
    let elf = qemu::available(NAME)
        .and_then(|()| image::firmware_for(board, NAME, env!("CARGO_TARGET_TMPDIR"), "coprocessor"));
    let Some(elf) = elf else { return };
    // QEMU has this machine from version 8 on; the other board has the same part, and QEMU models no pins.
    compare(NAME, &elf, &[], &replay::simulated_drive(0..SAMPLES).concat());
}

#[test]
fn garbage_between_messages_changes_no_frame() {
    const NAME: &str = "garbage_between_messages_changes_no_frame";
    let Some(elf) = coprocessor(NAME) else { return };
    let (mut noise, mut bytes) = (Noise::new(12), Vec::new());
    let clean = replay::simulated_drive(0..SAMPLES);
    for frame in &clean {
        let garbage = noise.int(-20, 40).max(0);
        bytes.extend((0..garbage).map(|_| noise.byte()));
        bytes.extend(frame);
    }
    assert!(replay::lines(&bytes) == replay::lines(&clean.concat()), "garbage changes no frame");
    compare(NAME, &elf, &[], &bytes);
}

#[test]
fn a_board_slower_than_its_line_loses_nothing() {
    const NAME: &str = "a_board_slower_than_its_line_loses_nothing";
    let Some(elf) = coprocessor(NAME) else { return };
    // Without chained blocks QEMU is several times slower: with the network at work, bytes come
    // faster than the board does. Its receive queue fills up, and the line must be held, nothing
    // lost.
    let slow = ["-d", "nochain"];
    compare(NAME, &elf, &slow, &replay::simulated_drive(0..900).concat());
}

#[test]
fn a_full_queue_holds_the_line_and_is_counted() {
    const NAME: &str = "a_full_queue_holds_the_line_and_is_counted";
    let Some(elf) = coprocessor(NAME) else { return };
    // With a log of every block (thrown away) the board is slower than its line from the first
    // frame on: 5,400 bytes do not fit its queue.
    let slower = ["-d", "cpu,nochain", "-D", "/dev/null"];
    let mut board = qemu::Board::boot(&elf, qemu::SERVICE, &slower);
    let bytes = replay::simulated_drive(0..100).concat();
    let expected = replay::lines(&bytes);
    board.send(1, &bytes, LIMIT);
    let lines = board.lines(2, b'\r', expected.len(), LIMIT);
    assert!(lines.starts_with(&expected), "the line was held, nothing was lost");
    let counters = board.device(LIMIT).counters().expect("a response");
    println!("{NAME}: {counters:?}");
    assert!(counters.lines.held > 0, "the board says that its queue was full: {counters:?}");
    assert_eq!((counters.inputs.imu_errors, counters.lines.line_errors), (0, 0));
}

//! Faults of the sensors and noise on their lines: the inertial sensor's frames are the host's, byte for byte, and the
//! faults are reported as long as they last.

use crate::common::{self, IMU, SAMPLE, SERVICE, START};
use embedded_can::{Frame, Id};
use gyronet::can::bosch::{Message, SignalStatus, TX1_ID};
use gyronet::can::yaw::{AngleMessage, FOG_IDS, Quality, RateMessage};
use gyronet::can::{DataFrame, slcan};
use gyronet::health::Faults;
use gyronet::model::{Blob, weights};
use gyronet::sample::ImuSample;
use gyronet::sensor::xsens::MtData2;
use gyronet::store::Configuration;
use gyronet_host_tests::board::Board;
use gyronet_host_tests::inputs::{self, Step};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::replay;
use gyronet_host_tests::stored::Stored;
use gyronet_tools::bundled;
use gyronet_tools::drive::recording::Row;
use std::ops::Range;
use std::time::Duration;

const FOG: usize = 3;
const MS: Duration = Duration::from_millis(1);
/// MTData2 status: a gyro axis is clipped.
const CLIPPED: u32 = 1 << 11;
/// Bytes of a message of the fibre-optic gyro.
const FOG_MESSAGE: usize = 36;

fn rows() -> Vec<Row> {
    bundled::simulated_drive().expect("it comes with the tools").rows
}

/// The frames that the board has sent on CAN, as lines.
fn lines(board: &mut Board) -> Vec<Vec<u8>> {
    let line = |frame: &DataFrame| {
        let line = slcan::emit(frame).expect("a data frame");
        line.strip_suffix(b"\r").expect("a CR").to_vec()
    };
    common::frames(&board.can_frames()).iter().map(line).collect()
}

fn frames(lines: &[Vec<u8>], id: Id) -> Vec<DataFrame> {
    let frames = lines.iter().map(|line| slcan::parse::<DataFrame>(line).expect("a frame"));
    frames.filter(|frame| frame.id() == id).collect()
}

fn standard(id: u16) -> Id {
    Id::Standard(embedded_can::StandardId::new(id).expect("11 bits"))
}

/// Noise between the messages, a cable that is cut while noise goes on, a clipped and a stuck sensor; meanwhile noise
/// on the service line, which changes no frame.
#[test]
fn faults_of_the_inertial_sensor_give_the_hosts_frames() {
    const TEST: &str = "faults_of_the_inertial_sensor_give_the_hosts_frames";
    const CUT: Range<usize> = 340..390;
    const CLIPS: Range<usize> = 440..443;
    const STUCK: Range<usize> = 480..520;
    const END: usize = 560;
    let Some(mut board) = common::boot(TEST) else { return };
    let (rows, mut noise) = (rows(), Noise::new(12));
    let mut sent = Vec::new();
    for number in 0..END {
        let garbage = noise.int(-20, 40).max(0);
        let mut bytes: Vec<u8> = (0..garbage).map(|_| noise.byte()).collect();
        let of = if STUCK.contains(&number) { STUCK.start - 1 } else { number };
        let sample = ImuSample { time: rows[number].sample.time, ..rows[of].sample };
        let mut message = MtData2::of(&sample, number as u16);
        if CLIPS.contains(&number) {
            message.status = Some(CLIPPED);
        }
        if !CUT.contains(&number) {
            bytes.extend(message.emit());
        }
        board.send_at(IMU, &bytes, START + SAMPLE * number as u32);
        sent.extend(bytes);
    }
    board.run(START);
    let flood: Vec<u8> = (0..20_000).map(|_| noise.byte()).collect();
    board.send(SERVICE, &flood);
    board.run(SAMPLE * END as u32);
    let lines = lines(&mut board);
    let mut host = replay::Board::following(lines.clone());
    host.push(&sent);
    replay::assert_same(&lines, &host.lines);
    let silent = host.followed as usize;
    assert!((45..=50).contains(&silent), "{silent} sets for 0.5 s without a message");
    let tx1 = frames(&host.lines, Id::Standard(TX1_ID));
    let status = |frame: &DataFrame| Message::parse(frame.data()).expect("a good checksum").rate_status;
    let failed = tx1.iter().filter(|frame| status(frame) == SignalStatus::FAILURE).count();
    println!("{TEST}: {} frames, {silent} sets in silence, {failed} without a rate", host.lines.len());
    assert!(failed > silent + CLIPS.len() + STUCK.len() - 10, "{failed}");
    assert_eq!(status(tx1.last().expect("frames")), SignalStatus::OK);
    board.send(SERVICE, b"\r");
    let counters = common::counters(&mut board);
    assert!(counters.lines.service_errors > 40, "{counters:?}");
}

/// A fibre-optic gyro on its line at 921600, at a latitude and under configured identifiers: garbage, a stuck gyro and
/// lost wheels.
#[test]
fn faults_of_the_fibre_optic_gyro_are_reported_as_long_as_they_last() {
    const TEST: &str = "faults_of_the_fibre_optic_gyro_are_reported_as_long_as_they_last";
    const IDS: [u16; 3] = [0x3C0, 0x3C1, 0x3C2];
    const GARBAGE: Range<usize> = 200..230;
    const STUCK: Range<usize> = 300..340;
    const NO_WHEELS: Range<usize> = 400..450;
    const END: usize = 500;
    let configuration = Configuration { latitude_deg: Some(36.37), fog_ids: IDS, ..Configuration::DEFAULT };
    let Some(mut board) = common::unpowered(TEST) else { return };
    Stored::default().record(&configuration).write_to(&mut board);
    board.power_on();
    let weights = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let mut host = replay::Board::configured(&configuration, weights);
    let (rows, mut noise) = (rows(), Noise::new(7));
    for number in 0..END {
        let reference = |number: usize| rows[number].reference.expect("a reference");
        let mut step = Step::new(number, &rows[number].sample, reference(number));
        match number {
            _ if GARBAGE.contains(&number) => step.fog.iter_mut().for_each(|byte| *byte = noise.byte()),
            _ if STUCK.contains(&number) => {
                let held = inputs::fog_reading(STUCK.start - 1, reference(STUCK.start - 1));
                step.fog = inputs::fog_bytes(number, held);
            }
            _ if NO_WHEELS.contains(&number) => step.wheels = None,
            _ => {}
        }
        // Wheels, then the inertial sensor, then the gyro's ten messages: none is under way when the next one begins.
        let begin = START + SAMPLE * number as u32;
        if let Some(wheels) = step.wheels {
            board.can_send_at(&wheels, begin);
            host.wheel(&wheels);
        }
        let imu = step.imu.emit();
        board.send_at(IMU, &imu, begin);
        host.push(&imu);
        for (place, message) in step.fog.chunks(FOG_MESSAGE).enumerate() {
            board.send_at(FOG, message, begin + 6 * MS + MS * place as u32 / 3);
        }
        host.push_fog(&step.fog);
    }
    board.run(START + SAMPLE * END as u32);
    let lines = lines(&mut board);
    let ids = IDS.map(standard);
    let is_fog = |line: &Vec<u8>| ids.contains(&slcan::parse::<DataFrame>(line).expect("a frame").id());
    let (fog, own): (Vec<_>, Vec<_>) = lines.iter().cloned().partition(is_fog);
    let (host_fog, host_own): (Vec<_>, Vec<_>) = host.lines.iter().cloned().partition(is_fog);
    println!(
        "{TEST}: {} and {} frames, the host's {} and {}",
        own.len(),
        fog.len(),
        host_own.len(),
        host_fog.len()
    );
    replay::assert_same(&own, &host_own);
    // The board places the gyro's messages by its clock, the host by the sensor's: the same message may count for the
    // next 10 ms, and a fault may be seen a sample earlier or later.
    let rates = |lines: &[Vec<u8>]| -> Vec<RateMessage> {
        let rates = frames(lines, ids[0]).into_iter();
        rates.map(|frame| RateMessage::parse(frame.data()).expect("a rate")).collect()
    };
    let (sent, made) = (rates(&fog), rates(&host_fog));
    assert!(sent.len() + 2 >= made.len(), "{} of {} rates", sent.len(), made.len());
    let usable = |rate: &RateMessage| rate.quality != Quality::Unusable;
    let both = sent.iter().zip(&made).filter(|(sent, made)| usable(sent) && usable(made));
    let apart: Vec<u32> = both.map(|(sent, made)| sent.rate.abs_diff(made.rate)).collect();
    let most = apart.iter().max().expect("rates");
    println!("{TEST}: {} rates of both, {most} micro-deg/s apart at most", apart.len());
    assert!(apart.len() > END - GARBAGE.len() - STUCK.len() - 20 && *most < 2_000, "{most}");
    assert_eq!(frames(&lines, standard(FOG_IDS[0])), [], "the identifiers are the configured ones");
    let unusable = sent.iter().filter(|rate| !usable(rate)).count();
    let flagged = |fault: Faults| {
        let angles = frames(&fog, ids[1]).into_iter();
        let faults = angles.map(|frame| AngleMessage::parse(frame.data()).expect("an angle").faults);
        faults.filter(|faults| faults.0 & fault.0 != 0).count()
    };
    let [gap, stuck, wheels] = [Faults::GAP, Faults::STUCK, Faults::WHEELS].map(flagged);
    println!("{TEST}: {unusable} rates unusable; {gap} with a gap, {stuck} stuck, {wheels} without wheels");
    let near = |count: usize, faults: usize| count.abs_diff(faults) <= 3;
    // The first messages after the start fill no 10 ms either.
    assert!((GARBAGE.len()..=GARBAGE.len() + 6).contains(&gap), "{gap}");
    assert!(near(stuck, STUCK.len()) && unusable >= gap + stuck, "{stuck} {unusable}");
    // Wheels are missed 100 ms after their last frame.
    assert!(near(wheels, NO_WHEELS.len() - 9), "{wheels}");
}

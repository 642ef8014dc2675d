//! Diagnosis on CAN with the image as flashed: a tester of ours, and udsoncan over can-isotp as they come from their
//! authors.

use crate::common::{self, START, drive};
use crate::service::storing;
use embedded_can::{Frame, Id};
use gyronet::can::diagnosis::DiagnosisIds;
use gyronet::store::Configuration;
use gyronet_host_tests::board::Board;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::stored::other_weights;
use gyronet_host_tests::tester::Tester;
use gyronet_host_tests::wire::{bytes, data_frame, id11};
use gyronet_host_tests::{image, require};
use gyronet_tools::client::device::requests::FIRMWARE;
use gyronet_tools::client::device::update::Update;
use gyronet_tools::signing::{PrivateKey, hex};
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::time::Duration;

const TURN: Duration = Duration::from_millis(1);

const REQUEST: Id = id11(0x7E0);
const RESPONSE: Id = id11(0x7E8);

/// Sends frames to the server; returns the data of its own of the next millisecond, and how many others it sent.
fn exchange(board: &mut Board, [to, from]: [Id; 2], frames: &[[u8; 8]]) -> (Vec<[u8; 8]>, usize) {
    frames.iter().for_each(|data| board.can_send(&data_frame(to, data)));
    board.run(TURN);
    let sent = common::frames(&board.can_frames());
    let ours = sent.iter().filter(|frame| frame.id() == from);
    let ours: Vec<_> = ours.map(|frame| frame.data().try_into().expect("eight bytes")).collect();
    let others = sent.len() - ours.len();
    (ours, others)
}

fn ask_by(board: &mut Board, ids: [Id; 2], request: &[u8], turns: usize) -> Option<Vec<u8>> {
    Tester::default().ask(request, turns, |frames| exchange(board, ids, frames).0)
}

fn ask(board: &mut Board, request: &[u8]) -> Option<Vec<u8>> {
    ask_by(board, [REQUEST, RESPONSE], request, 8_000)
}

#[test]
fn a_sensor_that_falls_silent_is_a_trouble_and_the_rates_keep_their_place() {
    let Some(mut board) = common::started() else { return };
    let now = board.counts().time;
    common::send(&mut board, &drive(100), now);
    // A tester that reads all the time takes nothing from the rates.
    let mut reads = 0;
    let mut rates = 0;
    while board.counts().time < now + Duration::from_secs(1) {
        let read = Tester::default().ask(&[0x22, 1, 6], 100, |frames| {
            let (ours, others) = exchange(&mut board, [REQUEST, RESPONSE], frames);
            rates += others;
            ours
        });
        assert_eq!(read.map(|bytes| bytes.len()), Some(3 + 4 * 19));
        reads += 1;
    }
    println!("{reads} reads of 75 bytes and {rates} frames of rates in a second");
    assert!(rates >= 6 * 99, "{rates}");
    board.run(Duration::from_millis(500));
    let silent = [0x5A, 0x01, 0x31];
    let listed = ask(&mut board, &[0x19, 2, 1]).expect("troubles");
    assert!(listed[3..].chunks(4).any(|trouble| trouble[..3] == silent), "{listed:02x?}");
    // It outlives a restart: on a new board the record wants an erase, which waits for a session.
    assert_eq!(ask(&mut board, &[0x10, 3]), Some(vec![0x50, 3, 0, 50, 0x01, 0xF4]));
    board.run(Duration::from_secs(2));
    assert_eq!(ask(&mut board, &[0x11, 1]), Some(vec![0x51, 1]));
    board.run(START);
    let state = ask(&mut board, &[&[0x19, 4][..], &silent, &[1]].concat()).expect("the state when it came");
    assert_eq!(state.len(), 18, "{state:02x?}");
    assert_eq!(state[5] & 8, 8, "{state:02x?}");
}

#[test]
fn diagnosis_with_29_bits_is_configured_over_itself() {
    let Some(mut board) = common::started() else { return };
    let ids =
        DiagnosisIds { extended: true, request: 0x18DA_10F1, functional: 0x18DB_33F1, response: 0x18DA_F110 };
    let configuration = Configuration { diagnosis: ids, ..Configuration::DEFAULT };
    assert_eq!(ask(&mut board, &[0x10, 3]), Some(vec![0x50, 3, 0, 50, 0x01, 0xF4]));
    assert_eq!(ask(&mut board, &storing(&configuration)), Some(vec![0x6E, 1, 0]));
    assert_eq!(ask(&mut board, &[0x11, 1]), Some(vec![0x51, 1]));
    board.run(START);
    assert_eq!(ask_by(&mut board, [REQUEST, RESPONSE], &[0x3E, 0], 100), None);
    let [request, functional, response] = ids.ids().expect("they are valid");
    for (id, answer) in [(request, Some(vec![0x7E, 0])), (functional, Some(vec![0x7E, 0])), (response, None)]
    {
        assert_eq!(ask_by(&mut board, [id, response], &[0x3E, 0], 100), answer, "{id:?}");
    }
}

/// Relays frames between the client's pipes and the board, a millisecond of the board's time for each turn.
#[test]
fn udsoncan_reads_writes_downloads_and_updates() {
    let Some(python) = require::python(&["isotp", "udsoncan", "yaml"]) else { return };
    let Some(whole) = image::update(env!("CARGO_TARGET_TMPDIR")) else { return };
    let Some(mut board) = common::started() else { return };
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("uds_weights.bin");
    let weights = other_weights(2);
    std::fs::write(&file, &weights).expect("there is room");
    let key = PrivateKey::generate().expect("random numbers");
    let signed = |content: &[u8]| hex(&key.trailer(0xFF01, None, 7, content));
    // The first KiB of an image.
    let [a, b] = whole.images;
    let update = Update::new(whole.head.label, [a, b[..1_024].to_vec()]);
    std::fs::write(file.with_extension("bin.update"), update.bytes()).expect("there is room");
    let keys = serde_json::json!({
        "public": hex(&key.public()), "good": signed(&weights), "foreign": signed(&other_weights(1)),
        "update": hex(&key.trailer(FIRMWARE, None, 8, &update.head.bytes())),
    });
    std::fs::write(file.with_extension("bin.json"), keys.to_string()).expect("there is room");
    let mut client = Command::new(python)
        .arg(workspace().join("host-tests/tests/clients/uds_client.py"))
        .arg(&file)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python");
    let mut to_client = client.stdin.take().expect("a pipe");
    let from_client = BufReader::new(client.stdout.take().expect("a pipe"));
    let mut said = Vec::new();
    // Each line is a turn: frames to the board (identifier#data), or what the client has seen.
    for line in from_client.lines() {
        let line = line.expect("text");
        if line == "reset" {
            board.reset_pin();
        }
        let Some(frames) = line.strip_prefix("turn") else {
            said.push(line);
            continue;
        };
        for text in frames.split_whitespace() {
            let (id, data) = text.split_once('#').expect("identifier#data");
            let id = u16::from_str_radix(id, 16).expect("hexadecimal");
            board.can_send(&data_frame(id11(id), &bytes(data)));
        }
        let (sent, _) = exchange(&mut board, [REQUEST, RESPONSE], &[]);
        let answers: String = sent.iter().map(|data| hex(data) + " ").collect();
        // The client may have ended.
        let _ = writeln!(to_client, "{answers}");
    }
    assert!(client.wait().expect("it ends").success(), "{said:#?}");
    println!("{}", said.join("\n"));
    assert_eq!(said.last().map(String::as_str), Some("done"));
}

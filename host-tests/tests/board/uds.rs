//! Diagnosis on CAN with the image as flashed: a tester of ours, and udsoncan over can-isotp as they come from their
//! authors.

use crate::common::{self, START};
use crate::service::{IDS, ask, exchange, storing};
use embedded_can::Id;
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

fn ask_by(board: &mut Board, ids: [Id; 2], request: &[u8], turns: usize) -> Option<Vec<u8>> {
    Tester::default().ask(request, turns, |frames| exchange(board, ids, frames))
}

#[test]
fn diagnosis_with_29_bits_is_configured_over_itself() {
    let Some(mut board) = common::started() else { return };
    let ids =
        DiagnosisIds { extended: true, request: 0x18DA_10F1, functional: 0x18DB_33F1, response: 0x18DA_F110 };
    let configuration = Configuration { diagnosis: ids, ..Configuration::DEFAULT };
    assert_eq!(ask(&mut board, &[0x10, 3]), [0x50, 3, 0, 50, 0x01, 0xF4]);
    assert_eq!(ask(&mut board, &storing(&configuration)), [0x6E, 1, 0]);
    assert_eq!(ask(&mut board, &[0x11, 1]), [0x51, 1]);
    board.run(START);
    assert_eq!(ask_by(&mut board, IDS, &[0x3E, 0], 100), None);
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
        let sent = exchange(&mut board, IDS, &[]);
        let answers: String = sent.iter().map(|data| hex(data) + " ").collect();
        // The client may have ended.
        let _ = writeln!(to_client, "{answers}");
    }
    assert!(client.wait().expect("it ends").success(), "{said:#?}");
    println!("{}", said.join("\n"));
    assert_eq!(said.last().map(String::as_str), Some("done"));
}

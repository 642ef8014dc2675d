//! The SLCAN line of the board: a host's commands, and udsoncan over can-isotp and python-can beside the rates.

use crate::common::{self, SAMPLE, SET, SLCAN, START};
use gyronet::can::{DataFrame, slcan};
use gyronet_host_tests::board::Board;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::{replay, require};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::Command;
use std::time::Duration;

/// Board time that passes between two looks at the socket.
const TURN: Duration = Duration::from_millis(2);

fn standing(board: &mut Board, samples: std::ops::Range<usize>) {
    let now = board.counts().time;
    for (k, number) in samples.enumerate() {
        board.send_at(common::IMU, &replay::turning(number, 0.001), now + SAMPLE * k as u32);
    }
}

#[test]
fn board_answers_the_commands_of_a_host() {
    let Some(mut board) = common::boot("board_answers_the_commands_of_a_host") else { return };
    board.run(START);
    // Frames come before anybody has asked for any.
    standing(&mut board, 0..5);
    board.run(SAMPLE * 6);
    let sent = board.sent(SLCAN);
    assert_eq!(sent.split(|byte| *byte == b'\r').filter(|line| line.starts_with(b"t")).count(), 5 * SET);
    // python-can and slcand, then a question that is not understood; time stamps from then on.
    board.send(SLCAN, b"C\rS6\r\rO\rV\rN\rF\rX\rZ1\r");
    board.run(SAMPLE);
    let text = String::from_utf8(board.sent(SLCAN)).expect("ASCII");
    let answers: Vec<&str> =
        text.split_terminator(['\r', '\u{7}']).filter(|line| !line.starts_with('t')).collect();
    assert!(text.contains('\u{7}'), "{text:?}");
    assert_eq!(answers.join(" ").split_whitespace().collect::<Vec<_>>(), ["V0101", "NGYRO", "F00"]);
    // Closing ends nothing. The stamps are milliseconds of the sensor's clock.
    board.send(SLCAN, b"C\r");
    standing(&mut board, 12..15);
    board.run(SAMPLE * 4);
    let sent = board.sent(SLCAN);
    let stamped =
        sent.split(|byte| *byte == b'\r').filter_map(|line| slcan::parse_stamped::<DataFrame>(line).ok());
    let stamps: Vec<u16> = stamped.map(|(_, at)| at).collect();
    for stamp in [120, 130, 140] {
        assert!(stamps.iter().filter(|at| **at == stamp).count() >= SET, "{stamps:?}");
    }
}

/// Serves the SLCAN line to a client until it goes; board time passes as long as it is there.
fn serve(board: &mut Board, mut client: TcpStream) -> std::io::Result<()> {
    client.set_read_timeout(Some(Duration::from_micros(100)))?;
    loop {
        let mut bytes = [0; 256];
        match client.read(&mut bytes) {
            Ok(0) => return Ok(()),
            Ok(count) => board.send(SLCAN, &bytes[..count]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) if error.kind() == ErrorKind::ConnectionReset => return Ok(()),
            Err(error) => return Err(error),
        }
        board.run(TURN);
        match client.write_all(&board.sent(SLCAN)) {
            Err(error) if matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe) => {
                return Ok(());
            }
            written => written?,
        }
    }
}

#[test]
fn udsoncan_reads_the_board_over_slcan() {
    const TEST: &str = "udsoncan_reads_the_board_over_slcan";
    let Some(python) = require::python(TEST, &["can", "isotp", "serial", "udsoncan", "yaml"]) else { return };
    let Some(mut board) = common::boot(TEST) else { return };
    board.run(START);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("a port");
    let client = std::thread::spawn(move || {
        Command::new(python)
            .arg(workspace().join("host-tests/tests/clients/uds_client.py"))
            .args(["slcan", &format!("socket://{address}")])
            .output()
            .expect("Python")
    });
    // The sensor speaks meanwhile: its rates share the line.
    standing(&mut board, 0..6_000);
    serve(&mut board, listener.accept().expect("the client").0).expect("the line holds");
    let client = client.join().expect("it ends");
    let said = String::from_utf8_lossy(&client.stdout).into_owned();
    println!("{said}");
    assert!(client.status.success(), "{}", String::from_utf8_lossy(&client.stderr));
    assert_eq!(said.lines().last(), Some("done"));
}

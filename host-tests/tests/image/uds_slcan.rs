//! Diagnosis on the SLCAN line of the image in QEMU, beside the rates: udsoncan over can-isotp and python-can.

use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::{image, qemu, replay, require};
use std::process::Command;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(60);

#[test]
fn udsoncan_reads_the_board_over_slcan() {
    const TEST: &str = "udsoncan_reads_the_board_over_slcan";
    let Some(python) = require::python(TEST, &["can", "isotp", "serial", "udsoncan", "yaml"]) else { return };
    let Some(elf) = image::coprocessor(TEST, env!("CARGO_TARGET_TMPDIR")) else { return };
    let mut board = qemu::Board::boot(&elf, 2, &[]);
    let address = board.serve(2);
    // The sensor speaks meanwhile: its rates share the line.
    let feeder = std::thread::spawn(move || {
        (0..300).for_each(|number| board.send(1, &replay::turning(number, 0.0), LIMIT));
        board
    });
    let client = Command::new(python)
        .arg(workspace().join("host-tests/tests/clients/uds_client.py"))
        .args(["slcan", &format!("socket://{address}")])
        .output()
        .expect("Python");
    drop(feeder.join().expect("the board takes every byte"));
    let said = String::from_utf8_lossy(&client.stdout).into_owned();
    println!("{said}");
    assert!(client.status.success(), "{}", String::from_utf8_lossy(&client.stderr));
    assert_eq!(said.lines().last(), Some("done"));
}

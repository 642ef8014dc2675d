//! `cargo board`: the firmware in a vehicle that drives, with its lines as sockets.

use crate::common;
use embedded_can::{Frame, Id};
use gyronet::health::Status;
use gyronet::store::ImuPart;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::{image, require};
use gyronet_tools::client::bus::{Bus, SlcanBus, WAIT};
use gyronet_tools::client::connection::Connection;
use gyronet_tools::client::device::Device;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Time of this computer until the board has answered.
const LIMIT: Duration = Duration::from_secs(120);

/// Ends the program with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program, and the addresses of its service line and SLCAN.
fn start(arguments: &[&str]) -> Option<(Running, [String; 2])> {
    let elf = common::elf()?;
    require::python(&["unicorn"])?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_board"));
    command.args(["--service", "0", "--slcan", "0", "--elf"]).arg(elf).args(arguments).stdout(Stdio::piped());
    let mut child = Running(command.spawn().expect("it was built"));
    let output = BufReader::new(child.0.stdout.take().expect("it is a pipe"));
    let mut names = output.lines().map(|line| {
        let line = line.expect("a line");
        line.rsplit_once(": ").expect("a name and an address").1.to_owned()
    });
    Some((child, [(); 2].map(|()| names.next().expect("two lines"))))
}

#[test]
fn a_board_without_hardware_answers_on_its_sockets() {
    let Some((_child, [service, bus])) = start(&[]) else { return };
    let began = Instant::now();
    let until = |what: &str, holds: &mut dyn FnMut() -> bool| {
        while !holds() {
            assert!(began.elapsed() < LIMIT, "{what}");
        }
    };
    // On a busy computer the board is slower than real time, and a response late.
    until("a rate that is ready", &mut || {
        let mut device = Device::new(SlcanBus::open(&service, 0).expect("it listens"), &service);
        device.info().is_ok_and(|info| info.status == Status::Ready)
    });
    let mut line = Connection::open(&bus, 0, WAIT).expect("it listens");
    line.write_all(b"O\r").expect("it listens");
    let mut bus = SlcanBus::new(line);
    until("a frame with the rate", &mut || {
        let frames = bus.receive().expect("the line is open");
        frames.iter().any(|frame| matches!(frame.id(), Id::Standard(id) if id.as_raw() == 0x1A0))
    });
}

/// At 50 ms a tester gives up; the product promises its responses in time at the pace of the model.
#[test]
fn udsoncan_with_its_defaults_reads_and_writes_on_the_sockets() {
    let Some(python) = require::python(&["isotp", "udsoncan", "yaml"]) else { return };
    let Some(update) = image::update(env!("CARGO_TARGET_TMPDIR")) else { return };
    let Some((_child, [service, bus])) = start(&["--parked", "--spi", "Bmi088"]) else { return };
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sockets.update");
    std::fs::write(&file, update.bytes()).expect("there is room");
    let mut device = Device::new(SlcanBus::open(&service, 0).expect("it listens"), &service);
    // Another part; the restart waits until the standstill is proven again.
    let mut configuration = device.configuration().expect("a response");
    configuration.imu = ImuPart::Bmi088;
    device.set_configuration(&configuration).expect("it stands");
    device.restart().expect("it stands");
    let began = Instant::now();
    while device.info().expect("a response").status != Status::Ready {
        assert!(began.elapsed() < LIMIT);
    }
    let client = workspace().join("host-tests/tests/clients/socket_client.py");
    loop {
        let output = Command::new(&python).arg(&client).arg(&bus).arg(&file).output().expect("Python runs");
        if output.status.success() {
            println!("at most {} ms", String::from_utf8_lossy(&output.stdout).trim());
            return;
        }
        // On a busy computer a response may be late; on one that is not, none is.
        assert!(began.elapsed() < LIMIT, "{}", String::from_utf8_lossy(&output.stderr));
    }
}

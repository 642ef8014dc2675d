//! `cargo board`: the firmware in a vehicle that drives, with its lines as sockets.

use crate::common;
use embedded_can::{Frame, Id};
use gyronet::health::Status;
use gyronet_host_tests::require;
use gyronet_tools::client::bus::{Bus, SlcanBus};
use gyronet_tools::client::device::Device;
use std::io::{BufRead, BufReader};
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

#[test]
fn a_board_without_hardware_answers_on_its_sockets() {
    let (Some(elf), Some(_)) = (common::elf(), require::python(&["unicorn"])) else { return };
    let mut command = Command::new(env!("CARGO_BIN_EXE_board"));
    command.args(["--service", "0", "--slcan", "0", "--elf"]).arg(elf).stdout(Stdio::piped());
    let mut child = Running(command.spawn().expect("it was built"));
    let output = BufReader::new(child.0.stdout.take().expect("it is a pipe"));
    let mut names = output.lines().map(|line| {
        let line = line.expect("a line");
        line.rsplit_once(": ").expect("a name and an address").1.to_owned()
    });
    let [service, bus] = [(); 2].map(|()| names.next().expect("two lines"));
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
    let mut bus = SlcanBus::open(&bus, 0).expect("it listens");
    until("a frame with the rate", &mut || {
        let frames = bus.receive().expect("the line is open");
        frames.iter().any(|frame| matches!(frame.id(), Id::Standard(id) if id.as_raw() == 0x1A0))
    });
}

//! `cargo board`: the firmware in a vehicle that drives, with its lines as sockets.

use crate::common;
use embedded_can::{Frame, Id};
use gyronet::can::yaw::{Quality, RateMessage};
use gyronet::health::Status;
use gyronet::service::device::FirmwareState;
use gyronet::service::message::Info;
use gyronet::store::{ImuPart, Slot};
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::{image, require};
use gyronet_tools::client::bus::{Bus, SlcanBus, WAIT};
use gyronet_tools::client::connection;
use gyronet_tools::client::device::Device;
use gyronet_tools::signing::unhex;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Time of this computer until the board has answered.
const LIMIT: Duration = Duration::from_secs(120);

struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program, and the addresses of its service line, SLCAN and bus.
fn start(arguments: &[&str]) -> Option<(Running, [String; 3])> {
    let elf = common::elf()?;
    require::python(&["unicorn"])?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_board"));
    command
        .args(["--service", "0", "--slcan", "0", "--can", "0", "--elf"])
        .arg(elf)
        .args(arguments)
        .stdout(Stdio::piped());
    let mut child = Running(command.spawn().expect("it was built"));
    let output = BufReader::new(child.0.stdout.take().expect("it is a pipe"));
    let mut names = output.lines().map(|line| {
        let line = line.expect("a line");
        line.rsplit_once(": ").expect("a name and an address").1.to_owned()
    });
    Some((child, [(); 3].map(|()| names.next().expect("three lines"))))
}

#[test]
fn a_board_without_hardware_answers_on_its_sockets() {
    let Some((_child, [service, slcan, bus])) = start(&[]) else { return };
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
    for address in [slcan, bus] {
        let mut line = connection::open(&address, 0, WAIT).expect("it listens");
        line.write_all(b"O\r").expect("it listens");
        let mut bus = SlcanBus::new(line);
        until("a frame with the rate", &mut || {
            let frames = bus.receive().expect("the line is open");
            frames.iter().any(|frame| matches!(frame.id(), Id::Standard(id) if id.as_raw() == 0x1A0))
        });
    }
}

/// Another sensor is set, and the example for udsoncan updates the firmware: the log has all rates but those that the board
/// announces as missing.
#[test]
fn udsoncan_updates_the_board_on_its_bus() {
    let packages = &["can", "isotp", "serial", "udsoncan"];
    let (Some(python), Some(update)) =
        (require::python(packages), image::update(env!("CARGO_TARGET_TMPDIR")))
    else {
        return;
    };
    let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (file, log) = (scratch.join("sockets.update"), scratch.join("sockets.log"));
    std::fs::write(&file, update.bytes()).expect("there is room");
    let log_name = log.to_str().expect("a plain name");
    let Some((_child, [service, _, bus])) = start(&["--parked", "--spi", "Bmi088", "--log", log_name]) else {
        return;
    };
    let mut device = Device::new(SlcanBus::open(&service, 0).expect("it listens"), &service);
    // Another part; the restart waits until the standstill is proven again.
    let mut configuration = device.configuration().expect("a response");
    configuration.imu = ImuPart::Bmi088;
    device.set_configuration(&configuration).expect("it stands");
    device.restart().expect("it stands");
    let until = |device: &mut Device<_>, holds: &dyn Fn(&Info) -> bool| {
        let began = Instant::now();
        while !device.info().is_ok_and(|info| holds(&info)) {
            assert!(began.elapsed() < LIMIT);
        }
    };
    until(&mut device, &|info| info.status == Status::Ready);
    let example = workspace().join("tools/examples/udsoncan_update.py");
    let adapter = format!("socket://{bus}");
    let output =
        Command::new(&python).arg(&example).args(["slcan", &adapter]).arg(&file).output().expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    until(&mut device, &|info| {
        (info.firmware.slot, info.firmware.state) == (Some(Slot::B), FirmwareState::Confirmed)
    });
    let frames = std::fs::read_to_string(&log).expect("a log");
    let rates: Vec<(f64, Quality)> = frames.lines().filter_map(rate).collect();
    let gaps = rates.windows(2).filter(|pair| pair[1].0 - pair[0].0 > 0.015);
    let gaps: Vec<_> = gaps.map(|pair| (pair[1].0 - pair[0].0, pair[0].1)).collect();
    println!("{} rates, gaps {gaps:.3?}", rates.len());
    // A setting, a restart, two sectors of flash, and a restart: each is announced.
    assert_eq!(gaps.len(), 5, "{gaps:.3?}");
    assert!(gaps.iter().all(|(_, before)| *before == Quality::Unusable), "{gaps:.3?}");
}

/// The time and quality of a line of the log that is a rate.
fn rate(line: &str) -> Option<(f64, Quality)> {
    let (time, data) = line.strip_prefix('(')?.split_once(") can0 1A0#")?;
    let message = RateMessage::parse(&unhex::<8>(data)?).expect("a rate");
    Some((time.parse().expect("seconds"), message.quality))
}

//! Diagnosis over a CAN interface of Linux: the client of `gyronet device` against the library's server, with other
//! frames on the bus.
//!
//! A real interface does, or `ip link add vcan0 type vcan && ip link set vcan0 up`. Where the kernel has no CAN,
//! `host-tests/socketcan/run` starts a virtual machine that has.

use super::start;
use embedded_can::{Frame, Id};
use gyronet::service::message::AllCounters;
use gyronet::store::{Configuration, Mounting, Slot, slots::WeightSource};
use gyronet::uds::Server;
use gyronet_host_tests::flash::Flash;
use gyronet_host_tests::stored::other_weights;
use gyronet_host_tests::wire::{data_frame, id11};
use gyronet_tools::client::bus::{self, Bus};
use gyronet_tools::client::device::Device;
use gyronet_tools::client::device::upload::upload;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

fn open(name: &str) -> Box<dyn Bus> {
    bus::open(name, 0).unwrap_or_else(|error| panic!("{error}"))
}

/// A board on the interface, which sends its rates as well, until it is stopped.
fn serve(name: &str, stop: &AtomicBool) {
    let flash = Flash::default();
    let (mut server, mut board) = (Server::new(), start(&flash));
    let (mut line, began, mut rates) = (open(name), Instant::now(), 0);
    while !stop.load(Ordering::Relaxed) {
        let received = line.receive().unwrap_or_default();
        let now = began.elapsed().as_millis() as u32;
        for frame in received {
            match frame.id() {
                Id::Standard(id) if id.as_raw() == 0x7E0 => server.receive(frame.data(), now),
                Id::Standard(id) if id.as_raw() == 0x7DF => server.receive_functional(frame.data(), now),
                _ => {}
            }
        }
        server.poll(&mut board, AllCounters::default, now, || None);
        while let Some(data) = server.next_frame(now) {
            let _ = line.send(&data_frame(id11(0x7E8), &data));
        }
        while rates < now / 10 {
            rates += 1;
            let _ = line.send(&data_frame(id11(0x1A0), &[0; 8]));
        }
        if server.restart_is_due() {
            (server, board) = (Server::new(), start(&flash));
        }
    }
}

#[test]
#[ignore = "wants a CAN interface: host-tests/socketcan/run"]
fn a_board_on_a_can_interface_is_diagnosed() {
    let name = std::env::var("GYRONET_CAN").unwrap_or_else(|_| String::from("can:vcan0"));
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let board = scope.spawn(|| serve(&name, &stop));
        let diagnosed = std::panic::catch_unwind(|| diagnose(&name));
        stop.store(true, Ordering::Relaxed);
        board.join().expect("the board's thread");
        diagnosed.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    });
    println!("done");
}

fn diagnose(name: &str) {
    let mut device = Device::new(open(name), name);
    println!("info: {:?}", device.info().expect("a response").weights);
    let mounting = Mounting { yaw_deg: 90.0, ..Mounting::default() };
    device.set_configuration(&Configuration { mounting, ..Configuration::DEFAULT }).expect("it is stored");
    device.counters().expect("a response");
    let (file, from) = (other_weights(2), Instant::now());
    upload(&mut device, &file, |_| {}).expect("it is accepted");
    let took = from.elapsed().as_secs_f64();
    println!("upload: {} bytes in {took:.1} s of this machine", file.len());
    device.restart().expect("a response");
    let info = device.info().expect("a response");
    assert_eq!(info.weights, WeightSource::Slot(Slot::A));
    assert_eq!(device.configuration().expect("a response").mounting, mounting);

    // The interface goes down; only its owner may do that.
    let interface = name.trim_start_matches("can:");
    let set = |state| Command::new("ip").args(["link", "set", interface, state]).status();
    if set("down").is_ok_and(|status| status.success()) {
        let from = Instant::now();
        let error = device.info().expect_err("nobody hears it").to_string();
        println!("down: {error} ({:?})", from.elapsed());
        assert!(error.contains(name) && from.elapsed() < Duration::from_secs(10), "{error}");
        assert!(set("up").is_ok_and(|status| status.success()));
        let mut again = Device::new(open(name), name);
        let until = Instant::now() + Duration::from_secs(10);
        while again.info().is_err() {
            assert!(Instant::now() < until, "it does not come back");
        }
        println!("up: it answers again");
    } else {
        println!("SKIPPED an interface that goes down wants its owner");
    }
}

//! The supply on the virtual board: low at the start, falling while the image runs, falling during an erase.

use crate::common::{SERVICE, START, boot, info, resets, unpowered};
use gyronet::service::crash::CrashKind;
use gyronet::service::event::ClockFault;
use gyronet::service::frame::emit;
use gyronet::service::{Reply, Request};
use gyronet::store::{Configuration, Mounting, Record};
use gyronet_host_tests::board::Board;
use gyronet_tools::client::device::Device;
use std::time::Duration;

const SUPPLY: &str = "PWR.supply_mv";
const LOW: u32 = 2_500;
const GOOD: u32 = 3_300;
const SECOND: Duration = Duration::from_secs(1);

#[test]
fn low_for_the_first_50_ms() {
    let Some(mut board) = unpowered("low_for_the_first_50_ms") else { return };
    board.configure(SUPPLY, LOW);
    board.power_on();
    board.run(Duration::from_millis(50));
    board.configure(SUPPLY, GOOD);
    board.run(3 * SECOND);
    let identity = info(&mut board).identity;
    assert_eq!((identity.clock_fault, identity.can_fault), (None, None));
    assert!(!board.can_frames().is_empty(), "the silence of the sensor is sent");
    assert_eq!(resets(&mut board).len(), 1);
}

#[test]
fn low_for_seconds() {
    let Some(mut board) = unpowered("low_for_seconds") else { return };
    board.configure(SUPPLY, LOW);
    board.power_on();
    board.run(3 * SECOND);
    assert_eq!(info(&mut board).identity.clock_fault, Some(ClockFault::SupplyLow));
    assert!(board.can_frames().is_empty());
    board.configure(SUPPLY, GOOD);
    board.run(3 * SECOND);
    let identity = info(&mut board).identity;
    assert_eq!((identity.clock_fault, identity.can_fault), (None, None), "it starts again by itself");
}

#[test]
fn falling_while_the_image_runs() {
    let Some(mut board) = boot("falling_while_the_image_runs") else { return };
    board.run(START);
    board.configure(SUPPLY, 2_700);
    board.run(START);
    board.configure(SUPPLY, GOOD);
    board.run(2 * SECOND);
    let identity = info(&mut board).identity;
    assert_eq!(identity.crash.map(|crash| crash.kind), Some(CrashKind::SupplyLow));
    assert_eq!(identity.clock_fault, None);
}

/// The request that stores a configuration whose mounting holds a number.
fn request(number: u16) -> Request {
    let [tens, units] = [number / 100, number % 100].map(f32::from);
    let mounting = Mounting { roll_deg: 0.0, pitch_deg: tens, yaw_deg: units };
    let configuration = Configuration { mounting, ..Configuration::DEFAULT };
    Request::SetConfiguration { version: Configuration::VERSION, configuration }
}

fn try_ask(board: &mut Board, request: &Request) -> Result<Reply, String> {
    board.send(SERVICE, &[0]);
    let mut device = Device::new(board.line(SERVICE), "the virtual board");
    device.ask(request).map_err(|error| error.to_string())
}

fn ask(board: &mut Board, request: &Request) -> Reply {
    try_ask(board, request).expect("an answer")
}

fn stored(board: &mut Board) -> u16 {
    match ask(board, &Request::GetConfiguration) {
        Reply::Configuration { configuration: Configuration { mounting, .. }, .. } => {
            mounting.pitch_deg as u16 * 100 + mounting.yaw_deg as u16
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn falling_during_an_erase() {
    let Some(mut board) = boot("falling_during_an_erase") else { return };
    board.run(START);
    // Until a store has to erase a sector; the supply falls in the middle of that.
    let last = (1..1_000).find(|number| {
        let _ = board.events();
        let frame = emit(1, &request(*number)).expect("it fits");
        board.send(SERVICE, &[0]);
        board.send(SERVICE, &frame);
        board.run_until("flash_erase", Duration::from_millis(60)).is_some()
    });
    let last = last.expect("the records' sectors are full at some time");
    println!("falling_during_an_erase: record {last} erases a sector");
    board.run(Duration::from_millis(50));
    board.configure(SUPPLY, 2_700);
    // The erase ends first: the processor stands still until then. The image stops, and waits at 16 MHz.
    board.run(3 * SECOND);
    let identity = info(&mut board).identity;
    assert_eq!(identity.crash.map(|crash| crash.kind), Some(CrashKind::SupplyLow), "{identity:?}");
    let refused = try_ask(&mut board, &request(last + 1)).expect_err("nothing is stored at a low supply");
    assert!(refused.contains("flash"), "{refused}");
    board.configure(SUPPLY, GOOD);
    board.run(3 * SECOND);
    let found = stored(&mut board);
    assert!(found + 1 == last || found == last, "{found}, not {} or {last}", last - 1);
    assert_eq!(ask(&mut board, &request(last + 1)), Reply::Done, "it stores again");
    board.reset_pin();
    board.run(START);
    assert_eq!(stored(&mut board), last + 1);
}

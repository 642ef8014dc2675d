//! The supply on the virtual board: low at the start, falling during an erase.

use crate::common::{SECOND, START, resets, started, unpowered};
use crate::service;
use gyronet::service::crash::CrashKind;
use gyronet::service::event::ClockFault;
use gyronet::store::{Configuration, Mounting};
use std::time::Duration;

const SUPPLY: &str = "PWR.supply_mv";
const LOW: u32 = 2_500;
const GOOD: u32 = 3_300;

#[test]
fn low_for_the_first_50_ms() {
    let Some(mut board) = unpowered() else { return };
    board.configure(SUPPLY, LOW);
    board.power_on();
    board.run(Duration::from_millis(50));
    board.configure(SUPPLY, GOOD);
    board.run(3 * SECOND);
    let identity = service::info(&mut board).identity;
    assert_eq!((identity.clock_fault, identity.can_fault), (None, None));
    assert!(!board.can_frames().is_empty(), "the silence of the sensor is sent");
    assert_eq!(resets(&mut board).len(), 1);
}

#[test]
fn low_for_seconds() {
    let Some(mut board) = unpowered() else { return };
    board.configure(SUPPLY, LOW);
    board.power_on();
    board.run(3 * SECOND);
    assert_eq!(service::info(&mut board).identity.clock_fault, Some(ClockFault::SupplyLow));
    assert!(board.can_frames().is_empty());
    board.configure(SUPPLY, GOOD);
    board.run(3 * SECOND);
    let identity = service::info(&mut board).identity;
    assert_eq!((identity.clock_fault, identity.can_fault), (None, None), "it starts again by itself");
}

fn numbered(number: u16) -> Configuration {
    let mounting = Mounting { yaw_deg: f32::from(number) / 8.0, ..Mounting::default() };
    Configuration { mounting, ..Configuration::DEFAULT }
}

#[test]
fn falling_during_an_erase() {
    let Some(mut board) = started() else { return };
    // Until a store has to erase a sector; the supply falls in the middle of that.
    let last = (1..1_000).find(|number| {
        service::enter(&mut board, 3);
        let _ = board.events();
        service::send(&mut board, &service::storing(&numbered(*number)));
        board.run_until("flash_erase", Duration::from_millis(60)).is_some()
    });
    let last = last.expect("the records' sectors are full at some time");
    println!("falling_during_an_erase: record {last} erases a sector");
    board.run(Duration::from_millis(50));
    board.configure(SUPPLY, 2_700);
    // The erase ends first: the processor stands still until then. The image stops, and waits at 16 MHz.
    board.run(3 * SECOND);
    let identity = service::info(&mut board).identity;
    assert_eq!(identity.crash.map(|crash| crash.kind), Some(CrashKind::SupplyLow), "{identity:?}");
    // There is no CAN at a low supply.
    let refused = service::on_line(&mut board).set_configuration(&numbered(last + 1));
    let refused = refused.expect_err("nothing is stored at a low supply").to_string();
    assert!(refused.contains("flash"), "{refused}");
    board.configure(SUPPLY, GOOD);
    board.run(3 * SECOND);
    assert_eq!(service::info(&mut board).identity.clock_fault, None, "it runs again");
    let found = service::configuration(&mut board);
    assert!([last - 1, last].map(numbered).contains(&found), "{found:?} instead of {last} or the one before");
    service::on_line(&mut board).set_configuration(&numbered(last + 1)).expect("it stores again");
    board.reset_pin();
    board.run(START);
    assert_eq!(service::configuration(&mut board), numbered(last + 1));
}

//! Crashes and hangs on the virtual board: each resets the chip within the watchdog's limit at the latest, and
//! leaves its reason.

use crate::common::{self, MS, SECOND, START, boot, drive, resets};
use crate::service;
use gyronet::service::crash::{Crash, CrashKind};
use gyronet::service::event::ResetCause;
use gyronet_host_tests::board::{At, Board};
use gyronet_host_tests::wire::{data_frame, id11};
use std::time::Duration;

/// `b .`: a branch to itself.
const HANG: &[u8] = &[0xFE, 0xE7];

fn crash_of(board: &mut Board) -> Option<Crash> {
    let identity = service::info(board).identity;
    assert_eq!(identity.clock_fault, None, "the board runs again");
    identity.crash
}

#[test]
fn hang_of_each_task() {
    // The vectors' functions; idle's own; the output task's, which the watchdog wants, too.
    let tasks = [
        "USART1",
        "USART2",
        "USART3",
        "USART6",
        "SysTick",
        "CAN1_RX0",
        "CAN1_TX",
        "SPI3",
        "UART5",
        "idle::Idle::step",
        "output::Output::step",
    ];
    let Some(mut board) = boot() else { return };
    let samples = drive(40);
    common::send(&mut board, &samples, START);
    board.run(START + 50 * MS);
    board.snapshot("running");
    for task in tasks {
        board.restore("running");
        let original = board.read(At::Symbol(task), 2);
        board.patch(At::Symbol(task), HANG);
        if let Some(line) = task.strip_prefix("USART") {
            // Its handler runs for a damaged byte.
            board.configure(&format!("{task}.baud"), 57_600);
            board.send(line.parse().expect("a digit"), &[0]);
        }
        if task == "CAN1_RX0" {
            board.can_send(&data_frame(id11(0xAA), &[0; 8]));
        }
        let began = board.run(Duration::ZERO);
        let reset = board.run_until("reset", SECOND);
        let reset = reset.unwrap_or_else(|| panic!("a hang of {task} goes unnoticed"));
        println!("hang of {task}: reset after {:?}", reset - began);
        // 100 ms at 32 kHz after the last report: idle runs next within 10 ms, after the sample that lets the others report.
        assert!(reset - began <= 112 * MS, "{task}: {:?}", reset - began);
        board.patch(At::Symbol(task), &original);
        // The service line answers at its own rate.
        board.configure("USART6.baud", 115_200);
        board.run(START);
        let identity = service::info(&mut board).identity;
        assert_eq!((identity.reset, identity.crash), (ResetCause::Watchdog, None), "{task}");
    }
}

#[test]
fn hang_of_the_start() {
    let Some(mut board) = boot() else { return };
    let original = board.read(At::Symbol("idle::Idle::new"), 2);
    board.patch(At::Symbol("idle::Idle::new"), HANG);
    board.run(8 * SECOND);
    let resets = resets(&mut board);
    assert!(resets.len() >= 2 && resets.iter().skip(1).all(|(_, cause)| cause == "iwdg"), "{resets:?}");
    board.patch(At::Symbol("idle::Idle::new"), &original);
    board.run(5 * SECOND);
    assert_eq!(crash_of(&mut board), None);
}

#[test]
fn watchdog_at_the_ends_of_its_oscillator() {
    for hz in [17_000, 47_000] {
        let Some(mut board) = common::unpowered() else { return };
        board.configure("RCC.lsi_hz", hz);
        board.power_on();
        let samples = drive(150);
        common::send(&mut board, &samples, START);
        board.run(START + 2 * SECOND);
        assert_eq!(resets(&mut board).len(), 1, "{hz} Hz: a board that runs is not reset");
    }
}

/// A register that is changed while the board sleeps, and the bits of CFSR and the place of the fault that follows.
#[test]
fn a_hard_fault_leaves_its_status_and_place() {
    for (register, value, status, place) in [
        // The lowest words of the RAM: the next exception frame does not fit. STKERR: a bus fault on stacking for exception entry
        // (PM0214 4.4.10).
        ("sp", 0x2000_0008, 1 << 12, None),
        ("pc", 0x3000_0000, u32::MAX, Some(0x3000_0000)),
    ] {
        let Some(mut board) = common::started() else { return };
        common::fall_asleep(&mut board);
        board.set_register(register, value);
        assert!(board.run_until("reset", SECOND).is_some(), "no reset");
        board.run(START);
        let crash = crash_of(&mut board).expect("a reason");
        println!("{crash}");
        assert_eq!((crash.kind, crash.count), (CrashKind::HardFault, 1));
        assert_ne!(crash.status & status, 0, "CFSR {:#010x}", crash.status);
        assert!(place.is_none_or(|place| crash.place & !1 == place), "{crash}");
        // Asked once more after another start, there is none.
        board.reset_pin();
        board.run(START);
        assert_eq!(crash_of(&mut board), None);
    }
}

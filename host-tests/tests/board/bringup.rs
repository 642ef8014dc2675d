//! The bring-up image on the virtual board: every line of its output, on a board in order and on one that is not.

use crate::common::{SECOND, assert_well_set};
use gyronet::store::layout::{FLASH_BASE, SLOT_SIZE, SLOTS};
use gyronet_host_tests::board::{self, At, Board};
use std::time::Duration;

const NETDUINO: &str = "netduino-plus-2";
const REPORT: usize = 6;
const SPARE: u32 = FLASH_BASE + SLOTS.start + SLOT_SIZE as u32;

/// Runs a board's image to its end and gives its lines.
fn lines(feature: &str, prepare: impl FnOnce(&mut Board)) -> Option<(Board, Vec<String>)> {
    let elf = board::firmware(feature, env!("CARGO_TARGET_TMPDIR"), "bringup")?;
    let mut board = Board::unpowered(&elf)?;
    board.configure("USART2.baud", 921_600);
    board.configure("USART3.baud", 921_600);
    prepare(&mut board);
    board.power_on();
    let mut text = String::new();
    for _ in 0..12 {
        board.run(SECOND);
        text += &String::from_utf8(board.sent(REPORT)).expect("text");
        if text.contains("checks failed") {
            break;
        }
    }
    println!("{text}");
    let lines = text.lines().map(str::to_owned).filter(|line| !line.is_empty()).collect();
    Some((board, lines))
}

fn check<'l>(lines: &'l [String], name: &str) -> (&'l str, &'l str) {
    let rest = lines.iter().find_map(|line| line.strip_prefix(name)).expect(name).trim_start();
    rest.split_once("  ").unwrap_or((rest, ""))
}

#[test]
fn board_in_order() {
    let Some((mut board, lines)) = lines(NETDUINO, |_| ()) else { return };
    assert!(
        lines[0].starts_with("gyronet bringup") && lines[0].ends_with("started by power on"),
        "{lines:?}"
    );
    for (name, verdict, text) in [
        ("LED", "----", "it has blinked twice"),
        ("clock", "PASS", "168 MHz; the crystal has 25.00 MHz by the internal oscillator"),
        ("supply", "PASS", "above 3.0 V"),
        ("brown-out", "PASS", "set to level 3 (2.8 V) from the next power-on"),
        ("CAN", "PASS", "2 frames in loopback, the filter stops a third"),
        ("SPI1", "PASS", "an ICM-42688-P answers"),
        ("USART1", "----", "sends at 115200 baud; connect TX with RX to see it receive"),
        ("USART2", "----", "sends at 921600 baud; connect TX with RX to see it receive"),
        ("USART3", "----", "sends at 921600 baud; connect TX with RX to see it receive"),
        ("UART4", "----", "sends at 38400 baud; connect TX with RX to see it receive"),
        ("USART6", "----", "sends these lines; reading them over RTT does not check it"),
    ] {
        assert_eq!(check(&lines, name), (verdict, text), "{name}");
    }
    for (name, verdict, end) in
        [("flash", "PASS", " ms"), ("GyroNet", "PASS", "cycles a window of the paper's")]
    {
        let (found, text) = check(&lines, name);
        assert!(found == verdict && text.ends_with(end), "{name}: {found} {text}");
    }
    // The second start.
    let restarted =
        lines.iter().position(|line| line.ends_with("started by watchdog")).expect("it starts twice");
    assert_eq!(check(&lines[restarted..], "watchdog"), ("PASS", "reset the chip after 100 ms (60 to 200)"));
    assert_eq!(lines.last().map(String::as_str), Some("0 checks failed"));
    assert_well_set(&mut board);
    assert_eq!(board.read(At::Address(SPARE), SLOT_SIZE), vec![0xFF; SLOT_SIZE], "the sector is left blank");
    // From the next power-on the brown-out reset is at its level.
    board.power_cycle(SECOND, 2 * SECOND);
    let text = String::from_utf8(board.sent(REPORT)).expect("text");
    assert!(text.contains("brown-out    PASS  level 3 (2.8 V)"), "{text}");
}

#[test]
fn crystal_that_is_not_the_board_s() {
    for (feature, title, part, answer) in [
        (NETDUINO, "Netduino Plus 2", "Bmi088", "a BMI088 answers"),
        ("olimex-stm32-h405", "Olimex STM32-H405", "Asm330lhh", "an ASM330LHH answers"),
    ] {
        let wrong = |board: &mut Board| {
            board.configure("RCC.crystal_hz", 16_000_000);
            board.configure("SPI1.part", part);
        };
        let Some((_, lines)) = lines(feature, wrong) else { return };
        assert!(lines[0].contains(title), "{}", lines[0]);
        assert_eq!(check(&lines, "SPI1"), ("PASS", answer));
        assert_eq!(check(&lines, "clock"), ("FAIL", "16 MHz: the crystal has 16.000 MHz"));
        assert_eq!(check(&lines, "CAN"), ("FAIL", "the clock is not exact enough"));
        assert_eq!(lines.last().map(String::as_str), Some("2 checks failed"));
    }
}

#[test]
fn sensor_missing_and_sector_in_use() {
    let prepare = |board: &mut Board| {
        board.configure("SPI1.fitted", false);
        board.patch(At::Address(SPARE), b"weights");
    };
    let Some((_, lines)) = lines(NETDUINO, prepare) else { return };
    let (verdict, text) = check(&lines, "SPI1");
    assert!(verdict == "----" && text.starts_with("no sensor answers"), "{verdict} {text}");
    assert_eq!(check(&lines, "flash"), ("----", "sector 11 holds a weight file: not tried"));
}

#[test]
fn panic_leaves_its_reason_on_the_line_and_starts_again() {
    /// A place in memory that the image does not use, for the panic's location: file, its length, line, column.
    const LOCATION: u32 = 0x1000_0000;
    const FILE: &[u8] = b"src/provoked.rs";
    let Some(elf) = board::firmware(NETDUINO, env!("CARGO_TARGET_TMPDIR"), "bringup") else {
        return;
    };
    let Some(mut board) = Board::unpowered(&elf) else { return };
    board.power_on();
    board.run(Duration::from_millis(300));
    let _ = (board.sent(REPORT), board.events());
    let location = [LOCATION + 16, FILE.len() as u32, 42, 7].map(u32::to_le_bytes).concat();
    board.patch(At::Address(LOCATION), &[&location, FILE].concat());
    // The image calls this where a cell is borrowed twice.
    let (panic, _) = board.symbol("panic_already_borrowed");
    board.set_register("r0", LOCATION);
    board.set_register("pc", panic);
    let reset = board.run_until("reset", SECOND);
    let text = String::from_utf8(board.sent(REPORT)).expect("text");
    println!("{text}");
    assert!(reset.is_some(), "it starts again");
    assert!(text.contains("bringup      FAIL  panicked at src/provoked.rs:42:7"), "{text}");
    assert_eq!(
        board.events().last().map(|event| event.text("cause").to_owned()).as_deref(),
        Some("software")
    );
}

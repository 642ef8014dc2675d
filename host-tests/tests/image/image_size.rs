//! Flash, RAM, stack and panics of the firmware image, read from its machine code.

use gyronet_host_tests::{image, qemu};
use gyronet_tools::target::size::{BUDGETS, ImageSize};
use gyronet_tools::target::stack::{ImageStack, functions, handlers_without_barrier, priorities};
use std::time::Duration;

fn elf(test: &str, name: &str) -> Option<Vec<u8>> {
    let path = image::firmware(test, env!("CARGO_TARGET_TMPDIR"), name)?;
    Some(std::fs::read(path).expect("it was just built"))
}

/// These symbols end in the panic handler: the handler itself (`rust_begin_unwind`, under the
/// language's own mangling) and the core library's ways to it.
fn panics(elf: &[u8]) -> Vec<String> {
    let names = functions(elf).expect("a firmware image");
    names.into_iter().filter(|name| name.contains("panick") || name.contains("rust_begin_unwind")).collect()
}

#[test]
fn no_panic_in_the_image() {
    const NAME: &str = "no_panic_in_the_image";
    let Some(image) = elf(NAME, "coprocessor") else { return };
    // The linker keeps what is reached: what is not there is reached from nowhere.
    assert_eq!(panics(&image), [""; 0], "the image can panic");
    // The bench image can panic, and that is seen. It takes 20 s to build, and only the tests in QEMU need it as well.
    if qemu::available(NAME).is_none() {
        return;
    }
    let Some(bench) = elf(NAME, "bench") else { return };
    assert!(!panics(&bench).is_empty(), "the bench image has no panic handler: is the symbol table read?");
}

/// Arm erratum 838869 of the Cortex-M4 needs a barrier behind the last store of a short handler.
#[test]
fn short_handlers_end_with_a_barrier() {
    // Exception numbers of SysTick, CAN1_TX, CAN1_RX0, USART1, USART2, USART3 and USART6 (RM0090 table 62).
    const SHORT: [usize; 7] = [15, 16 + 19, 16 + 20, 16 + 37, 16 + 38, 16 + 39, 16 + 71];
    // UART4, the output task: long, and without one.
    const LONG: usize = 16 + 52;
    let Some(image) = elf("short_handlers_end_with_a_barrier", "coprocessor") else { return };
    assert_eq!(handlers_without_barrier(&image, &SHORT).expect("handlers"), [""; 0]);
    assert_eq!(handlers_without_barrier(&image, &[LONG]).expect("a handler").len(), 1, "it would be seen");
}

#[test]
fn budgets_hold() {
    const NAME: &str = "budgets_hold";
    let Some(image) = elf(NAME, "coprocessor") else { return };
    let stack = ImageStack::read(&image).expect("a bound");
    println!("{stack:?}");
    assert!(stack.deepest.iter().any(|(name, _)| name.contains("main")), "{:?}", stack.deepest);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("size.elf");
    std::fs::write(&folder, &image).expect("a scratch file");
    let size = ImageSize::read(&folder).expect("sizes");
    println!("{size:?}");
    let measured = [size.flash, size.static_ram, stack.worst().into()];
    assert!(measured.iter().zip(BUDGETS).all(|(bytes, budget)| *bytes <= budget), "{measured:?} {stack:?}");
}

/// The image's own list of priorities, which the bound rests on, is what its code sets.
#[test]
fn priorities_are_what_they_are_said_to_be() {
    const NAME: &str = "priorities_are_what_they_are_said_to_be";
    let Some(path) = image::coprocessor(NAME, env!("CARGO_TARGET_TMPDIR")) else { return };
    let listed = priorities(&std::fs::read(&path).expect("it was just built")).expect("a firmware image");
    println!("{listed:?}");
    let mut board = qemu::Board::boot(&path, 2, &[]);
    // When a receiver is on, RTIC has set all priorities but not yet released the interrupts.
    board.send(1, &[0], Duration::from_secs(20));
    let mut urgent = |number: usize| {
        // SHPR1 for exceptions 4 to 15, NVIC_IPR0 for interrupts (ARMv7-M, B3.2.10 and B3.4.7). The
        // STM32F4 has the upper four bits of each byte; RTIC's 1 is the least urgent, 15.
        let address = if number < 16 { 0xE000_ED18 + number - 4 } else { 0xE000_E400 + number - 16 };
        let word = board.word(address as u32 & !3);
        16 - (word.to_le_bytes()[address % 4] >> 4)
    };
    for (number, priority) in listed {
        assert_eq!(urgent(number), priority, "exception {number}");
    }
}

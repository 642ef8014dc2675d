//! Flash, RAM, stack and panics of the firmware image, read from its machine code.

use gyronet_host_tests::{image, qemu};
use gyronet_tools::target::size::{BUDGETS, ImageSize};
use gyronet_tools::target::stack::{ImageStack, functions, handlers_without_barrier};

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

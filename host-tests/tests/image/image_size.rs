//! Flash, RAM, stack and panics of the firmware image, read from its machine code.

use gyronet_host_tests::{image, require};
use gyronet_tools::target::size::{BUDGETS, ImageSize};
use gyronet_tools::target::stack::{ImageStack, functions};

fn elf(name: &str) -> Option<Vec<u8>> {
    let path = image::firmware(env!("CARGO_TARGET_TMPDIR"), name)?;
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
    let Some(image) = elf("coprocessor") else { return };
    // The linker keeps what is reached: what is not there is reached from nowhere.
    assert_eq!(panics(&image), [""; 0], "the image can panic");
    // The bench image can panic, and that is seen. It takes 20 s to build, and only the tests in QEMU need it as well.
    if require::qemu().is_none() {
        return;
    }
    let Some(bench) = elf("bench") else { return };
    assert!(!panics(&bench).is_empty(), "the bench image has no panic handler: is the symbol table read?");
}

#[test]
fn budgets_hold() {
    let Some(image) = elf("coprocessor") else { return };
    let stack = ImageStack::read(&image).expect("a bound");
    println!("{stack:?}");
    assert!(stack.deepest.iter().any(|(name, _)| name.contains("main")), "{:?}", stack.deepest);
    let size = ImageSize::read(&image).expect("sizes");
    println!("{size:?}");
    assert!(size.kernels > 0 && size.kernels <= 8 * 1024, "{size:?}");
    let measured = [size.flash, size.static_ram, stack.worst().into()];
    assert!(measured.iter().zip(BUDGETS).all(|(bytes, budget)| *bytes <= budget), "{measured:?} {stack:?}");
}

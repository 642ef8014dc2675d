//! Flash, RAM, stack and panics of the firmware image, read from its machine code.

use gyronet_host_tests::image;
use gyronet_tools::image_size::ImageSize;
use gyronet_tools::image_stack::{ImageStack, functions};

fn elf(test: &str, name: &str) -> Option<Vec<u8>> {
    let path = image::firmware(test, env!("CARGO_TARGET_TMPDIR"), name)?;
    Some(std::fs::read(path).expect("it was just built"))
}

/// Whatever ends in the panic handler: the handler itself (`rust_begin_unwind`, under the
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
    // The bench may panic, and that is seen.
    let Some(bench) = elf(NAME, "bench") else { return };
    assert!(!panics(&bench).is_empty(), "the bench image has no panic handler: is the symbol table read?");
}

#[test]
fn budgets_hold() {
    const NAME: &str = "budgets_hold";
    let Some(image) = elf(NAME, "coprocessor") else { return };
    let stack = ImageStack::read(&image).expect("a bound");
    println!("{stack:?}");
    assert!(stack.worst() <= 8 << 10, "{stack:?}");
    assert!(stack.deepest.iter().any(|(name, _)| name.contains("main")), "{:?}", stack.deepest);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("size.elf");
    std::fs::write(&folder, &image).expect("a scratch file");
    let size = ImageSize::read(&folder).expect("sizes");
    println!("{size:?}");
    assert!(size.flash <= 640 << 10 && size.static_ram <= 48 << 10, "{size:?}");
}

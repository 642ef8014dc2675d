//! No register of the part is written whole without a look at its reset value.
//!
//! svd2rust's `register().write(|w| ...)` begins at the register's RESET_VALUE, not at zero: bits that
//! the line does not name keep their reset value. `can.mcr().write(|w| w.inrq().set_bit())` wrote SLEEP,
//! too, and the controller never woke; `flash.cr().write(|w| w.ser().set_bit())` wrote LOCK, too, and
//! nothing was erased. So every such write in `src/bin` must be of a register that resets to zero, or
//! say what it begins with, in its line or the one above:
//!
//! ```text
//! // reset value: 0x0001_0002, SLEEP cleared below
//! ```
//!
//! The reset values are those of the `stm32f4` crate's own source.

mod reset_values;
mod writes;

use gyronet_host_tests::require::{self, Need};
use reset_values::ResetValues;
use std::path::{Path, PathBuf};
use writes::unexplained;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("host-tests is a folder of the workspace")
}

fn reset_values(test: &str) -> Option<ResetValues> {
    let folder = require::wants(test, Need::Qemu, reset_values::source(root()))?;
    Some(ResetValues::read(&folder).expect("the crate's source"))
}

/// Finds all Rust files in a folder and the folders in it.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn every_write_of_the_images_begins_at_zero_or_says_where() {
    const NAME: &str = "every_write_of_the_images_begins_at_zero_or_says_where";
    let Some(values) = reset_values(NAME) else { return };
    let mut files = Vec::new();
    sources(&root().join("src/bin"), &mut files);
    files.sort();
    let (mut complaints, mut writes) = (Vec::new(), 0);
    for file in &files {
        let text = std::fs::read_to_string(file).expect("a source file");
        let found = unexplained(&text, &values).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        writes += found.writes;
        let name = file.strip_prefix(root()).unwrap_or(file).display();
        complaints.extend(found.complaints.iter().map(|complaint| format!("{name}:{complaint}")));
    }
    println!("{writes} writes in {} files", files.len());
    assert!(writes > 20, "the images write registers: {writes} found");
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

/// The crate's values are those of RM0090.
#[test]
fn reset_values_are_those_of_the_manual() {
    let Some(values) = reset_values("reset_values_are_those_of_the_manual") else { return };
    for (peripheral, register, value) in [
        ("CAN1", "mcr", 0x0001_0002),
        ("CAN2", "mcr", 0x0001_0002),
        ("CAN1", "tir", 0),
        ("CAN1", "fr1", 0),
        ("FLASH", "cr", 0x8000_0000),
        ("FLASH", "keyr", 0),
        ("RCC", "pllcfgr", 0x2400_3010),
        ("IWDG", "rlr", 0x0FFF),
        ("IWDG", "kr", 0),
        ("usart2", "brr", 0),
        ("USART6", "sr", 0xC0),
        ("SPI1", "sr", 2),
        ("GPIOA", "moder", 0xA800_0000),
        ("GPIOH", "bsrr", 0),
        ("TIM5", "or", 0),
    ] {
        assert_eq!(values.of(peripheral, register), Some(value), "{peripheral}.{register}");
    }
    assert_eq!(values.of("CAN1", "moder"), None);
}

/// Returns the complaints of a file of these lines.
fn complaints(text: &str, values: &ResetValues) -> Vec<String> {
    unexplained(text, values).expect("Rust").complaints
}

#[test]
fn the_two_defects_that_this_is_for_are_found() {
    let Some(values) = reset_values("the_two_defects_that_this_is_for_are_found") else { return };
    let bus = "fn start(can: pac::CAN1) {\n    can.mcr().write(|w| w.inrq().set_bit());\n}\n";
    assert_eq!(
        complaints(bus, &values),
        ["2: mcr of CAN1 resets to 0x0001_0002, which this write begins with: no comment \
          `// reset value: 0x0001_0002` here or above"]
    );
    let flash = "struct Flash(pac::FLASH);\nimpl Flash {\n    fn erase(&self, n: u8) {\n        self.0\n            .cr()\n            \
                 .write(|w| unsafe { w.ser().set_bit().snb().bits(n) });\n    }\n}\n";
    let [complaint] = &complaints(flash, &values)[..] else { panic!("one") };
    assert!(complaint.starts_with("5: cr of FLASH resets to 0x8000_0000"), "{complaint}");
}

#[test]
fn what_is_explained_or_zero_passes() {
    let Some(values) = reset_values("what_is_explained_or_zero_passes") else { return };
    for text in [
        "fn f(can: pac::CAN1) {\n    // reset value: 0x0001_0002, SLEEP cleared here\n    \
         can.mcr().write(|w| w.sleep().clear_bit());\n}",
        "fn f(can: pac::CAN1) {\n    can.mcr().write(|w| w.inrq().set_bit()); // reset value: 0x10002\n}",
        // Between the register and what is written.
        "fn f(can: pac::CAN1) {\n    can.mcr()\n        // reset value: 0x0001_0002\n        \
         .write(|w| w.sleep().clear_bit());\n}",
        // Zero, though registers of this name in other peripherals are not: it is this one's that counts.
        "fn f(flash: pac::FLASH) {\n    flash.sr().write(|w| unsafe { w.bits(0xF2) });\n}",
        "use super::pac::{Interrupt, usart1::RegisterBlock};\nfn f(usart: &RegisterBlock) {\n    \
         usart.dr().write(|w| w);\n}",
        "fn f(can: pac::CAN1) {\n    can.mcr().modify(|_, w| w.inrq().set_bit());\n    \
         can.mcr().write_with_zero(|w| w.inrq().set_bit());\n}",
        // Writes of other kinds.
        "fn f(slot: Slot) {\n    slot.write(make());\n    port.line().write(byte);\n}",
    ] {
        assert_eq!(complaints(text, &values), [""; 0], "{text}");
    }
}

#[test]
fn what_is_hidden_or_out_of_date_is_reported() {
    let Some(values) = reset_values("what_is_hidden_or_out_of_date_is_reported") else { return };
    for (text, begins) in [
        // Another value than the crate's.
        (
            "fn f(can: pac::CAN1) {\n    // reset value: 0x0001_0000\n    can.mcr().write(|w| w);\n}",
            "3: mcr of CAN1 resets to 0x0001_0002",
        ),
        // No value at all.
        (
            "fn f(can: pac::CAN1) {\n    // reset value: looked up\n    can.mcr().write(|w| w);\n}",
            "3: mcr of CAN1 resets to 0x0001_0002",
        ),
        // The comment of another line, and no comment but a text.
        (
            "fn f(can: pac::CAN1) {\n    // reset value: 0x0001_0002\n\n    can.mcr().write(|w| w);\n}",
            "4: mcr of CAN1",
        ),
        (
            "fn f(can: pac::CAN1) {\n    log(\"reset value: 0x0001_0002\");\n    can.mcr().write(|w| w);\n}",
            "3: mcr of CAN1",
        ),
        // A file that names no peripheral: any register of this name may be meant.
        ("fn f(x: X) {\n    x.mcr().write(|w| w);\n}", "2: mcr of CAN1"),
        (
            "fn f(can: pac::CAN1) {\n    let mcr = can.mcr();\n    mcr.write(|w| w);\n}",
            "3: a register behind a name",
        ),
        (
            "fn f(can: pac::CAN1) {\n    can.nonsense().write(|w| w);\n}",
            "2: nonsense is no register of the part",
        ),
        ("fn f(can: pac::CAN1) {\n    check!(can.mcr().write(|w| w));\n}", "2: a write inside a macro"),
    ] {
        let found = complaints(text, &values);
        assert!(found.len() == 1 && found[0].starts_with(begins), "{text}\n{found:?}");
    }
}

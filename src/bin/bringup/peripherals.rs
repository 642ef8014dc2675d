//! Checks of the LED, the clock, the supply, CAN, the sensor and the flash.

use crate::boards::BOARD;
use crate::brownout;
use crate::report::Report;
use crate::stm32f405::can::{self, Can, Mode, State};
use crate::stm32f405::clocks::Clocks;
use crate::stm32f405::flash::{Flash, FlashError};
use crate::stm32f405::{Chip, pac, spi, supply as pvd, timer};
use embedded_can::{Frame as _, Id, StandardId};
use embedded_hal::spi::{ErrorKind, Operation, SpiDevice as _};
use gyronet::can::DataFrame;
use gyronet::store::layout::{SLOT_SIZE, SLOTS};

/// Register WHO_AM_I of an ICM-42688-P with the read bit, and its value (DS-000347 14.55).
const WHO_AM_I: u8 = 0x75 | 0x80;
const ICM_42688: u8 = 0x47;
/// The same of an ASM330LHH.
const WHO_AM_I_ASM: u8 = 0x0F | 0x80;
const ASM_330: u8 = 0x6B;
/// Chip identities of a BMI088's accelerometer and gyro, both in register 0, and the bytes to read either.
const BMI_088: [u8; 2] = [0x1E, 0x0F];
const BMI_088_READ: [&[u8]; 2] = [&[0x80, 0], &[0x80]];
/// Time limit for the frames in loopback, us. A frame at 500 kbit/s takes 0.25 ms.
const FRAME_US: u64 = 5_000;

pub fn led(report: &mut Report, clocks: &Clocks) {
    let Some((led, lit)) = BOARD.led else {
        return report.manual_check("LED", format_args!("the board has none"));
    };
    led.output(!lit);
    for level in [lit, !lit, lit, !lit] {
        led.set(level);
        cortex_m::asm::delay(clocks.core_hz / 10);
    }
    report.manual_check("LED", format_args!("it has blinked twice"));
}

/// Reports the clock, with the crystal measured against the internal oscillator.
pub fn clock(report: &mut Report, chip: &Chip) {
    let clocks = &chip.clocks;
    match clocks.fault {
        None => report.pass(
            "clock",
            format_args!(
                "{} MHz; the crystal has {}.{:02} MHz by the internal oscillator",
                clocks.core_hz / 1_000_000,
                clocks.measured_hz / 1_000_000,
                clocks.measured_hz / 10_000 % 100
            ),
        ),
        Some(fault) => report.fail("clock", format_args!("16 MHz: {fault}")),
    }
}

pub fn supply(report: &mut Report, flash: &pac::FLASH) {
    if pvd::is_low() {
        report.fail("supply", format_args!("below 3.0 V"));
    } else {
        report.pass("supply", format_args!("above 3.0 V"));
    }
    if brownout::is_level_3(flash) {
        return report.pass("brown-out", format_args!("level 3 (2.8 V)"));
    }
    match brownout::set_level_3(flash) {
        Ok(()) => report.pass("brown-out", format_args!("set to level 3 (2.8 V) from the next power-on")),
        Err(error) => report.fail("brown-out", format_args!("{error:?}")),
    }
}

/// Sends two frames in loopback that must pass the filter, and one that the filter must stop.
pub fn can(report: &mut Report, chip: &Chip, registers: pac::CAN1) {
    const NAME: &str = "CAN";
    if !chip.clocks.exact() {
        return report.fail(NAME, format_args!("the clock is not exact enough"));
    }
    let [Some(wanted), Some(other)] = [StandardId::new(0x155), StandardId::new(0x2AA)] else { return };
    let mut can = match Can::start(registers, Mode::Loopback) {
        Ok(can) => can,
        Err(fault) => return report.fail(NAME, format_args!("{fault}")),
    };
    can.receive_only([(Id::Standard(wanted), u32::MAX)].into_iter());
    can.join();
    let sent = [(other, 0), (wanted, 1), (wanted, 2)].map(|(id, number)| DataFrame::new(id, &[number; 8]));
    for frame in sent.iter().flatten() {
        if !can.transmit(frame, 0) {
            return report.fail(NAME, format_args!("no mailbox is free"));
        }
    }
    let until = timer::micros() + FRAME_US;
    let mut received = [None; 2];
    for place in &mut received {
        *place = loop {
            if let Some(next) = can::receive() {
                break next.frame;
            }
            if timer::micros() > until {
                break None;
            }
        };
    }
    let due = [sent[1], sent[2]];
    if received == due && can.state() == State::Active {
        report.pass(NAME, format_args!("2 frames in loopback, the filter stops a third"));
    } else {
        let count = received.iter().flatten().count();
        report.fail(NAME, format_args!("{count} of 2 frames came back as sent, {:?}", can.state()));
    }
}

pub fn sensor(report: &mut Report, registers: &pac::SPI1) {
    const NAME: &str = "SPI1";
    let Some(pins) = BOARD.spi else {
        return report.manual_check(NAME, format_args!("the board has no sensor there"));
    };
    let mut parts = spi::start(registers, pins);
    let mut read = |part: usize, command: &[u8]| {
        let mut identity = [0];
        parts[part].transaction(&mut [Operation::Write(command), Operation::Read(&mut identity)])?;
        Ok(identity[0])
    };
    let mut identities = || {
        let icm = read(0, &[WHO_AM_I])?;
        let asm = read(0, &[WHO_AM_I_ASM])?;
        // The rising chip select has switched a BMI088's accelerometer to SPI.
        Ok::<_, ErrorKind>((icm, asm, [read(0, BMI_088_READ[0])?, read(1, BMI_088_READ[1])?]))
    };
    match identities() {
        Err(error) => report.fail(NAME, format_args!("{error:?}")),
        Ok((ICM_42688, ..)) => report.pass(NAME, format_args!("an ICM-42688-P answers")),
        Ok((.., BMI_088)) => report.pass(NAME, format_args!("a BMI088 answers")),
        Ok((_, ASM_330, _)) => report.pass(NAME, format_args!("an ASM330LHH answers")),
        Ok((icm, asm, [accelerometer, gyro])) => report.manual_check(
            NAME,
            format_args!(
                "no sensor answers (ICM-42688-P {icm:#04x}, ASM330LHH {asm:#04x}, BMI088 {accelerometer:#04x} {gyro:#04x})"
            ),
        ),
    }
}

/// Programs and erases the last sector, if its first 64 bytes are blank.
pub fn flash(report: &mut Report, registers: pac::FLASH) {
    const NAME: &str = "flash";
    let flash = Flash::new(registers);
    let sector = SLOTS.start + SLOT_SIZE as u32;
    let mut first = [0; 64];
    flash.read(sector, &mut first);
    if first != [0xFF; 64] {
        return report.manual_check(NAME, format_args!("sector 11 holds a weight file: not tried"));
    }
    let begin = timer::micros();
    let tried = try_sector(&flash, sector);
    let ms = (timer::micros() - begin) / 1_000;
    match tried {
        Ok(()) => report.pass(NAME, format_args!("sector 11 programmed, verified and erased in {ms} ms")),
        Err(error) => report.fail(NAME, format_args!("sector 11: {error:?}")),
    }
}

fn try_sector(flash: &Flash, sector: u32) -> Result<(), FlashError> {
    flash.write(sector, &[0x55, 0xAA, 0x00, 0xF0, 1, 2, 3, 4])?;
    // The driver checks that the erased sector reads as ones.
    flash.erase(sector)
}

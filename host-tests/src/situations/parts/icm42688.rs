//! 20-bit FIFO packets, and a simulated SPI bus for the driver: reset, identity, settings, packets, and the register
//! that is checked with each packet.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use gyronet::sample::ImuSample;
use gyronet::sensor::icm42688::packet::Packet;
use gyronet::sensor::icm42688::registers as reg;
use gyronet::sensor::spi::READ;
use gyronet::units::{Micros, STANDARD_GRAVITY};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Step of a rate, 1/131 deg/s: the part uses 19 of the 20 bits.
const RATE_STEP: f64 = std::f64::consts::PI / 180.0 / 131.0;
/// Step of an acceleration, 1/8192 g: the part uses 18 of the 20 bits.
const FORCE_STEP: f64 = STANDARD_GRAVITY as f64 / 8192.0;
/// Counts of a 20-bit reading per step.
const RATE_COUNTS: f64 = 2.0;
const FORCE_COUNTS: f64 = 4.0;
/// Ends of the range of an acceleration, counts; lower counts mean "no reading".
pub const ENDS: [f64; 2] = [-524_256.0, 524_284.0];
/// Range of the part's 16-bit time counter.
const WRAP: u64 = 1 << 16;
/// Time after which the counter wraps, microseconds; a count is 32/30 us.
pub const WRAP_US: f64 = WRAP as f64 * 32.0 / 30.0;

/// Returns the nearest count of the part's counter at a time, without wrapping.
const fn counts(time: Micros) -> u64 {
    (time.0 * 30 + 16) / 32
}

/// Encodes a sample as a packet, with the readings rounded to the part's steps and clipped at the ends of the range.
pub fn packet(sample: &ImuSample) -> Packet {
    let reading = |value: f64, step: f64, counts: f64| {
        Some((libm::round(value / step) * counts).clamp(ENDS[0], ENDS[1]) as i32)
    };
    Packet {
        acceleration: sample
            .specific_force
            .map(|force| reading(force.metre_per_sec2(), FORCE_STEP, FORCE_COUNTS)),
        rate: sample.angular_rate.map(|rate| reading(rate.rad_per_sec(), RATE_STEP, RATE_COUNTS)),
        temperature: sample.temperature.map(|code| (f32::from(code.0) * 1.3248 - 3312.0).round() as i16),
        time: (counts(sample.time) % WRAP) as u16,
    }
}

/// A simulated part: registers that keep what is written, and a FIFO.
#[derive(Debug, Default)]
struct Simulated {
    registers: std::collections::HashMap<(u8, u8), u8>,
    bank: u8,
    fifo: VecDeque<u8>,
    /// What was written to the registers but that of the bank: bank, address, value.
    written: Vec<(u8, u8, u8)>,
    /// A register that answers this, whatever is written.
    held: Option<(u8, u8, u8)>,
}

impl Simulated {
    fn write(&mut self, address: u8, value: u8) {
        if address == reg::BANK_SEL {
            self.bank = value;
            return;
        }
        self.written.push((self.bank, address, value));
        if (self.bank, address) == (0, reg::SIGNAL_PATH_RESET) {
            self.fifo.clear();
        } else if (self.bank, address) != (0, reg::DEVICE_CONFIG) {
            self.registers.insert((self.bank, address), value);
        }
    }

    fn read(&mut self, address: u8, to: &mut [u8]) {
        if let Some((.., held)) = self.held.filter(|(bank, at, _)| (*bank, *at) == (self.bank, address)) {
            return to.fill(held);
        }
        let waiting = (self.fifo.len() as u16).to_be_bytes();
        for (offset, byte) in to.iter_mut().enumerate() {
            *byte = match address {
                reg::FIFO_DATA => self.fifo.pop_front().unwrap_or(0x80),
                reg::FIFO_COUNTH => waiting[offset % 2],
                reg::WHO_AM_I => reg::IDENTITY,
                a => self.registers.get(&(self.bank, a)).copied().unwrap_or(0),
            };
        }
    }
}

/// A simulated SPI bus; its clones share the part, so that the FIFO can be filled while the driver owns a clone.
#[derive(Debug, Clone, Default)]
pub struct Bus(Arc<Mutex<Simulated>>);

impl Bus {
    pub fn fill(&self, bytes: impl IntoIterator<Item = u8>) {
        self.part().fifo.extend(bytes);
    }

    /// Sets a register as the part has it after a reset.
    pub fn set(&self, bank: u8, address: u8, value: u8) {
        self.part().registers.insert((bank, address), value);
    }

    /// Bank, address and value of a register that answers this from now on, whatever is written.
    pub fn hold(&self, held: Option<(u8, u8, u8)>) {
        self.part().held = held;
    }

    /// What was written to the registers but that of the bank: bank, address, value.
    pub fn written(&self) -> Vec<(u8, u8, u8)> {
        self.part().written.clone()
    }

    fn part(&self) -> MutexGuard<'_, Simulated> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ErrorType for Bus {
    type Error = Infallible;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let mut part = self.part();
        let mut selected = 0;
        for operation in operations {
            match operation {
                Operation::Write(bytes) => match **bytes {
                    [address] => selected = address & !READ,
                    [address, value] => part.write(address, value),
                    _ => {}
                },
                Operation::Read(to) => part.read(selected, to),
                // The driver does not use these operations.
                Operation::Transfer(..) | Operation::TransferInPlace(_) | Operation::DelayNs(_) => {}
            }
        }
        Ok(())
    }
}

/// A delay that does not wait.
pub struct NoDelay;

impl DelayNs for NoDelay {
    fn delay_ns(&mut self, _ns: u32) {}
}

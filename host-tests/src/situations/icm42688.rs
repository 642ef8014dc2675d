//! 20-bit FIFO packets of an ICM-42688-P, and a simulated part for its driver.

use crate::spi::Part;
use gyronet::sample::ImuSample;
use gyronet::sensor::icm42688::packet::Packet;
use gyronet::sensor::icm42688::registers as reg;
use gyronet::units::STANDARD_GRAVITY;
use std::collections::VecDeque;

/// Step of a rate, 1/131 deg/s: the part uses 19 of the 20 bits.
const RATE_STEP: f64 = std::f64::consts::PI / 180.0 / 131.0;
/// Step of an acceleration, 1/8192 g: the part uses 18 of the 20 bits.
const FORCE_STEP: f64 = STANDARD_GRAVITY as f64 / 8192.0;
/// Counts of a 20-bit reading per step.
const RATE_COUNTS: f64 = 2.0;
const FORCE_COUNTS: f64 = 4.0;
/// Ends of the range of an acceleration, counts; lower counts mean "no reading".
const ENDS: [f64; 2] = [-524_256.0, 524_284.0];

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
        // Time stamps have 16 bits of 32/30 us.
        time: ((sample.time.0 * 30 + 16) / 32) as u16,
    }
}

#[derive(Debug, Default)]
pub struct Simulated {
    /// By bank and address.
    pub registers: std::collections::HashMap<(u8, u8), u8>,
    bank: u8,
    pub fifo: VecDeque<u8>,
    /// What was written to the registers but that of the bank: bank, address, value.
    pub written: Vec<(u8, u8, u8)>,
    /// A register that answers this, whatever is written.
    pub held: Option<(u8, u8, u8)>,
}

impl Part for Simulated {
    fn write(&mut self, _: usize, address: u8, value: u8) {
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

    fn read(&mut self, _: usize, address: u8, to: &mut [u8]) {
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

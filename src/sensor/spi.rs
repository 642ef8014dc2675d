//! Code that the drivers of inertial sensors on SPI share: errors, registers, the check of a setting, conversions.
//!
//! Each part checks a register at each call for a sample, so that a flipped bit is found within as many calls as it
//! has registers. Two kinds of error concern the caller: the part must be configured again, or a sample is lost
//! ([`SpiError::is_lost`]).

use crate::sample::{ImuSample, Validity};
use crate::units::{AngularRate, CentiCelsius, Micros, STANDARD_GRAVITY, SpecificForce};
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{Operation, SpiDevice};

/// Bit 7 of an address marks a read.
pub const READ: u8 = 0x80;
/// Largest number of polls of a reset, 1 ms apart.
const RESET_POLLS: u8 = 10;

/// The error of a sensor on SPI or of its bus. Of a BMI088, bank 0 is the accelerometer and 1 the gyro.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs, reason = "its messages say it")]
pub enum SpiError<E> {
    #[error("the bus failed: {0:?}")]
    Bus(E),
    #[error("no answer after the reset")]
    Reset,
    #[error("the identity in bank {bank} is {got:02x}, should be {expected:02x}")]
    Identity { bank: u8, got: u8, expected: u8 },
    #[error("the self-test has failed, bank {bank}")]
    SelfTest { bank: u8 },
    /// A register does not hold the value that was written: configure the sensor again.
    #[error("register {address:02x} of bank {bank} holds {got:02x}, not {expected:02x}")]
    Setting { bank: u8, address: u8, got: u8, expected: u8 },
    #[error("no rate and acceleration of one time")]
    NoReading,
    #[error("the FIFO was full; samples are lost")]
    Overflow,
    /// What the FIFO gave is not what was configured, or was changed on the bus.
    #[error("the FIFO gave {got:02x} where a packet begins")]
    Packet { got: u8 },
}

impl<E> SpiError<E> {
    /// Returns true if the sensor must be configured again; false if a sample is missing and the next one may come.
    pub const fn is_lost(&self) -> bool {
        !matches!(self, Self::NoReading | Self::Overflow | Self::Packet { .. })
    }
}

/// The value that a register of the configuration must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Setting {
    /// Bank of registers, or number of the die.
    pub bank: u8,
    /// Address of the register.
    pub address: u8,
    /// Bits that are written; the other bits keep their reset values.
    pub mask: u8,
    /// Value of these bits.
    pub value: u8,
}

impl Setting {
    /// Returns the setting of a whole register.
    pub const fn new(bank: u8, address: u8, value: u8) -> Self {
        Self { bank, address, mask: 0xFF, value }
    }

    pub(super) const fn check<E>(self, held: u8) -> Result<(), SpiError<E>> {
        let Self { bank, address, mask, value: expected } = self;
        let got = held & mask;
        if got == expected { Ok(()) } else { Err(SpiError::Setting { bank, address, got, expected }) }
    }
}

#[derive(Debug)]
pub(super) struct Chip<SPI> {
    pub(super) spi: SPI,
    /// True if a byte without meaning precedes what is read.
    pub(super) has_dummy: bool,
}

impl<SPI: SpiDevice> Chip<SPI> {
    pub(super) fn write(&mut self, address: u8, value: u8) -> Result<(), SpiError<SPI::Error>> {
        self.transaction(&mut [Operation::Write(&[address, value])])
    }

    pub(super) fn read<const N: usize>(&mut self, address: u8) -> Result<[u8; N], SpiError<SPI::Error>> {
        let mut values = [0; N];
        let (plain, with_dummy) = ([address | READ], [address | READ, 0]);
        let command: &[u8] = if self.has_dummy { &with_dummy } else { &plain };
        self.transaction(&mut [Operation::Write(command), Operation::Read(&mut values)])?;
        Ok(values)
    }

    pub(super) fn identify(
        &mut self,
        bank: u8,
        address: u8,
        expected: u8,
    ) -> Result<(), SpiError<SPI::Error>> {
        let [got] = self.read(address)?;
        if got == expected { Ok(()) } else { Err(SpiError::Identity { bank, got, expected }) }
    }

    /// Waits until bits have fallen that stand during a reset.
    pub(super) fn wait_for_reset(
        &mut self,
        address: u8,
        bits: u8,
        delay: &mut impl DelayNs,
    ) -> Result<(), SpiError<SPI::Error>> {
        for _ in 0..RESET_POLLS {
            delay.delay_ms(1);
            let [state] = self.read(address)?;
            if state & bits == 0 {
                return Ok(());
            }
        }
        Err(SpiError::Reset)
    }

    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), SpiError<SPI::Error>> {
        self.spi.transaction(operations).map_err(SpiError::Bus)
    }
}

pub(super) const fn passed<E>(bank: u8, has_passed: bool) -> Result<(), SpiError<E>> {
    if has_passed { Ok(()) } else { Err(SpiError::SelfTest { bank }) }
}

#[doc(hidden)]
pub fn vector(&[x0, x1, y0, y1, z0, z1]: &[u8; 6]) -> [i16; 3] {
    [[x0, x1], [y0, y1], [z0, z1]].map(i16::from_le_bytes)
}

/// Converts readings in g and deg/s to the pipeline's units; `None` if one does not fit.
pub(super) fn sample(
    time: Micros,
    g: [f32; 3],
    dps: [f32; 3],
    temperature: Option<CentiCelsius>,
    is_clipped: bool,
) -> Option<ImuSample> {
    let rate = dps.map(|dps| AngularRate::from_rad_per_sec(dps.to_radians()).ok());
    let force = g.map(|g| SpecificForce::from_metre_per_sec2(g * STANDARD_GRAVITY).ok());
    let ([Some(ax), Some(ay), Some(az)], [Some(gx), Some(gy), Some(gz)]) = (force, rate) else { return None };
    let (specific_force, angular_rate) = ([ax, ay, az], [gx, gy, gz]);
    Some(ImuSample {
        time,
        specific_force,
        angular_rate,
        temperature,
        validity: Validity::reported(is_clipped),
    })
}

//! Decoders of the bytes of a sensor into samples.
//!
//! The pipeline sees only the samples of a part: [`ImuSample`] or [`FogSample`], in fixed
//! point, with the part's own time unwrapped. [`Source`] is the common interface of all parts, so that firmware can be
//! generic over the part. The image selects one of its parts at the start, by configuration.
//!
//! | part | line | type | sample |
//! |---|---|---|---|
//! | Xsens MTi | UART | [`xsens::Mti`] | [`ImuSample`] |
//! | KVH DSP-1760, 17xx | RS-422 | [`dsp1760::Dsp1760`] | `FogSample` |
//! | TDK ICM-42688-P | SPI | [`icm42688::Icm42688`] | [`ImuSample`] |
//! | Bosch BMI088 | SPI, two chip selects | [`bmi088::Bmi088`] | [`ImuSample`] |
//! | ST ASM330LHH | SPI | [`asm330lhh::Asm330lhh`] | [`ImuSample`] |
//!
//! UART parts are read through [`serial::Serial`] over any port with the traits of `embedded-io`; the maker's tool sets
//! them up once. SPI parts take an `embedded_hal::spi::SpiDevice`, and have one error ([`spi::SpiError`]). Either way it is a [`Source`].
//!
//! # Which errors a parser detects
//!
//! | frame | check | a flipped bit | undetected |
//! |---|---|---|---|
//! | MTData2 | sum of bytes, 8 bits | refused | one in 256 other errors |
//! | DSP-1760 | CRC of 32 bits | refused | one in 4 x 10^9 |
//! | ICM-42688 packet | none, except its header | a reading may be another one | that reading |
//! | BMI088 frame | none, except the accelerometer's header | a reading may be another one | that reading |
//! | ASM330LHH word | parity of its tag | a reading may be another one | that reading |
//!
//! The last three have no check on the wire: keep their lines short, and rely on the pipeline's own limits.
//!
//! `src/bin/PORTING.md` lists the six steps to add a part.

pub mod asm330lhh;
pub mod bmi088;
pub mod dsp1760;
#[doc(hidden)]
pub mod framer;
pub mod icm42688;
pub mod serial;
pub mod spi;
mod stamps;
pub mod xsens;

use crate::sample::{FogSample, ImuSample};
use asm330lhh::Asm330lhh;
use bmi088::Bmi088;
use dsp1760::{Dsp1760, Dsp1760Error};
use icm42688::Icm42688;
use xsens::{Mti, XsensError};

/// Delivers the samples of a part.
pub trait Source {
    /// The type of the part's samples: [`ImuSample`] or [`FogSample`].
    type Sample;
    /// The error of a frame or a transfer.
    type Error: core::error::Error;

    /// Returns the next sample: `Some(Err)` for an invalid frame, `None` if no complete frame is waiting.
    fn next_sample(&mut self) -> Option<Result<Self::Sample, Self::Error>>;
}

/// The result of a read, as a source that delivers it once.
impl<S, E: core::error::Error> Source for Option<Result<S, E>> {
    type Sample = S;
    type Error = E;

    fn next_sample(&mut self) -> Option<Result<S, E>> {
        self.take()
    }
}

/// Delivers the samples of a part that sends a stream of bytes.
pub trait ByteSource: Source {
    /// Accepts one byte. Call [`Source::next_sample`] until `None` before the next byte.
    fn receive(&mut self, byte: u8);
    /// Returns the number of candidate frames whose checksum did not match.
    fn bad_checksums(&self) -> u32;
}

macro_rules! spi_sources {
    ($($part:ident),*) => {$(
        impl<SPI: embedded_hal::spi::SpiDevice> Source for $part<SPI> {
            type Sample = ImuSample;
            type Error = spi::SpiError<SPI::Error>;

            fn next_sample(&mut self) -> Option<Result<ImuSample, Self::Error>> {
                self.next_sample().transpose()
            }
        }
    )*};
}

spi_sources!(Asm330lhh, Bmi088, Icm42688);

macro_rules! byte_sources {
    ($($part:ident: $sample:ident, $error:ident;)*) => {$(
        impl Source for $part {
            type Sample = $sample;
            type Error = $error;

            #[inline]
            fn next_sample(&mut self) -> Option<Result<$sample, $error>> {
                // Only one byte in 36 or more ends a message, so most calls return early.
                if self.framer.is_waiting() { None } else { self.next_message() }
            }
        }

        impl ByteSource for $part {
            #[inline]
            fn receive(&mut self, byte: u8) {
                self.framer.receive(byte);
            }

            fn bad_checksums(&self) -> u32 {
                self.framer.bad_checksums()
            }
        }
    )*};
}

byte_sources! {
    Mti: ImuSample, XsensError;
    Dsp1760: FogSample, Dsp1760Error;
}

//! A GNSS receiver on a serial line of its own, in place of one on the bus.
//!
//! A fix counts from its arrival: the time that the receiver and the line take is part of the lag that the estimator
//! finds.

use super::nmea::Sentences;
use super::ubx::{self, Ubx};
use super::{Fix, HeadingError, Read};
use crate::health::count;
use crate::sensor::framer::Framer;
use crate::sensor::{ByteSource, Source};

/// The line of a GNSS receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GnssSettings {
    /// What the receiver sends. UBX may come beside NMEA, NMEA comes alone.
    pub protocol: GnssProtocol,
    /// Bit rate, 4800 to 460800.
    pub baud: u32,
}

/// Messages with a course.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GnssProtocol {
    /// UBX-NAV-PVT of u-blox, with accuracies.
    Ubx,
    /// RMC or VTG of NMEA 0183 from 2.3 on, which have a mode. It does not tell a course by satellites from one that
    /// the receiver's own gyro took part in: a receiver with sensors of its own needs [`Self::Ubx`].
    Nmea,
}

/// The parser of a line: bytes in, fixes out; a damaged message is an error, the next good one is read.
#[derive(Debug, Clone)]
pub struct GnssLine {
    parser: Parser,
    /// The error of a damaged message, and the message behind it, which is returned after the error.
    damage: Option<HeadingError>,
    kept: Option<Read>,
    bad_checksums: u32,
}

#[derive(Debug, Clone)]
enum Parser {
    Ubx(Framer<Ubx, { ubx::MAX_FRAME }>),
    Nmea(Sentences),
}

impl GnssLine {
    /// Creates a parser that has received nothing.
    pub const fn new(protocol: GnssProtocol) -> Self {
        let parser = match protocol {
            GnssProtocol::Ubx => Parser::Ubx(Framer::new()),
            GnssProtocol::Nmea => Parser::Nmea(Sentences::new()),
        };
        Self { parser, damage: None, kept: None, bad_checksums: 0 }
    }

    /// Drops the message in progress: the line has lost a byte, which a checksum of 8 bits may miss.
    pub fn interrupt(&mut self) {
        match &mut self.parser {
            Parser::Ubx(framer) => *framer = Framer::new(),
            Parser::Nmea(sentences) => sentences.interrupt(),
        }
    }

    fn read(&mut self) -> Option<Read> {
        match &mut self.parser {
            Parser::Ubx(framer) => {
                let bad = framer.bad_checksums();
                let read = framer.next_frame().map(ubx::read);
                self.damage = (framer.bad_checksums() != bad).then_some(HeadingError::Checksum);
                read
            }
            Parser::Nmea(sentences) => sentences.read(),
        }
    }
}

impl Source for GnssLine {
    type Sample = Fix;
    type Error = HeadingError;

    fn next_sample(&mut self) -> Option<Result<Fix, HeadingError>> {
        loop {
            if self.kept.is_none() {
                self.kept = self.read();
            }
            let read = match self.damage.take() {
                Some(damage) => Some(Err(damage)),
                None => self.kept.take()?,
            };
            let Some(read) = read else { continue };
            count(&mut self.bad_checksums, u32::from(read == Err(HeadingError::Checksum)));
            return Some(read);
        }
    }
}

impl ByteSource for GnssLine {
    fn receive(&mut self, byte: u8) {
        match &mut self.parser {
            Parser::Ubx(framer) => framer.receive(byte),
            Parser::Nmea(sentences) => self.damage = sentences.receive(byte).err(),
        }
    }

    fn bad_checksums(&self) -> u32 {
        self.bad_checksums
    }
}

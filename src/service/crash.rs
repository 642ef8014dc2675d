//! A crash record holds why and where the image stopped; it is kept in RAM across the reset that follows.

use core::fmt;
use serde::{Deserialize, Serialize};

/// Number of bytes kept of a source file's path, from its end.
pub const FILE: usize = 24;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CrashKind {
    Panic,
    /// A bus, usage or memory fault escalated to a hard fault.
    HardFault,
    /// An exception or interrupt without a handler was raised, with this number (ICSR.VECTACTIVE).
    Unhandled(u16),
    CrystalStopped,
    /// The supply fell below 2.9 V.
    SupplyLow,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Crash {
    pub kind: CrashKind,
    /// Program counter at a fault, or line of a panic; 0 if neither is known.
    pub place: u32,
    /// Link register at a fault, which usually points into the caller.
    pub link: u32,
    /// Fault status register CFSR (PM0214 4.4.10).
    pub status: u32,
    /// Address of the faulting access, if CFSR marks it as valid.
    pub address: u32,
    /// End of the path of a panic's source file, padded with zeros.
    pub file: [u8; FILE],
    pub count: u32,
}

impl Crash {
    pub fn file(&self) -> &str {
        let text = core::str::from_utf8(&self.file).unwrap_or_default();
        text.trim_end_matches('\0')
    }
}

impl fmt::Display for Crash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, place, link, status, address, count, .. } = self;
        match kind {
            CrashKind::Panic => write!(f, "panic in line {place} of {}", self.file())?,
            CrashKind::HardFault => {
                write!(f, "hard fault at {place:#010x}, called from {link:#010x}, CFSR {status:#010x}")?;
                // BFARVALID or MMARVALID.
                if status & (1 << 15 | 1 << 7) != 0 {
                    write!(f, ", address {address:#010x}")?;
                }
            }
            CrashKind::Unhandled(number) => write!(f, "exception {number} without a handler")?,
            CrashKind::CrystalStopped => f.write_str("the crystal stopped")?,
            CrashKind::SupplyLow => f.write_str("the supply fell below 2.9 V")?,
        }
        write!(f, ", {count} since power-on")
    }
}

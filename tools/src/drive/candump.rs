//! Writes CAN frames as text, one per line, in the format of can-utils' `candump -L`, which `canplayer`
//! and python-can read: `(seconds.micros) interface ID#DATA`.

use embedded_can::{Frame, Id};
use gyronet::units::Micros;
use std::io::{self, Write};

pub const INTERFACE: &str = "can0";

/// A writer of CAN frames in candump format.
#[derive(Debug)]
pub struct Log<W> {
    out: W,
    frames: u64,
}

impl<W: Write> Log<W> {
    pub fn new(out: W) -> Self {
        Self { out, frames: 0 }
    }

    pub fn frame(&mut self, time: Micros, frame: &impl Frame) -> io::Result<()> {
        let Micros(us) = time;
        write!(self.out, "({}.{:06}) {INTERFACE} ", us / 1_000_000, us % 1_000_000)?;
        match frame.id() {
            Id::Standard(id) => write!(self.out, "{:03X}#", id.as_raw())?,
            Id::Extended(id) => write!(self.out, "{:08X}#", id.as_raw())?,
        }
        for byte in frame.data() {
            write!(self.out, "{byte:02X}")?;
        }
        self.frames += 1;
        writeln!(self.out)
    }

    pub fn finish(mut self) -> io::Result<u64> {
        self.out.flush()?;
        Ok(self.frames)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_can::{ExtendedId, StandardId};
    use gyronet::can::DataFrame;

    #[test]
    fn lines_are_as_candump_writes_them() {
        let mut out = Vec::new();
        let mut log = Log::new(&mut out);
        let standard = DataFrame::new(StandardId::new(0x74).unwrap(), &[0xD0, 0x87, 0x0A]).unwrap();
        let extended = DataFrame::new(ExtendedId::new(0x18F0_0900).unwrap(), &[]).unwrap();
        log.frame(Micros(1_234_567), &standard).unwrap();
        log.frame(Micros(12_000_001), &extended).unwrap();
        assert_eq!(log.finish().unwrap(), 2);
        let text = String::from_utf8(out).unwrap();
        assert_eq!(text, "(1.234567) can0 074#D0870A\n(12.000001) can0 18F00900#\n");
    }
}

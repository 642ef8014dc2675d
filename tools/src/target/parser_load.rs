//! This module computes the parsers' share of the processor from the counts of the bench image.

use crate::target::bench::Counts;

/// Clock of the STM32F405, Hz.
pub const CLOCK_HZ: f64 = 168e6;

/// The kinds of frames that the image measures, and the number of each in a second.
pub const FRAMES: [(&str, u32); 8] = [
    ("sensor/dsp1760_frame", 1_000),
    ("sensor/dsp1760_timed_frame", 1_000),
    ("sensor/mtdata2_frame", 100),
    ("sensor/mtdata2_f64_frame", 100),
    ("sensor/dsp3000_line", 100),
    ("sensor/dsp3000_word", 1_000),
    ("sensor/icm42688_packet", 1_000),
    ("sensor/adis16465_burst", 100),
];

/// Holds the cost of one kind of frame.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ParserLoad {
    /// The image's name for the kind of frame.
    pub name: String,
    /// Bytes per frame.
    pub bytes: u64,
    /// Frames per second.
    pub hertz: u32,
    /// Instructions per frame.
    pub instructions: u64,
    /// Modelled cycles per frame at zero wait states; `None` if only instructions were counted.
    pub cycles: Option<u64>,
    /// Modelled cycles per frame with flash at 5 wait states.
    pub cycles_5ws: Option<u64>,
}

impl ParserLoad {
    /// Returns the costs of all kinds of frames that the image measured.
    #[must_use]
    pub fn all(counts: &Counts) -> Vec<Self> {
        let load = |(name, hertz): (&str, u32)| {
            let count = counts.get(name)?;
            let (_, bytes) = counts.sizes.iter().find(|(size, _)| size == name)?;
            Some(Self {
                name: name.to_owned(),
                bytes: *bytes,
                hertz,
                instructions: count.instructions,
                cycles: count.cycles,
                cycles_5ws: count.cycles_5ws,
            })
        };
        FRAMES.into_iter().filter_map(load).collect()
    }

    /// Returns the parser's share of the processor's time, modelled at 5 wait states.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        self.cycles_5ws.map(|cycles| cycles as f64 * f64::from(self.hertz) / CLOCK_HZ)
    }
}

impl std::fmt::Display for ParserLoad {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let per_byte = |count: u64| count as f64 / self.bytes.max(1) as f64;
        let Self { name, bytes, hertz, .. } = self;
        write!(f, "{name}: {bytes} bytes, {:.1} instructions a byte", per_byte(self.instructions))?;
        if let (Some(cycles), Some(waited), Some(share)) = (self.cycles, self.cycles_5ws, self.share()) {
            write!(f, ", {:.1} modelled cycles a byte, {:.1} at 5 ws", per_byte(cycles), per_byte(waited))?;
            write!(f, "; {:.2} % of {:.0} MHz at {hertz} Hz and 5 ws", share * 100.0, CLOCK_HZ * 1e-6)?;
        }
        Ok(())
    }
}

//! This module runs the firmware image in the emulator on the beginning of the same drive.
//!
//! The recording's samples go to the image as the bytes of an Xsens MTi, and its SLCAN lines are compared with the
//! library's for the same samples. Neither side gets wheels, because the emulated board has no CAN.

use crate::drive::recording::Recording;
use crate::drive::replay::{Replay, ReplayError};
use crate::parts::{self, Part, ViaError};
use crate::target::bench::{self, BenchError};
use crate::target::emulator::{self, EmulatorError};
use crate::target::size::{ImageSize, SizeError};
use crate::target::stack::{ImageStack, StackError};
use embedded_can::Frame;
use gyronet::can::{DataFrame, slcan};
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use serde::Serialize;
use std::fmt;
use std::path::Path;
use std::time::{Duration, Instant};

/// The image gets this many samples: for static initialisation, and a good deal more.
pub const SAMPLES: usize = 1_000;
/// All their messages must come within this time: they take a few seconds, more on a busy machine.
const LIMIT: Duration = Duration::from_secs(180);
/// These are the lines of the sensor and of the outgoing messages.
const SENSOR: usize = 1;
const SLCAN: usize = 2;

/// The reason why the comparison cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoardError {
    /// The image could not be built or its instructions not counted.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// The emulator failed.
    #[error(transparent)]
    Emulator(#[from] EmulatorError),
    /// The image could not be read.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// The image could not be read.
    #[error("{path}: {source}")]
    Stack {
        /// The image.
        path: String,
        /// The reason.
        source: StackError,
    },
    /// The recording does not pass through the sensor's bytes.
    #[error(transparent)]
    Via(#[from] ViaError),
    /// The drive has no corrected rate in so short a time.
    #[error(transparent)]
    Replay(#[from] ReplayError),
}

/// Holds the outcome of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Outcome {
    /// The comparison was not run, because something is missing on this machine.
    NotRun {
        /// The missing thing, as a sentence.
        why: String,
    },
    /// The comparison was run.
    Run {
        /// The comparison of its bytes with the library's.
        agreement: Agreement,
        /// The image's size and cost.
        figures: Figures,
    },
}

/// Compares the image's messages with those of the library for the same bytes of the sensor.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Agreement {
    /// Samples sent.
    pub samples: usize,
    /// Bytes that they took on the sensor's line.
    pub sent_bytes: u64,
    /// Messages compared.
    pub frames: u64,
    /// Bytes in them, identifiers left out.
    pub payload_bytes: u64,
    /// Time that the emulator took, s.
    pub seconds: f64,
    /// The first difference, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference: Option<Difference>,
}

/// Describes a message that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The number of the message, from 1.
    pub number: usize,
    /// The message of the board.
    pub board: String,
    /// The message of the library.
    pub host: String,
}

/// Holds the size and cost of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Figures {
    /// Flash, bytes.
    pub flash: u64,
    /// Static RAM, bytes.
    pub static_ram: u64,
    /// Stack, bytes.
    pub stack: u64,
    /// Instructions of one GyroNet window.
    pub window_instructions: Option<u64>,
    /// Modelled cycles of the same at 5 wait states.
    pub window_cycles: Option<u64>,
}

/// One line: the reason why the image was not run, or its agreement with the library.
impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let agreement = match self {
            Self::NotRun { why } => return write!(f, "not run: {why}"),
            Self::Run { agreement, .. } => agreement,
        };
        let Agreement { frames, payload_bytes, seconds, .. } = agreement;
        match &agreement.difference {
            None => write!(
                f,
                "in QEMU {frames} frames, {payload_bytes} payload bytes, all as here ({seconds:.1} s)"
            ),
            Some(Difference { number, board, host }) => {
                write!(f, "in QEMU frame {number} is {board}, here {host}")
            }
        }
    }
}

impl Outcome {
    /// Returns why the image cannot be run on this machine: the emulator, the target's standard library or the
    /// repository is missing.
    #[must_use]
    pub fn missing() -> Option<Self> {
        let why = match (emulator::available(), bench::target_installed(bench::TARGET)) {
            (Err(error), _) => format!("wants QEMU: {error}"),
            (_, Err(why)) => why,
            (Ok(()), Ok(())) => return None,
        };
        Some(Self::NotRun { why })
    }

    /// Returns whether the image ran and sent other bytes than the library.
    #[must_use]
    pub fn differs(&self) -> bool {
        matches!(self, Self::Run { agreement, .. } if agreement.difference.is_some())
    }
}

impl Agreement {
    /// Runs an image on the first [`SAMPLES`] of a drive. `network` is the one that it carries.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn new(
        image: &Path,
        recording: &Recording,
        network: &mut impl WindowNetwork,
    ) -> Result<Self, BoardError> {
        let rows = recording.rows.iter().take(SAMPLES).copied().collect();
        let recording = Recording { rows, ..recording.clone() };
        let bytes = parts::mti_bytes(&recording).concat();
        let sent = Part::Xsens.send(&recording)?.recording;
        let drive = Replay::run(&sent, &PipelineConfig::DEFAULT, None, network, || {})?;
        let frames: Vec<DataFrame> = drive.frames().map(|sent| sent.frame).collect();

        let start = Instant::now();
        let mut board = emulator::Board::boot(image, SLCAN, &[])?;
        board.send(SENSOR, &bytes, LIMIT)?;
        let lines = board.lines(SLCAN, b'\r', frames.len(), LIMIT)?;
        let seconds = start.elapsed().as_secs_f64();
        let host = frames.iter().map(|frame| slcan::emit(frame).unwrap_or_default());
        let pairs = lines.iter().zip(host).enumerate();
        let mut unlike = pairs.filter(|(_, (line, host))| host.strip_suffix(b"\r") != Some(line));
        let difference = unlike.next().map(|(index, (line, host))| Difference {
            number: index + 1,
            board: line.escape_ascii().to_string(),
            host: host.trim_ascii_end().escape_ascii().to_string(),
        });
        Ok(Self {
            samples: sent.rows.len(),
            sent_bytes: bytes.len() as u64,
            frames: frames.len() as u64,
            payload_bytes: frames.iter().map(|frame| frame.data().len() as u64).sum(),
            seconds,
            difference,
        })
    }
}

impl Figures {
    /// Reads the image that is flashed, and counts a window with the image that measures.
    ///
    /// # Errors
    /// [`BoardError`].
    pub fn new(image: &Path, bench: &Path) -> Result<Self, BoardError> {
        let ImageSize { flash, static_ram, .. } = ImageSize::read(image)?;
        let path = || image.display().to_string();
        let elf = std::fs::read(image).map_err(|source| SizeError::Io { path: path(), source })?;
        let stack = ImageStack::read(&elf).map_err(|source| BoardError::Stack { path: path(), source })?;
        let counts = bench::measure(&bench::workspace(), bench)?;
        let window = counts.get("gyronet/window");
        Ok(Self {
            flash,
            static_ram,
            stack: stack.worst().into(),
            window_instructions: window.map(|count| count.instructions),
            window_cycles: window.and_then(|count| count.cycles_5ws),
        })
    }
}

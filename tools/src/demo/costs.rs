//! This module gathers the figures of time and memory: those that this command measures, and those that the emulator
//! counts.

use super::board::{Figures, Outcome};
use crate::drive::recording::Recording;
use crate::evaluate::rates::Rates;
use crate::plot::page::grouped;
use gyronet::can::config::Config;
use gyronet::model::fognet::FogNetState;
use gyronet::model::gyronet::GyroNetState;
use gyronet::model::weights;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::PERIOD_US;
use serde::Serialize;

/// Holds a figure of time or memory.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Cost {
    /// The quantity.
    pub what: &'static str,
    /// The figure with its unit.
    pub figure: String,
    /// The source of the figure.
    pub how: String,
}

/// The STM32F405 runs at this clock, MHz.
const CLOCK_MHZ: f64 = crate::target::parser_load::CLOCK_HZ * 1e-6;

/// Returns the figures of a drive and of the image.
#[must_use]
pub fn all(recording: &Recording, rates: &Rates, config: &Config, board: &Outcome) -> Vec<Cost> {
    let samples = recording.rows.len().max(1) as f64;
    let micros = rates.run_time.as_secs_f64() * 1e6 / samples;
    let lag = PipelineConfig::DEFAULT.compensate.lag.samples() as u64 * PERIOD_US / 1_000;
    let per_second: u32 = config.messages().iter().map(|message| 1_000 / u32::from(message.period_ms)).sum();
    let load = config.bus_load_per_mille();
    let bytes = |count: usize| format!("{} bytes", grouped(count as u64));
    let mut costs = vec![
        Cost {
            what: "one sample on this machine, network included",
            figure: format!("{micros:.1} us"),
            how: format!(
                "measured, one thread: {:.0} times faster than the drive",
                PERIOD_US as f64 / micros
            ),
        },
        Cost {
            what: "from sample to message",
            figure: format!("0 and {lag} ms"),
            how: "the rate sent at once, and the one for navigation".into(),
        },
        Cost {
            what: "CAN",
            figure: format!("{per_second} messages a second"),
            how: format!(
                "{}.{} % of {} kbit/s with as many stuff bits as there can be",
                load / 10,
                load % 10,
                config.settings().bits_per_second / 1_000
            ),
        },
        Cost {
            what: "GyroNet, weights",
            figure: bytes(weights::GYRONET.0.len()),
            how: "size of the file".into(),
        },
        Cost {
            what: "GyroNet, working memory",
            figure: bytes(size_of::<GyroNetState>()),
            how: "size of its state on this machine".into(),
        },
        Cost {
            what: "FoGNet, weights",
            figure: bytes(weights::FOGNET.0.len()),
            how: "size of the file".into(),
        },
        Cost {
            what: "FoGNet, working memory",
            figure: bytes(size_of::<FogNetState>()),
            how: "size of its state on this machine".into(),
        },
    ];
    match board {
        Outcome::Run { figures, .. } => costs.extend(of_image(figures)),
        Outcome::NotRun { why } => costs.push(Cost {
            what: "firmware image: flash, RAM, stack, instructions",
            figure: "not measured".into(),
            how: why.clone(),
        }),
    }
    costs
}

fn of_image(figures: &Figures) -> Vec<Cost> {
    let bytes = |count: u64| format!("{} bytes", grouped(count));
    let mut costs = vec![
        Cost { what: "image, flash", figure: bytes(figures.flash), how: "from the ELF file".into() },
        Cost {
            what: "image, static RAM",
            figure: bytes(figures.static_ram),
            how: "from the ELF file".into(),
        },
        Cost {
            what: "image, stack at worst",
            figure: bytes(figures.stack),
            how: "bound from the machine code, every interrupt inside another".into(),
        },
    ];
    if let Some(instructions) = figures.window_instructions {
        let hop = PipelineConfig::DEFAULT.compensate.mode.hop();
        costs.push(Cost {
            what: "GyroNet window on a Cortex-M4F",
            figure: format!("{} instructions", grouped(instructions)),
            how: format!("counted in QEMU; one for every {hop} samples"),
        });
    }
    if let Some(cycles) = figures.window_cycles {
        costs.push(Cost {
            what: "the same in time",
            figure: format!("{:.1} ms", cycles as f64 / (CLOCK_MHZ * 1e3)),
            how: format!(
                "{} cycles, modelled (flash at 5 wait states), at {CLOCK_MHZ:.0} MHz",
                grouped(cycles)
            ),
        });
    }
    costs
}

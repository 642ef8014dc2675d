//! The figures of time and memory.

use crate::plot::page::grouped;
use gyronet::can::config::Config;
use gyronet::model::blob::HIDDEN;
use gyronet::model::fognet::FogNetState;
use gyronet::model::gyronet::GyroNetState;
use gyronet::model::weights;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::PERIOD_US;
use serde::Serialize;
use std::time::Duration;

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Cost {
    pub what: &'static str,
    pub figure: String,
    pub how: String,
}

pub fn all(samples: usize, run_time: Duration, config: &Config) -> Vec<Cost> {
    let micros = run_time.as_secs_f64() * 1e6 / samples.max(1) as f64;
    let lag = PipelineConfig::DEFAULT.compensate.lag.samples() as u64 * PERIOD_US / 1_000;
    let per_second: u32 = config.messages().iter().map(|message| 1_000 / u32::from(message.period_ms)).sum();
    let load = config.bus_load_per_mille();
    let bytes = |count: usize| format!("{} bytes", grouped(count as u64));
    vec![
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
            how: "the live and the delayed rate".into(),
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
            figure: bytes(size_of::<GyroNetState<HIDDEN>>()),
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
    ]
}

//! The tests of health, CAN and sensors once more, in one crate without the tools: `cargo mutants`
//! builds it for every mutant. Not run by `cargo test`, which has them already.
#![cfg(test)]

// The tests name the crate that they share.
extern crate self as gyronet_host_tests;

#[path = "../../src/noise.rs"]
pub mod noise;
#[path = "../../src/stream.rs"]
pub mod stream;
#[path = "../../src/synthetic.rs"]
pub mod synthetic;
#[path = "../../src/wire.rs"]
pub mod wire;

#[path = "../../tests/adis16465.rs"]
mod adis16465;
#[path = "../../tests/align_faults.rs"]
mod align_faults;
#[path = "../../tests/bosch_set.rs"]
mod bosch_set;
#[path = "../../tests/bosch_tx1.rs"]
mod bosch_tx1;
#[path = "../../tests/can_config.rs"]
mod can_config;
#[path = "../../tests/can_dbc.rs"]
mod can_dbc;
#[path = "../../tests/carry.rs"]
mod carry;
#[path = "../../tests/e2e.rs"]
mod e2e;
#[path = "../../tests/framer.rs"]
mod framer;
#[path = "../../tests/guard.rs"]
mod guard;
#[path = "../../tests/icm42688.rs"]
mod icm42688;
#[path = "../../tests/j1939.rs"]
mod j1939;
#[path = "../../tests/kvh_dsp1760.rs"]
mod kvh_dsp1760;
#[path = "../../tests/kvh_dsp3000.rs"]
mod kvh_dsp3000;
#[path = "../../tests/pipeline.rs"]
mod pipeline;
#[path = "../../tests/pipeline_estimates.rs"]
mod pipeline_estimates;
#[path = "../../tests/pipeline_wheels.rs"]
mod pipeline_wheels;
#[path = "../../tests/sensor_damage.rs"]
mod sensor_damage;
#[path = "../../tests/sensor_serial.rs"]
mod sensor_serial;
#[path = "../../tests/slcan.rs"]
mod slcan;
#[path = "../../tests/slcan_command.rs"]
mod slcan_command;
#[path = "../../tests/slcan_port.rs"]
mod slcan_port;
#[path = "../../tests/supervisor.rs"]
mod supervisor;
#[path = "../../tests/transmit_queue.rs"]
mod transmit_queue;
#[path = "../../tests/wheel_input.rs"]
mod wheel_input;
#[path = "../../tests/xsens.rs"]
mod xsens;
#[path = "../../tests/xsens_config.rs"]
mod xsens_config;
#[path = "../../tests/xsens_formats.rs"]
mod xsens_formats;
#[path = "../../tests/xsens_stream.rs"]
mod xsens_stream;
#[path = "../../tests/yaw_feed.rs"]
mod yaw_feed;

// What the networks do with words, for Miri alone.
#[cfg(miri)]
#[path = "../../tests/blob.rs"]
mod blob;
#[cfg(miri)]
#[path = "../../tests/fognet_blob.rs"]
mod fognet_blob;
#[cfg(miri)]
#[path = "../../tests/lstm_exact.rs"]
mod lstm_exact;
#[cfg(miri)]
#[path = "../../src/packing.rs"]
pub mod packing;

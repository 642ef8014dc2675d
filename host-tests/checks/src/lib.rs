//! The tests of monitor, CAN and sensors once more, in a crate without the tools, because `cargo mutants` builds it
//! for every mutant. `cargo test` does not run this crate, because it runs the same tests already.
#![cfg(test)]

// The tests refer to the crate that they share by this name.
extern crate self as gyronet_host_tests;

#[path = "../../src/noise.rs"]
pub mod noise;
#[path = "../../src/stream.rs"]
pub mod stream;
#[path = "../../src/synthetic.rs"]
pub mod synthetic;
#[path = "../../src/wire.rs"]
pub mod wire;

#[path = "../../tests/library/bosch.rs"]
mod bosch;
#[path = "../../tests/library/can_config.rs"]
mod can_config;
#[path = "../../tests/library/can_dbc.rs"]
mod can_dbc;
#[path = "../../tests/library/clock_ratio.rs"]
mod clock_ratio;
#[path = "../../tests/library/e2e.rs"]
mod e2e;
#[path = "../../tests/library/framer.rs"]
mod framer;
#[path = "../../tests/library/icm42688.rs"]
mod icm42688;
#[path = "../../tests/library/j1939.rs"]
mod j1939;
#[path = "../../tests/library/kvh_dsp1760.rs"]
mod kvh_dsp1760;
#[path = "../../tests/library/pipeline.rs"]
mod pipeline;
#[path = "../../tests/library/pipeline_estimates.rs"]
mod pipeline_estimates;
#[path = "../../tests/library/pipeline_wheels.rs"]
mod pipeline_wheels;
#[path = "../../tests/library/revisions.rs"]
mod revisions;
#[path = "../../tests/library/sensor_monitor.rs"]
mod sensor_monitor;
#[path = "../../tests/library/sensor_serial.rs"]
mod sensor_serial;
#[path = "../../tests/library/slcan.rs"]
mod slcan;
#[path = "../../tests/library/slcan_command.rs"]
mod slcan_command;
#[path = "../../tests/library/slcan_port.rs"]
mod slcan_port;
#[path = "../../tests/library/transmit_queue.rs"]
mod transmit_queue;
#[path = "../../tests/library/wheel_input.rs"]
mod wheel_input;
#[path = "../../tests/library/xsens.rs"]
mod xsens;
#[path = "../../tests/library/xsens_stream.rs"]
mod xsens_stream;
#[path = "../../tests/library/yaw_encoder.rs"]
mod yaw_encoder;

// Word-level code of the networks, for Miri only.
#[cfg(miri)]
#[path = "../../tests/library/blob.rs"]
mod blob;
#[cfg(miri)]
#[path = "../../tests/library/fognet_blob.rs"]
mod fognet_blob;
#[cfg(miri)]
#[path = "../../tests/library/lstm_exact.rs"]
mod lstm_exact;
#[cfg(miri)]
#[path = "../../src/packing.rs"]
pub mod packing;

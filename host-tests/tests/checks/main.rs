//! The tests of health, CAN and sensors once more, in one binary: `cargo mutants` builds it for
//! every mutant, and one is quicker than thirty. Not run by `cargo test`, which has them already.

#[path = "../adis16465.rs"]
mod adis16465;
#[path = "../align_faults.rs"]
mod align_faults;
#[path = "../bosch_set.rs"]
mod bosch_set;
#[path = "../bosch_tx1.rs"]
mod bosch_tx1;
#[path = "../can_config.rs"]
mod can_config;
#[path = "../can_dbc.rs"]
mod can_dbc;
#[path = "../carry.rs"]
mod carry;
#[path = "../e2e.rs"]
mod e2e;
#[path = "../guard.rs"]
mod guard;
#[path = "../icm42688.rs"]
mod icm42688;
#[path = "../j1939.rs"]
mod j1939;
#[path = "../kvh_dsp1760.rs"]
mod kvh_dsp1760;
#[path = "../kvh_dsp3000.rs"]
mod kvh_dsp3000;
#[path = "../pipeline.rs"]
mod pipeline;
#[path = "../pipeline_estimates.rs"]
mod pipeline_estimates;
#[path = "../pipeline_wheels.rs"]
mod pipeline_wheels;
#[path = "../sensor_damage.rs"]
mod sensor_damage;
#[path = "../sensor_serial.rs"]
mod sensor_serial;
#[path = "../slcan.rs"]
mod slcan;
#[path = "../slcan_command.rs"]
mod slcan_command;
#[path = "../slcan_port.rs"]
mod slcan_port;
#[path = "../standstill.rs"]
mod standstill;
#[path = "../supervisor.rs"]
mod supervisor;
#[path = "../transmit_queue.rs"]
mod transmit_queue;
#[path = "../wheel_input.rs"]
mod wheel_input;
#[path = "../xsens.rs"]
mod xsens;
#[path = "../xsens_config.rs"]
mod xsens_config;
#[path = "../xsens_formats.rs"]
mod xsens_formats;
#[path = "../xsens_stream.rs"]
mod xsens_stream;
#[path = "../yaw_feed.rs"]
mod yaw_feed;

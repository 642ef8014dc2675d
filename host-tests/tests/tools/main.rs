//! Tests of the library with the tools: recordings, simulated drives, reports.

mod accuracy;
mod course_reference;
mod doctor;
mod expected_error;
mod fog_default;
mod fog_kingston;
mod fognet_integer;
mod fognet_simulated;
mod golden;
mod mounting;
mod python_seconds;
mod python_units;
mod python_wheels;
mod standstill;
mod standstill_detectors;
mod standstill_truth;
mod tables_methods;
mod tilt;
mod turns;
mod warm_up;

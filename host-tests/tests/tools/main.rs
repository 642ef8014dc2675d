//! Tests of the library with the tools: recordings, simulated drives, reports.

mod accuracy;
mod campaign;
mod course_reference;
mod doctor;
mod fir_choice;
mod fog_default;
mod fog_kingston;
mod fognet_golden;
mod fognet_integer;
mod fognet_simulated;
mod gyronet_golden;
mod import_converted;
mod import_logs;
mod mounting;
mod pages;
mod python_seconds;
mod recordings_bad_input;
mod replay_mcap;
mod replay_via;
mod standstill;
mod still_stretches;
mod tables_methods;
mod trajectory_evo;
mod turns;
mod unit_transfer;
mod upsets;

//! These modules compare methods of computing a yaw rate. [`rates`] runs each of the [`methods`] on a drive with a
//! reference, [`heading_error`] and [`trajectory_error`] compute the errors, and [`report`] writes the tables.

pub mod angle;
pub mod ekf;
pub mod expected_error;
pub mod fir;
pub mod heading_error;
pub mod methods;
pub mod outage;
pub mod outage_chart;
pub mod outage_path;
pub mod outage_table;
pub mod rates;
pub mod report;
pub mod rest;
pub mod trajectory_error;
pub mod vqf;

#![doc = include_str!("../README.md")]
#![cfg_attr(not(test), no_std)]

pub mod align;
pub mod bias;
pub mod can;
pub mod compensate;
pub mod fog;
pub mod guard;
pub mod health;
pub mod model;
pub mod mounting;
pub mod nn;
pub mod odometry;
pub mod pipeline;
pub mod sample;
pub mod seconds;
pub mod sensor;
pub mod service;
pub mod store;
pub mod uncertainty;
pub mod units;
pub mod vehicle;
pub mod wheels;
pub mod window;

//! Learned yaw-rate correction in real time: sensor bytes in, corrected yaw rate on CAN out.
//!
//! This is the library that the firmware is built on, for use on your own board. It is `no_std`, uses no heap, and
//! reaches hardware only through the traits of `embedded-hal`, `embedded-io` and `embedded-can`. Time is an argument,
//! weights are bytes in flash that are checked once, and state is a value that the caller owns. A Cortex-M and a
//! desktop compute the same bits; the README of the repository has the numbers.
//!
//! | part | what it does |
//! |---|---|
//! | [`Coprocessor`] | takes samples, CAN frames and time; returns frames, windows and observations ([`coprocessor`]) |
//! | [`Config`] | configures it ([`config`]) |
//! | [`sensor`] | decodes bytes into samples: Xsens MTi, ICM-42688, BMI088, ASM330LHH, KVH DSP-1760 |
//! | [`sample`], [`units`] | hold samples in fixed point: 2^-27 rad/s, 2^-20 m/s^2, microseconds |
//! | [`model`] | runs the networks: ten samples in, the gyro's error out |
//! | [`can`] | encodes Bosch MM5.10, our own messages, E2E, SLCAN; decodes wheel speeds |
//! | [`estimate`], [`health`] | describe a corrected rate, its state and the counters |
//! | [`store`], [`service`] | keep configuration and weights in flash, and change them on request |
//!
//! # On a board of your own
//!
//! [`Coprocessor::step`] is the whole loop. `examples/own_board.rs` is this program as an image for a Cortex-M, with wheel
//! speeds received from the bus.
//!
//! ```
//! # // A port that holds four seconds of a parked car's samples, and a controller that counts.
//! # use embedded_can::nb;
//! # struct Port(std::collections::VecDeque<u8>);
//! # impl embedded_io::ErrorType for Port { type Error = core::convert::Infallible; }
//! # impl embedded_io::Read for Port {
//! #     fn read(&mut self, to: &mut [u8]) -> Result<usize, Self::Error> {
//! #         let count = to.len().min(self.0.len());
//! #         to.iter_mut().zip(self.0.drain(..count)).for_each(|(to, byte)| *to = byte);
//! #         Ok(count)
//! #     }
//! # }
//! # impl embedded_io::ReadReady for Port {
//! #     fn read_ready(&mut self) -> Result<bool, Self::Error> { Ok(!self.0.is_empty()) }
//! # }
//! # #[derive(Default)]
//! # struct Controller(Vec<gyronet::DataFrame>);
//! # impl nb::Can for Controller {
//! #     type Frame = gyronet::DataFrame;
//! #     type Error = core::convert::Infallible;
//! #     fn transmit(&mut self, frame: &Self::Frame) -> ::nb::Result<Option<Self::Frame>, Self::Error> {
//! #         self.0.push(*frame);
//! #         Ok(None)
//! #     }
//! #     fn receive(&mut self) -> ::nb::Result<Self::Frame, Self::Error> { Err(::nb::Error::WouldBlock) }
//! # }
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # use embedded_can::Frame;
//! # use gyronet::{sample::TestSignal, sensor::xsens::MtData2};
//! use gyronet::sensor::{serial::Serial, xsens::Mti};
//! use gyronet::{Config, Coprocessor, GyroNet, Micros, QueuedCan};
//!
//! # let messages = (0..400).flat_map(|k| MtData2::of(&TestSignal::turning(0.5).sample(k), k as u16).emit().to_vec());
//! # let (uart, controller) = (Port(messages.collect()), Controller::default());
//! # let mut now = Micros(0);
//! # let mut timer = || { now.0 += 10_000; now };
//! let mut coprocessor = Coprocessor::new(Config::DEFAULT);
//! let mut network = GyroNet::shipped()?;
//! let mut imu = Serial::new(uart, Mti::new()); // an Xsens MTi on your serial port
//! let mut can = QueuedCan::<_>::new(controller); // a CAN controller has fewer mailboxes than a sample has frames
//! # for _ in 0..100 {
//! // In your loop, about every millisecond:
//! coprocessor.step(timer(), &mut imu, &mut can, Some(&mut network));
//! # }
//! # let frames = &can.controller().0;
//! # assert_eq!((frames.len(), coprocessor.input_counters().imu_errors), (6 * 400, 0));
//! # let last = gyronet::can::bosch::Message::parse(frames[6 * 399].data())?;
//! # assert_eq!(last.rate_status, gyronet::can::bosch::SignalStatus::OK);
//! # assert!(last.rate_deg_per_sec().abs() < 0.05, "the bias is off: {}", last.rate_deg_per_sec());
//! # for _ in 0..4 { coprocessor.step(timer(), &mut imu, &mut can, Some(&mut network)); }
//! # assert_eq!(can.controller().0.len(), 6 * 402, "silence is reported");
//! # Ok(())
//! # }
//! ```
//!
//! # Features, unsafe code, panics
//!
//! No feature is on by default. Without any, the library converts sensor bytes to CAN frames.
//!
//! | feature | adds |
//! |---|---|
//! | `store` | [`store`]: configuration, calibration and weights in flash (postcard, embedded-storage) |
//! | `service` | [`service`] and [`uds`]: stored data and diagnosis, and `store` (automotive_diag) |
//! | `defmt` | `defmt::Format` for the public types |
//!
//! Unsafe code is denied except in one kernel file for Cortex-M with the DSP extension
//! (`src/nn/simd`), whose results equal those of portable code to the last bit.
//!
//! No external input can make the library panic: bad bytes, times and weights are typed
//! errors or counted, and faults are reported on the bus. Errors implement [`core::error::Error`].
//!
#![doc = include_str!("GLOSSARY.md")]
#![cfg_attr(not(test), no_std)]
#![warn(missing_docs)]
#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod can;
pub mod config;
pub mod coprocessor;
pub mod estimate;
pub mod heading;
pub mod health;
pub mod model;
pub mod sample;
pub mod sensor;
#[cfg(feature = "service")]
pub mod service;
#[cfg(feature = "store")]
pub mod store;
#[cfg(feature = "service")]
pub mod uds;
pub mod units;

// The stages behind `Coprocessor`. They are public only for the repository's tools and tests, which run each alone;
// their API is not stable.
#[doc(hidden)]
pub mod align;
#[doc(hidden)]
pub mod bias;
#[doc(hidden)]
pub mod compensate;
#[doc(hidden)]
pub mod fog;
#[doc(hidden)]
pub mod monitor;
#[doc(hidden)]
pub mod mounting;
#[doc(hidden)]
pub mod nn;
#[doc(hidden)]
pub mod pipeline;
mod sqrt;
#[doc(hidden)]
pub mod standstill;
mod vector;

pub use can::{DataFrame, queue::TransmitQueue};
pub use coprocessor::{
    Bus, Clock, Config, Coprocessor, InputError, Observation, QueuedCan, Sink, TimedFrame,
};
pub use estimate::{VehicleSample, YawEstimate};
pub use model::{Blob, FogNet, GyroNet, WindowNetwork, weights};
pub use sample::{FogSample, ImuSample};
pub use units::{AngularRate, Duration, Micros};

//! The service line answers the requests of a person who configures or examines the board.
//!
//! # Frames
//! 115200 8N1. A frame is COBS between two zero bytes, the same both ways; whatever is no frame
//! is counted and passed over, and answered by nothing. Inside:
//!
//! | bytes | what |
//! |---|---|
//! | 1 | number, chosen by the asker; the answer repeats it |
//! | 1 to 320 | a [`Request`] or [`Reply`] in postcard's encoding |
//! | 4 | CRC-32 (as in zip) of all before it, little-endian |
//!
//! # Requests
//! Numbered in this order from 0 (postcard's enum index); new ones go to the end.
//!
//! | request | answer | what |
//! |---|---|---|
//! | `Info` | `Info` | versions, part, reset, clock, what is stored and whether it can be, weights, status |
//! | `GetConfiguration` | `Configuration` | whole, with its layout version and where it comes from |
//! | `SetConfiguration` | `Done` | checked, stored whole; holds from the next start on |
//! | `GetWheels` | `Wheels` | the wheel frames that are received, and where they come from |
//! | `SetWheels` | `Done` | checked, stored whole; holds from the next start on |
//! | `GetCalibration` | `Calibration` | what is known, and how a calibration goes |
//! | `Calibrate` | `Done` | start `Static` or `Mounting` (3 s at rest), `Cancel`, `Store` |
//! | `Log` | `Log` | events after a number, eight at most; how many were lost |
//! | `Counters` | `Counters` | everything that is counted |
//! | `WeightsBegin` | `Weights` | erases the slot that is not in use (seconds, nothing else runs) |
//! | `WeightsBlock` | `Weights` | up to 256 bytes at the offset that comes next |
//! | `WeightsVerify` | `Weights` | the whole file is checked where it lies |
//! | `WeightsActivate` | `Done` | the checked file is used from the next start on |
//! | `Restart` | `Done` | resets when the answer is out |
//!
//! Any of them may be answered by `Refused` with a reason; nothing has changed then. A lost
//! answer does no harm: asking again gives the same, and a block that is there already is
//! answered by the offset that comes next. Nothing here waits, and all buffers have one size.

pub mod calibrate;
mod conditions;
#[doc(hidden)]
pub mod crash;
pub mod device;
pub mod event;
#[doc(hidden)]
pub mod frame;
#[doc(hidden)]
pub mod hardware;
pub mod message;
#[doc(hidden)]
pub mod standstill;
mod text;

pub use conditions::Conditions;
pub use device::{Device, MappedSlots, SupportedHardware};
pub use frame::{Deframer, FrameError};
pub use message::{Reply, Request};

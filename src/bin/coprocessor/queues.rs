//! What the tasks pass to one another in queues of fixed length: frames, a tester's requests and the responses to them,
//! and observations.
#![allow(unsafe_code, reason = "rings with one task at each end; each block names them")]

use crate::ring::Ring;
use core::sync::atomic::{AtomicU32, Ordering};
use embedded_can::Id;
use gyronet::can::DataFrame;
use gyronet::can::identifier::packed;
use gyronet::health::{Faults, Quality, Status};
use gyronet::mounting::Vertical;
use gyronet::sample::{ImuSample, WheelSample};
use gyronet::standstill::Standing;

/// Waiting wheel, course and latitude frames; the output task reads them every millisecond.
pub static FRAMES: Ring<DataFrame, 8> =
    // SAFETY: the receive interrupt writes, the output task reads.
    unsafe { Ring::new() };
pub static FROM_CAN: Ring<DataFrame, 16> =
    // SAFETY: the receive interrupt writes, idle reads.
    unsafe { Ring::new() };
pub static FROM_SLCAN: Ring<DataFrame, 16> =
    // SAFETY: the output task writes, idle reads.
    unsafe { Ring::new() };
pub static RESPONSES: Ring<(Line, DataFrame), 16> =
    // SAFETY: idle writes, the output task reads.
    unsafe { Ring::new() };
/// Observations that idle has not processed yet.
pub static OBSERVATIONS: Ring<Observation, 8> =
    // SAFETY: the output task writes, idle reads.
    unsafe { Ring::new() };

/// The line of a tester.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Line {
    Can,
    Slcan,
    Service,
}

pub struct Observation {
    /// `None`: the sensor is silent.
    pub sample: Option<ImuSample>,
    pub tick: u32,
    pub status: Status,
    pub quality: Quality,
    pub faults: Faults,
    pub wheels: WheelSample,
    pub standing: Standing,
    pub vertical: Option<Vertical>,
}

/// Identifiers of requests to this board, of requests to all servers, and of this board's responses, [`packed`].
/// Set before any task runs.
static IDS: [AtomicU32; 3] = [const { AtomicU32::new(u32::MAX) }; 3];

pub fn set_ids(ids: [Id; 3]) {
    IDS.iter().zip(ids).for_each(|(place, id)| place.store(packed(id), Ordering::Relaxed));
}

pub fn ids() -> [u32; 3] {
    let [request, functional, response] = &IDS;
    [request, functional, response].map(|id| id.load(Ordering::Relaxed))
}

pub fn is_request(id: Id) -> bool {
    let [request, functional, _] = ids();
    [request, functional].contains(&packed(id))
}

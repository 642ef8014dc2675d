//! Measures the cycles of the networks on this chip with DWT_CYCCNT, to compare with the cycle model.
#![allow(unsafe_code, reason = "memory by address; the block says why it is sound")]

use crate::report::Report;
use crate::stm32f405::flash::Flash;
use crate::stm32f405::watchdog;
use core::hint::black_box;
use cortex_m::peripheral::{DCB, DWT};
use gyronet::model::fognet::{FogNetState, MinuteNetwork};
use gyronet::model::gyronet::GyroNetState;
use gyronet::model::seconds::{Minute, Padding, STEPS, Second};
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{Blob, FogBlob, FogNet, GyroNet, WindowNetwork, weights};
use gyronet::store::layout::FOGNET;
use gyronet::store::slots::{self, SlotError};
use gyronet::units::Angle;

/// Measures one window of each network.
pub fn count(report: &mut Report, mut dcb: DCB, mut dwt: DWT) {
    dcb.enable_trace();
    dwt.enable_cycle_counter();
    gyronet(report);
    fognet(report);
}

fn gyronet(report: &mut Report) {
    let Ok(blob) = Blob::new_checked(&weights::GYRONET.0) else {
        return report.fail("GyroNet", format_args!("the weight file is refused"));
    };
    let Some(state) = cortex_m::singleton!(: GyroNetState = GyroNetState::ZERO) else { return };
    let Ok(mut network) = GyroNet::with_state(blob, state) else { return };
    let features = [[0; FEATURES]; WINDOW];
    let begin = DWT::cycle_count();
    black_box(network.estimate(black_box(&features)));
    let cycles = DWT::cycle_count().wrapping_sub(begin);
    report.pass("GyroNet", format_args!("{cycles} cycles a window"));
}

fn fognet(report: &mut Report) {
    let Some(state) = cortex_m::singleton!(: FogNetState = FogNetState::ZERO) else { return };
    let Some(minute) = cortex_m::singleton!(: Minute = Minute::EMPTY) else { return };
    // SAFETY: inside the flash, and nothing writes there.
    let place = unsafe { Flash::mapped(FOGNET.start, FOGNET.len()) };
    let found = slots::bytes(place).and_then(|file| Ok(FogBlob::new_checked(file)?));
    let blob = match found {
        Ok(blob) => blob,
        Err(SlotError::Empty) => {
            return report.manual_check("FoGNet", format_args!("no weight file in its place: not tried"));
        }
        Err(error) => return report.fail("FoGNet", format_args!("{error}")),
    };
    let mut network = FogNet::new(blob, state);
    for _ in 0..STEPS {
        minute.add(Second { features: [0; _], turn: Angle::ZERO });
    }
    let Some(window) = minute.window(Padding::None) else { return };
    watchdog::feed();
    let begin = DWT::cycle_count();
    black_box(network.estimate(black_box(&window)));
    let cycles = DWT::cycle_count().wrapping_sub(begin);
    report.pass("FoGNet", format_args!("{cycles} cycles a window"));
}

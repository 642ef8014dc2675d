//! Measures the cycles of the paper's GyroNet on this chip with DWT_CYCCNT, to compare with the cycle model.

use crate::report::Report;
use core::hint::black_box;
use cortex_m::peripheral::{DCB, DWT};
use gyronet::model::gyronet::LargestState;
use gyronet::model::window::{FEATURES, WINDOW};
use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};

pub fn count(report: &mut Report, mut dcb: DCB, mut dwt: DWT) {
    dcb.enable_trace();
    dwt.enable_cycle_counter();
    let Ok(blob) = Blob::new_checked(&weights::GYRONET.0) else {
        return report.fail("GyroNet", format_args!("the weight file is refused"));
    };
    let Some(state) = cortex_m::singleton!(: LargestState = LargestState::ZERO) else { return };
    let Ok(mut network) = GyroNet::with_state(blob, state) else { return };
    let features = [[0; FEATURES]; WINDOW];
    let begin = DWT::cycle_count();
    black_box(network.estimate(black_box(&features)));
    let cycles = DWT::cycle_count().wrapping_sub(begin);
    report.pass("GyroNet", format_args!("{cycles} cycles a window of the paper's"));
}

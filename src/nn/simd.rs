//! Selects the kernel for the processor; all kernels give the same bits as the portable one.

#[cfg(gyronet_dsp)]
mod cortex_m;
#[cfg(gyronet_dsp)]
pub(super) use cortex_m::{copy, project, step};

#[cfg(not(gyronet_dsp))]
pub(super) fn copy(from: &[u32], to: &mut [u32]) {
    to.copy_from_slice(from);
}

#[cfg(not(gyronet_dsp))]
pub(super) use super::lstm::{project_portable as project, step_portable as step};

//! Makes what the tasks own, where it stays.

use crate::board::Board;
use crate::chip::{PARTS, bus::BITS_PER_SECOND, flash::Flash};
use crate::idle::Stored;
use crate::output::{Doubts, Unconnected};
use crate::regions::{Records, Slots};
use crate::window::Windows;
use core::mem::MaybeUninit;
use gyronet::can::config::Config;
use gyronet::can::wheel::WheelSettings;
use gyronet::guard::Guard;
use gyronet::model::background::BackgroundCheck;
use gyronet::model::fognet::FogNetState;
use gyronet::model::{Blob, FogBlob, FogNet, weights};
use gyronet::service::{Device, Drives};
use gyronet::store::FogPart;

/// A fibre-optic gyro is listened to whether one is configured or not.
const DRIVES: Drives = Drives { imus: PARTS, fogs: &[FogPart::Dsp1760], bits_per_second: &[BITS_PER_SECOND] };
/// Whose wheel frames are understood.
pub const WHEELS: WheelSettings = WheelSettings::TOYOTA;

/// What each task gets.
pub struct Parts {
    pub output: Unconnected,
    /// To be put under the network.
    pub weights: Option<Blob<'static>>,
    pub fog_network: Option<&'static mut FogNet<'static, 'static>>,
    /// A fibre-optic gyro is configured.
    pub fog_expected: bool,
    pub device: Stored,
}

/// `None` when they have been made before.
#[inline(never)]
pub fn parts(board: &Board) -> Option<Parts> {
    let flash = match Flash::probe() {
        Some(flash) => Some(&*cortex_m::singleton!(: Flash = flash)?),
        None => None,
    };
    let device = cortex_m::singleton!(: Device<Records, Slots> = const { Device::new(&DRIVES) })?;
    let writable = flash.is_some_and(Flash::writable);
    device.begin(flash.map(Records), flash.map(Slots), writable, board.identity);
    // Without good weights the pipeline still runs: the status says degraded, and the rate is
    // the gyro's less its static bias.
    let blob = device.weights(flash.map(Flash::slots_at_start), &weights::DEFAULT.0);
    let check = blob.as_ref().map(BackgroundCheck::new);
    let configuration = device.configuration();
    let pipeline = configuration.pipeline(device.calibration());
    let windows = Windows::new(blob.is_some(), pipeline.compensate.mode.delay());
    let (part, fog_ids) = (configuration.imu, configuration.fog_ids);
    let fog_expected = configuration.fog.is_some();
    let doubts = Doubts { stored: device.stored_damaged(), configuration: device.configuration_lost() };
    // What is stored has been checked.
    let config = Config::new(configuration.can).unwrap_or(Config::DEFAULT);
    let guard = cortex_m::singleton!(: MaybeUninit<Guard> = MaybeUninit::uninit())?;
    let guard = place(guard, || Guard::new(pipeline));
    Some(Parts {
        output: Unconnected { guard, config, wheels: Some(WHEELS), windows, part, fog_ids, doubts },
        weights: blob,
        fog_network: fog_network(),
        fog_expected,
        device: (device, check),
    })
}

/// FoGNet on its built-in weights; `None` when they are damaged.
#[inline(never)]
fn fog_network() -> Option<&'static mut FogNet<'static, 'static>> {
    let state = cortex_m::singleton!(: FogNetState = FogNetState::ZERO)?;
    let blob = FogBlob::new_checked(&weights::FOGNET.0).ok()?;
    cortex_m::singleton!(: FogNet<'static, 'static> = FogNet::new(blob, state))
}

/// Makes a value where it stays; what that takes of the stack is given back.
#[inline(never)]
pub fn place<T>(slot: &mut MaybeUninit<T>, make: impl FnOnce() -> T) -> &mut T {
    slot.write(make())
}

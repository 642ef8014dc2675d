//! Builds the resources of the tasks in their statics.
#![allow(unsafe_code, reason = "a peripheral that is taken; the block says why it is sound")]

use crate::board::Board;
use crate::boards::BOARD;
use crate::idle::Stored;
use crate::queues;
use crate::regions::{self, Records, Weights};
use crate::stm32f405::{clocks::FULL_HZ, flash::Flash, pac};
use core::mem::MaybeUninit;
use gyronet::coprocessor::Config;
use gyronet::heading::GnssSettings;
use gyronet::model::background::BackgroundCheck;
use gyronet::model::{Blob, weights};
use gyronet::service::{Device, SupportedHardware};
use gyronet::store::{FogPart, ImuPart};

/// The hardware that this image supports: what the board has the lines for. The image listens to a fibre-optic gyro
/// whether one is configured or not.
const SUPPORTED_HARDWARE: SupportedHardware = SupportedHardware {
    imus: match (BOARD.imu.is_some(), BOARD.spi.is_some()) {
        (true, true) => &[ImuPart::XsensMti, ImuPart::Icm42688, ImuPart::Bmi088, ImuPart::Asm330lhh],
        (true, false) => &[ImuPart::XsensMti],
        (false, true) => &[ImuPart::Icm42688, ImuPart::Bmi088, ImuPart::Asm330lhh],
        (false, false) => &[],
    },
    fogs: if BOARD.fog.is_some() { &[FogPart::Dsp1760] } else { &[] },
    gnss: BOARD.gnss.is_some(),
    fd: false,
    clock_hz: FULL_HZ,
};

const BUILT_IN: &[u8] = &weights::DEFAULT.0;

/// Sets the bit rate of CAN and the identifiers of diagnosis, and makes CAN receive only the frames that the
/// configuration names.
fn receive(board: &Board, device: &Device<Records, Weights>) {
    let configuration = device.configuration();
    // A stored configuration has been checked.
    configuration.diagnosis.ids().into_iter().for_each(queues::set_ids);
    if let Some(can) = &board.can {
        can.set_bit_rate(configuration.can.bits_per_second);
        can.receive_only(device.received());
    }
}

pub struct Parts {
    pub part: ImuPart,
    pub bits_per_second: u32,
    /// The line of a GNSS receiver, if it is used.
    pub line: Option<GnssSettings>,
    pub config: &'static Config,
    pub weights: Option<Blob<'static>>,
    pub device: Stored,
}

/// Creates the parts; `None` if they have been created before.
#[inline(never)]
pub fn parts(board: &Board) -> Option<Parts> {
    // SAFETY: the clock tree no longer uses the controller, and this runs once.
    let registers = unsafe { pac::FLASH::steal() };
    let flash = &*cortex_m::singleton!(: Flash = Flash::new(registers))?;
    let device =
        cortex_m::singleton!(: Device<Records, Weights> = const { Device::new(&SUPPORTED_HARDWARE) })?;
    device.begin(Some(Records::records(flash)), Some(Weights::weights(flash)), flash.check(), board.identity);
    // Without valid weights the pipeline still runs: the status says degraded, and the rate is the gyro's minus its
    // static bias.
    let blob = device.weights(Some(regions::slots_at_start()), BUILT_IN);
    let check = blob.as_ref().map(|blob| BackgroundCheck::new(blob.content, blob.crc));
    let configuration = device.configuration();
    // In a static, since the stack is at its deepest where the coprocessor is made of it.
    let config = &*cortex_m::singleton!(: Config = device.coprocessor(board.clocks.exact()))?;
    receive(board, device);
    let (part, bits_per_second) = (configuration.imu, config.can.settings().bits_per_second);
    let line = configuration.heading.line;
    Some(Parts { part, bits_per_second, line, config, weights: blob, device: (device, check) })
}

/// Creates a value in its static. Not inlined, so that the stack that `make` uses is freed afterwards.
#[inline(never)]
pub fn init_static<T>(slot: &mut MaybeUninit<T>, make: impl FnOnce() -> T) -> &mut T {
    slot.write(make())
}

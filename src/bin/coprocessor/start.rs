//! Builds the resources of the tasks in their statics.
#![allow(unsafe_code, reason = "a peripheral that is taken; the block says why it is sound")]

use crate::board::Board;
use crate::boards::BOARD;
use crate::diagnosis;
use crate::idle::Stored;
use crate::output::OutputParts;
use crate::regions::{self, Records, Weights};
use crate::stm32f405::{clocks::FULL_HZ, flash::Flash, pac};
use core::mem::MaybeUninit;
use gyronet::align::clock_ratio::ClockRatioConfig;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::coprocessor::{Clock, Config, StorageFaults};
use gyronet::model::background::BackgroundCheck;
use gyronet::model::{Blob, weights};
use gyronet::service::{Device, SupportedHardware};
use gyronet::store::{Configuration, FogPart, ImuPart};

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
    clock_hz: FULL_HZ,
};

/// Weights that are used if no slot has valid ones.
const BUILT_IN: &[u8] = &weights::DEFAULT.0;

/// Sets the bit rate of CAN and the identifiers of diagnosis, and makes CAN receive only the frames that the
/// configuration names.
fn receive(board: &Board, configuration: &Configuration, wheels: &WheelSettings) {
    let exactly = |id| (id, u32::MAX);
    let wheels = wheels.frames.into_iter().flatten().map(|frame| exactly(frame.id));
    // A stored configuration has been checked.
    let ids = configuration.diagnosis.ids().ok();
    ids.into_iter().for_each(diagnosis::set_ids);
    let requests = ids.into_iter().flat_map(|[request, functional, _]| [request, functional].map(exactly));
    if let Some(can) = &board.can {
        can.set_bit_rate(configuration.can.bits_per_second);
        can.receive_only(requests.into_iter().chain(wheels).chain(configuration.heading.filters()));
    }
}

pub struct Parts {
    pub output: OutputParts,
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
    device.begin(Some(Records(flash)), Some(Weights(flash)), flash.check(), board.identity);
    // Without valid weights the pipeline still runs: the status says degraded, and the rate is the gyro's minus its
    // static bias.
    let blob = device.weights(Some(regions::slots_at_start()), BUILT_IN);
    let check = blob.as_ref().map(|blob| BackgroundCheck::new(blob.content, blob.crc));
    let configuration = device.configuration();
    let weights = blob.map_or(0, |blob| blob.crc);
    let of_other_weights = device.calibration().unit.is_some_and(|unit| unit.weights != weights);
    // In a static, since the stack is at its deepest where the coprocessor is made of it.
    let config = &*cortex_m::singleton!(: Config = Config {
        wheels: WheelReceiver::new(*device.wheels()).ok(),
        has_gyronet: blob.is_some(),
        clock: Clock::Outside,
        clock_ratio: board.clocks.exact().then_some(ClockRatioConfig::DEFAULT),
        storage: StorageFaults {
            damaged: device.stored_damaged() || of_other_weights,
            configuration_lost: device.configuration_lost(),
        },
        ..configuration.coprocessor(device.calibration(), device.learned(), weights)
    })?;
    receive(board, configuration, device.wheels());
    let (part, bits_per_second) = (configuration.imu, config.can.settings().bits_per_second);
    Some(Parts {
        output: OutputParts { part, bits_per_second, gnss: configuration.heading.line },
        config,
        weights: blob,
        device: (device, check),
    })
}

/// Creates a value in its static. Not inlined, so that the stack that `make` uses is freed afterwards.
#[inline(never)]
pub fn init_static<T>(slot: &mut MaybeUninit<T>, make: impl FnOnce() -> T) -> &mut T {
    slot.write(make())
}

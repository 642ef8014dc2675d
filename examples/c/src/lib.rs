//! The C interface: bytes and frames in, frames out, over memory of the caller.
//!
//! Each function takes the board that [`gyronet_init`] made in the caller's memory, allocates nothing and does not
//! wait. A pointer must be null or valid as C means it; where null is not allowed the result says so. A board is used
//! by one task at a time.

#![cfg_attr(target_os = "none", no_std)]
#![allow(
    unsafe_code,
    reason = "C passes pointers; each function checks them for null and uses them only during its call"
)]

use core::ffi::c_void;
use embedded_can::{ExtendedId, Frame, Id, StandardId};
use gyronet::bias::{EarthRate, Latitude};
use gyronet::can::DataFrame;
use gyronet::can::signal::{BitField, ByteOrder};
use gyronet::can::wheel::{Checksum, WheelFrame, WheelReceiver, WheelSettings, WheelSignal};
use gyronet::estimate::YawEstimate;
use gyronet::model::GyroNetState;
use gyronet::mounting::Rotation;
use gyronet::sample::{ImuSample, NO_STAMP, Validity};
use gyronet::sensor::{Source, xsens::Mti};
use gyronet::units::{CentiCelsius, SpecificForce, WheelSpeed};
use gyronet::{AngularRate, Config, Coprocessor, GyroNet, Micros, Sink, TimedFrame, TransmitQueue};

/// Version of this interface: it rises when a structure or a function changes.
pub const GYRONET_ABI_VERSION: u32 = 1;

/// Frames that wait for the bus; a newer one then pushes out the oldest, which counts as lost.
pub const GYRONET_QUEUE: usize = 24;

/// What a function says of its call.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GyronetResult {
    /// Done.
    Ok = 0,
    /// A pointer is null.
    Null,
    /// The memory is smaller than gyronet_size().
    Small,
    /// The memory's address is no multiple of gyronet_align().
    Misaligned,
    /// An angle of the mounting or the latitude is out of range.
    Settings,
    /// The description of the wheels cannot be used, or a frame has the identifier of a message of the board.
    Wheels,
    /// A value of the sample is beyond the range of all parts: it counts as a failed read.
    Range,
    /// The input was not used; the messages on the bus report it.
    Refused,
}

/// A CAN frame with up to eight bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct GyronetFrame {
    /// Identifier, 11 or 29 bits.
    pub id: u32,
    /// The identifier has 29 bits.
    pub is_extended: bool,
    /// Number of bytes, 0 to 8.
    pub length: u8,
    /// The bytes.
    pub data: [u8; 8],
}

/// The place of a wheel's speed on the bus, as a DBC file says it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct GyronetWheel {
    /// Identifier of the frame.
    pub id: u32,
    /// The identifier has 29 bits.
    pub is_extended: bool,
    /// Start bit as in the DBC file.
    pub start: u8,
    /// Number of bits, 1 to 32; 0 where the wheel has no speed.
    pub bits: u8,
    /// Motorola byte order (@0 in the DBC file).
    pub is_big_endian: bool,
    /// Two's complement.
    pub is_signed: bool,
    /// km/h for each bit.
    pub factor_kmh: f32,
    /// km/h at raw value zero.
    pub offset_kmh: f32,
}

/// What belongs to a vehicle.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct GyronetSettings {
    /// Rotation of the sensor against the vehicle: about x (forward), then y (left), then z (up), degrees.
    pub mounting_deg: [f32; 3],
    /// Latitude, degrees, north positive; NAN where unknown.
    pub latitude_deg: f32,
    /// Front left, front right, rear left, rear right: none, two or four of them.
    pub wheels: [GyronetWheel; 4],
}

/// A reading of an inertial sensor: x forward, y left, z up.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct GyronetSample {
    /// Time of the reading by the sensor's clock, microseconds; UINT64_MAX where it sends none.
    pub time_us: u64,
    /// Specific force, m/s^2.
    pub specific_force: [f32; 3],
    /// Angular rate, rad/s.
    pub angular_rate: [f32; 3],
    /// Temperature, deg C; NAN where there is none.
    pub temperature: f32,
    /// The sensor says that an axis is saturated.
    pub is_saturated: bool,
}

/// The newest corrected yaw rate.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct GyronetRate {
    /// Corrected yaw rate, rad/s, left positive.
    pub rate: f32,
    /// Expected error of its mean over a second, rad/s, 1 sigma; infinite while unknown.
    pub sigma: f32,
    /// 0 unusable, 1 degraded, 2 good.
    pub quality: u8,
    /// Faults, as in message 0x1A2.
    pub faults: u16,
}

/// A board: its state is opaque.
pub struct Gyronet {
    coprocessor: Coprocessor,
    network: GyroNet<'static, GyroNetState>,
    mti: Mti,
    out: Out,
}

struct Out {
    frames: TransmitQueue<DataFrame, GYRONET_QUEUE>,
    newest: Option<YawEstimate>,
}

impl Sink for Out {
    fn frame(&mut self, frame: TimedFrame) {
        self.frames.enqueue(frame.frame);
    }

    fn observed(&mut self, observation: &gyronet::Observation) {
        self.newest = Some(observation.vehicle.live);
    }
}

impl Gyronet {
    fn sample(&mut self, sample: ImuSample, now: Micros) -> GyronetResult {
        let result = self.coprocessor.imu_to(sample, now, &mut self.out);
        self.coprocessor.estimate(&mut self.network);
        if result.is_ok() { GyronetResult::Ok } else { GyronetResult::Refused }
    }

    fn poll(&mut self, now: Micros) {
        self.coprocessor.bus(self.out.frames.dropped(), false);
        // A clock that goes back is counted.
        let _ = self.coprocessor.poll_to(now, &mut self.out);
    }
}

/// Returns [`GYRONET_ABI_VERSION`] of the library: compare it with that of the header.
#[unsafe(no_mangle)]
pub extern "C" fn gyronet_abi_version() -> u32 {
    GYRONET_ABI_VERSION
}

/// Returns the number of bytes that a board needs.
#[unsafe(no_mangle)]
pub extern "C" fn gyronet_size() -> usize {
    size_of::<Gyronet>()
}

/// Returns the alignment that a board needs.
#[unsafe(no_mangle)]
pub extern "C" fn gyronet_align() -> usize {
    align_of::<Gyronet>()
}

/// Returns the settings of a level sensor without wheels and without a latitude.
#[unsafe(no_mangle)]
pub extern "C" fn gyronet_default_settings() -> GyronetSettings {
    GyronetSettings { mounting_deg: [0.0; 3], latitude_deg: f32::NAN, wheels: [GyronetWheel::default(); 4] }
}

/// Makes a board in `memory` (aligned, `size` bytes, kept by the caller) and stores it in `board`. It needs about
/// 16 KiB of stack, once.
///
/// # Safety
/// `memory` must be writable for `size` bytes as long as the board is used; `settings` and `board` must be valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyronet_init(
    memory: *mut c_void,
    size: usize,
    settings: *const GyronetSettings,
    board: *mut *mut Gyronet,
) -> GyronetResult {
    // SAFETY: the caller's pointers are null or valid.
    let (Some(settings), Some(board)) = (unsafe { settings.as_ref() }, unsafe { board.as_mut() }) else {
        return GyronetResult::Null;
    };
    *board = core::ptr::null_mut();
    let place = memory.cast::<Gyronet>();
    if place.is_null() {
        return GyronetResult::Null;
    }
    if size < size_of::<Gyronet>() {
        return GyronetResult::Small;
    }
    if !place.is_aligned() {
        return GyronetResult::Misaligned;
    }
    let config = match config(settings) {
        Ok(config) => config,
        Err(error) => return error,
    };
    let Ok(network) = GyroNet::shipped() else { return GyronetResult::Refused };
    let out = Out { frames: TransmitQueue::new(), newest: None };
    // SAFETY: the place is not null, aligned and large enough, and the caller owns it.
    unsafe { place.write(Gyronet { coprocessor: Coprocessor::new(config), network, mti: Mti::new(), out }) };
    *board = place;
    GyronetResult::Ok
}

/// Passes in bytes that an MTi has sent, received until `now_us`. A refused message is reported on the bus.
///
/// # Safety
/// `bytes` must be readable for `length` bytes; `board` must come from [`gyronet_init`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyronet_mti(
    board: *mut Gyronet,
    bytes: *const u8,
    length: usize,
    now_us: u64,
) -> GyronetResult {
    // SAFETY: the caller's pointer is null or valid.
    let Some(board) = (unsafe { board.as_mut() }) else { return GyronetResult::Null };
    if bytes.is_null() {
        return GyronetResult::Null;
    }
    // SAFETY: not null, and readable for that length.
    let mut bytes = unsafe { core::slice::from_raw_parts(bytes, length) };
    let mut result = GyronetResult::Ok;
    while !bytes.is_empty() {
        let taken = board.mti.receive_some(bytes);
        bytes = bytes.get(taken..).unwrap_or_default();
        while let Some(sample) = board.mti.next_sample() {
            let taken = match sample {
                Ok(sample) => board.sample(sample, Micros(now_us)),
                Err(_) => {
                    board.coprocessor.imu_error();
                    GyronetResult::Refused
                }
            };
            result = if taken == GyronetResult::Ok { result } else { taken };
        }
    }
    result
}

/// Passes in a reading of another sensor; null for a read that failed.
///
/// # Safety
/// `sample` must be null or valid; `board` must come from [`gyronet_init`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyronet_sample(
    board: *mut Gyronet,
    sample: *const GyronetSample,
    now_us: u64,
) -> GyronetResult {
    // SAFETY: the caller's pointers are null or valid.
    let (Some(board), sample) = (unsafe { board.as_mut() }, unsafe { sample.as_ref() }) else {
        return GyronetResult::Null;
    };
    match sample.and_then(codes) {
        Some(sample) => board.sample(sample, Micros(now_us)),
        None => {
            board.coprocessor.imu_error();
            if sample.is_some() { GyronetResult::Range } else { GyronetResult::Ok }
        }
    }
}

/// Passes in a frame from the bus, as of the wheels. A frame that is none of the board's is passed over.
///
/// # Safety
/// `frame` must be null or valid; `board` must come from [`gyronet_init`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyronet_receive(
    board: *mut Gyronet,
    frame: *const GyronetFrame,
    now_us: u64,
) -> GyronetResult {
    // SAFETY: the caller's pointers are null or valid.
    let (Some(board), Some(frame)) = (unsafe { board.as_mut() }, unsafe { frame.as_ref() }) else {
        return GyronetResult::Null;
    };
    let data = frame.data.get(..frame.length.into());
    let frame = identifier(frame.id, frame.is_extended).zip(data);
    match frame.and_then(|(id, data)| DataFrame::new(id, data)) {
        Some(frame) if board.coprocessor.can(&frame, Micros(now_us)).is_ok() => GyronetResult::Ok,
        _ => GyronetResult::Refused,
    }
}

/// Does what is due without an input, as reporting silence: call it about every millisecond.
///
/// # Safety
/// `board` must be null or come from [`gyronet_init`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyronet_poll(board: *mut Gyronet, now_us: u64) -> GyronetResult {
    // SAFETY: the caller's pointer is null or valid.
    let Some(board) = (unsafe { board.as_mut() }) else { return GyronetResult::Null };
    board.poll(Micros(now_us));
    GyronetResult::Ok
}

/// Takes the next frame to send; false where none waits.
///
/// # Safety
/// `frame` must be valid; `board` must come from [`gyronet_init`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyronet_next_frame(board: *mut Gyronet, frame: *mut GyronetFrame) -> bool {
    // SAFETY: the caller's pointers are null or valid.
    let (Some(board), Some(place)) = (unsafe { board.as_mut() }, unsafe { frame.as_mut() }) else {
        return false;
    };
    let Some(frame) = board.out.frames.pop() else { return false };
    let (id, is_extended) = match frame.id() {
        Id::Standard(id) => (id.as_raw().into(), false),
        Id::Extended(id) => (id.as_raw(), true),
    };
    *place = GyronetFrame { id, is_extended, length: frame.dlc() as u8, data: *frame.padded() };
    true
}

/// Copies the newest rate; all zero before the first one.
///
/// # Safety
/// `rate` must be valid; `board` must come from [`gyronet_init`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyronet_rate(board: *const Gyronet, rate: *mut GyronetRate) -> GyronetResult {
    // SAFETY: the caller's pointers are null or valid.
    let (Some(board), Some(rate)) = (unsafe { board.as_ref() }, unsafe { rate.as_mut() }) else {
        return GyronetResult::Null;
    };
    *rate = board.out.newest.map_or(GyronetRate::default(), |newest| GyronetRate {
        rate: newest.rate.rad_per_sec() as f32,
        sigma: newest.sigma.map_or(f32::INFINITY, |sigma| sigma.rad_per_sec() as f32),
        quality: match newest.quality {
            gyronet::health::Quality::Good => 2,
            gyronet::health::Quality::Degraded => 1,
            _ => 0,
        },
        faults: newest.faults.0.into(),
    });
    GyronetResult::Ok
}

fn identifier(id: u32, is_extended: bool) -> Option<Id> {
    if is_extended {
        return ExtendedId::new(id).map(Id::Extended);
    }
    u16::try_from(id).ok().and_then(StandardId::new).map(Id::Standard)
}

fn codes(sample: &GyronetSample) -> Option<ImuSample> {
    let [fx, fy, fz] = sample.specific_force.map(|force| SpecificForce::from_metre_per_sec2(force).ok());
    let [x, y, z] = sample.angular_rate.map(|rate| AngularRate::from_rad_per_sec(rate).ok());
    let celsius = sample.temperature;
    Some(ImuSample {
        time: if sample.time_us == u64::MAX { NO_STAMP } else { Micros(sample.time_us) },
        specific_force: [fx?, fy?, fz?],
        angular_rate: [x?, y?, z?],
        temperature: (celsius.abs() < 300.0).then_some(CentiCelsius((celsius * 100.0) as i16)),
        validity: Validity::reported(sample.is_saturated),
    })
}

fn config(settings: &GyronetSettings) -> Result<Config, GyronetResult> {
    let mut config = Config::DEFAULT;
    let [roll, pitch, yaw] = settings.mounting_deg;
    config.pipeline.mounting = Rotation::from_mounting(roll, pitch, yaw).ok_or(GyronetResult::Settings)?;
    if !settings.latitude_deg.is_nan() {
        let latitude = Latitude::from_degrees(settings.latitude_deg).ok_or(GyronetResult::Settings)?;
        config.pipeline.earth_rate = EarthRate::Subtracted(latitude);
    }
    if settings.wheels.iter().any(|wheel| wheel.bits > 0) {
        let wheels = wheels(&settings.wheels).ok_or(GyronetResult::Wheels)?;
        let receiver = WheelReceiver::new(wheels).map_err(|_| GyronetResult::Wheels)?;
        if wheels.frames.iter().flatten().any(|frame| config.can.sends(frame.id)) {
            return Err(GyronetResult::Wheels);
        }
        config.wheels = Some(receiver);
    }
    Ok(config)
}

fn wheels(wheels: &[GyronetWheel; 4]) -> Option<WheelSettings> {
    let mut settings = WheelSettings { frames: [None; 4], signals: [None; 4], ..WheelSettings::TOYOTA };
    for (signal, wheel) in settings.signals.iter_mut().zip(wheels).filter(|(_, wheel)| wheel.bits > 0) {
        let id = identifier(wheel.id, wheel.is_extended)?;
        let place = settings.frames.iter().position(|frame| frame.is_none_or(|frame| frame.id == id))?;
        *settings.frames.get_mut(place)? = Some(WheelFrame { id, counter: None, checksum: Checksum::None });
        let order = if wheel.is_big_endian { ByteOrder::Motorola } else { ByteOrder::Intel };
        let field = BitField::new(wheel.start, wheel.bits, order, wheel.is_signed).ok()?;
        let factor = WheelSignal::per_bit_kmh(wheel.factor_kmh.into());
        let offset = WheelSpeed((wheel.offset_kmh / 3.6 * 65_536.0) as i32);
        *signal = Some(WheelSignal { offset, ..WheelSignal::new(place as u8, field, factor) });
    }
    Some(settings)
}

/// A panic ends in a loop, and with it in the watchdog's reset. A test shows that no image with this library has one.
#[cfg(target_os = "none")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}

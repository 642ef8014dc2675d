//! The board's stored data on a mock flash: every request and every refusal, by themselves and over diagnosis.

mod access;
mod configuration;
mod firmware;
mod isotp;
mod keys;
mod learning;
#[cfg(target_os = "linux")]
mod socketcan;
mod together;
mod uds;
mod weights;

use gyronet::health::{Faults, Status};
use gyronet::model::weights::DEFAULT;
use gyronet::sample::{ImuSample, PERIOD_US, Standstill, Validity, WheelSample};
use gyronet::service::crash::FILE;
use gyronet::service::event::{ClockFault, Crash, CrashKind, ResetCause};
use gyronet::service::message::Identity;
use gyronet::service::{Device, SupportedHardware};
use gyronet::store::{ImuPart, Slot, layout};
use gyronet::units::{AngularRate, CentiCelsius, Micros, SpecificForce};
use gyronet_host_tests::flash::{Flash, Region};
use gyronet_host_tests::stored::slots;
use gyronet_host_tests::synthetic::judged;

type Board = Device<Region, Region>;
const SUPPORTED_HARDWARE: SupportedHardware = SupportedHardware {
    imus: &[ImuPart::XsensMti],
    fogs: &[],
    gnss: false,
    fd: false,
    clock_hz: 168_000_000,
};
const IDENTITY: Identity = Identity {
    firmware: [0, 1, 0],
    device_id: Some(0x413),
    serial: *b"a test board",
    clock_hz: 168_000_000,
    clock_fault: None,
    can_fault: None,
    reset: ResetCause::Software,
    crash: Some(Crash {
        kind: CrashKind::HardFault,
        place: 0x0800_1234,
        link: 0,
        status: 0,
        address: 0,
        file: [0; FILE],
        count: 1,
    }),
    failed_starts: 0,
};

fn start(flash: &Flash) -> Board {
    start_from(flash, None)
}

/// A new board and its flash.
fn fresh() -> (Flash, Board) {
    let flash = Flash::default();
    let board = start(&flash);
    (flash, board)
}

/// A board whose boot loader has started a slot.
fn start_from(flash: &Flash, running: Option<Slot>) -> Board {
    let records = Region::new(flash, layout::STORE);
    let mut board = Board::new(&SUPPORTED_HARDWARE);
    board.begin(Some(records), Some(Region::mapped(flash, running)), Ok(()), IDENTITY);
    assert!(board.weights(Some(slots(&flash.borrow())), &DEFAULT.0).is_some());
    board
}

const GOOD: (Status, Faults) = (Status::Ready, Faults::NONE);
/// Specific force of a level sensor at rest, m/s^2.
const LEVEL: [f32; 3] = [0.0, 0.0, 9.81];

/// Lets a board see a sample, or none, and wheels that nothing contradicts.
fn observe(
    board: &mut Board,
    tick: u32,
    sample: Option<&ImuSample>,
    state: (Status, Faults),
    wheels: Standstill,
) {
    board.observe(sample, tick, state, &WheelSample::without_speeds(wheels), &judged(wheels));
}

fn sample(k: u64, force: [f32; 3], rate: f32) -> ImuSample {
    ImuSample {
        time: Micros(k * PERIOD_US),
        specific_force: force.map(|force| SpecificForce::from_metre_per_sec2(force).expect("in range")),
        angular_rate: [AngularRate::from_rad_per_sec(rate).expect("in range"); 3],
        temperature: Some(CentiCelsius(3_000)),
        validity: Validity::Good,
    }
}

#[test]
fn a_crash_is_told_with_its_place() {
    let crash = IDENTITY.crash.expect("there is one");
    let mut panic = Crash { kind: CrashKind::Panic, place: 12, count: 3, ..crash };
    panic.file[..11].copy_from_slice(b"src/main.rs");
    assert_eq!(panic.to_string(), "panic in line 12 of src/main.rs, 3 since power-on");
    let place = "hard fault at 0x08001234, called from 0x08000101, CFSR ";
    for (status, rest) in [
        (1 << 9, "0x00000200"),
        (1 << 7, "0x00000080, address 0x20000004"),
        (1 << 15, "0x00008000, address 0x20000004"),
    ] {
        let fault = Crash { link: 0x0800_0101, status, address: 0x2000_0004, ..crash };
        assert_eq!(fault.to_string(), format!("{place}{rest}, 1 since power-on"));
    }
}

#[test]
fn a_clock_s_fault_is_told_in_words() {
    let text = |khz| ClockFault::CrystalFrequency { khz }.to_string();
    assert_eq!(text(25_012), "the crystal has 25.012 MHz");
    assert_eq!(text(0), "the crystal's frequency could not be measured");
}

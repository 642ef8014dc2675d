//! Faults while everything is connected, in the emulated image: GyroNet and FoGNet both run, and one
//! input fails. Every frame equals the host's; here is what these frames say, and how soon.
//!
//! Times are of the samples: a frame counts as sent with the sample of the MTi before it. They are
//! counted from the moment that the criterion of each fault is met, which stands with its test.

use embedded_can::Frame;
use gyronet::can::bosch::{SignalStatus, TX1_ID, Tx1};
use gyronet::can::yaw::{AngleMessage, FOG_IDS, Faults, Quality, RATE_NOT_AVAILABLE, RateMessage};
use gyronet::fog;
use gyronet::monitor::{HOLD, STUCK_AFTER};
use gyronet::store::Configuration;
use gyronet_host_tests::connected::{self, Step};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::recordings::{self, Row, workspace};
use gyronet_host_tests::{image, qemu, replay};

/// By then FoGNet corrects, and the vehicle has begun to move.
const BEGIN: usize = 640;
/// By then it does so again after any of these faults.
const RECOVERED: usize = 320;
const OWN: u16 = 0x1A0;
/// Before, nothing is known of some inputs, which is told.
const STARTED: usize = 600;
/// MTData2 status: a gyro axis is clipped.
const CLIPPED: u32 = 1 << 11;
fn drive() -> Vec<Row> {
    recordings::rows(&workspace().join("tools/data/simulated_drive.csv"))
}

/// What the emulated board, and the host's, say with one input failing.
struct Told(Vec<Vec<u8>>);

impl Told {
    /// It fails for so many samples from [`BEGIN`] on.
    fn of(test: &str, samples: usize, fail: impl Fn(usize, &mut Step)) -> Option<Self> {
        let elf = image::coprocessor(test, env!("CARGO_TARGET_TMPDIR"))?;
        let (end, all) = (BEGIN + samples, BEGIN + samples + RECOVERED);
        let rows = drive();
        let mut steps: Vec<Step> =
            rows.iter().take(all).enumerate().map(|(number, row)| Step::of(number, row)).collect();
        let undamaged = Self(connected::on_host(&steps).lines);
        (BEGIN..end).zip(&mut steps[BEGIN..end]).for_each(|(number, step)| fail(number, step));
        let mut board = qemu::Board::boot(&elf, connected::USARTS, &[]);
        let outcome = connected::run(&mut board, &Configuration::DEFAULT, &steps);
        let told = Self(outcome.host.lines);
        println!("{test}: {} frames, {} because the host was busy", outcome.sent, outcome.followed.followed);
        // Until then nothing is wrong, and in the end nothing is.
        for id in [OWN, FOG_IDS[0]] {
            assert_eq!(told.rated(id, Quality::Good), Some((STARTED, all - 1)), "{test}: {id:#x}");
        }
        told.against(&undamaged, test);
        Some(told)
    }

    fn rates(&self, id: u16) -> Vec<(usize, RateMessage)> {
        connected::rates(&self.0, id).collect()
    }

    /// No rate that is marked good differs from what it is without the fault by more than a correction
    /// may (of GyroNet 1 deg/s; a window that begins elsewhere has another one), or than the vehicle's
    /// rate changes before a gyro is known to be stuck; and none that is marked unusable is a number.
    fn against(&self, undamaged: &Self, test: &str) {
        for (id, most) in [(OWN, 1_000_000), (FOG_IDS[0], 2_000)] {
            let (told, right) = (self.rates(id), undamaged.rates(id));
            assert_eq!(told.len(), right.len());
            let mut worst = 0;
            for ((sample, told), (_, right)) in told.into_iter().zip(right) {
                match told.quality {
                    Quality::Good => worst = worst.max(told.rate.abs_diff(right.rate)),
                    Quality::Unusable => assert_eq!(told.rate, RATE_NOT_AVAILABLE, "sample {sample}"),
                    Quality::Degraded | Quality::Initialising => {}
                }
            }
            let degrees = f64::from(worst) * 1e-6;
            println!("{test}: {id:#x} marked good differs by {degrees:.6} deg/s at most");
            assert!(worst < most);
        }
    }

    /// Samples after the start with which a frame is what is asked for: the first and the last one.
    fn samples(&self, id: u16, is: impl Fn(&[u8]) -> bool) -> Option<(usize, usize)> {
        let after =
            connected::of(&self.0, id).filter(|(sample, frame)| *sample >= STARTED && is(frame.data()));
        let samples: Vec<usize> = after.map(|(sample, _)| sample).collect();
        Some((*samples.first()?, *samples.last()?))
    }

    /// With a fault's bit.
    fn flagged(&self, id: u16, fault: Faults) -> Option<(usize, usize)> {
        self.samples(id, |data| AngleMessage::parse(data).is_ok_and(|angle| angle.faults.0 & fault.0 != 0))
    }

    /// With a rate of such a quality.
    fn rated(&self, id: u16, quality: Quality) -> Option<(usize, usize)> {
        self.samples(id, |data| RateMessage::parse(data).is_ok_and(|rate| rate.quality == quality))
    }

    /// With a drop-in rate that has failed.
    fn failed(&self) -> Option<(usize, usize)> {
        let failed = |data: &[u8]| Tx1::parse(data).expect("a good checksum").yaw_rate_status;
        self.samples(TX1_ID.as_raw(), |data| failed(data) == SignalStatus::FAILURE)
    }
}

/// Criterion: a message that does not come whole. The first one belongs to the 10 ms that end with
/// sample [`BEGIN`].
#[test]
fn fog_garbage() {
    const GARBAGE: usize = 30;
    let garbage = |number: usize, step: &mut Step| {
        let mut noise = Noise::new(number as u64);
        step.fog.iter_mut().for_each(|byte| *byte = noise.byte());
    };
    let Some(told) = Told::of("fog_garbage", GARBAGE, garbage) else { return };
    // Told with the next sample, 20 ms after that message began, and over with the first whole 10 ms.
    let missing = Some((BEGIN + 1, BEGIN + GARBAGE));
    assert_eq!(told.rated(FOG_IDS[0], Quality::Unusable), missing);
    assert_eq!(told.flagged(FOG_IDS[1], Faults::GAP), missing);
    // FoGNet begins anew: two seconds.
    let raw = told.rated(FOG_IDS[0], Quality::Degraded).expect("it has no estimate");
    assert!(raw.0 == BEGIN + GARBAGE + 1 && raw.1 <= BEGIN + GARBAGE + 201, "{raw:?}");
    // The other sensor has nothing to do with it.
    assert_eq!((told.failed(), told.rated(OWN, Quality::Unusable)), (None, None));
}

/// Criterion: [`fog::STUCK_US`] of increments equal to the one before. Here a row has ten equal ones, so the first of
/// the next row is the one that ends 10 ms of them.
#[test]
fn stuck_fog() {
    const STUCK: usize = 40;
    let rows = drive();
    let held = connected::reading(BEGIN - 1, &rows[BEGIN - 1]);
    let stuck = |number: usize, step: &mut Step| step.fog = connected::fog(number, held);
    let Some(told) = Told::of("stuck_fog", STUCK, stuck) else { return };
    assert_eq!(fog::STUCK_US, 10_000);
    let failed = Some((BEGIN, BEGIN + STUCK - 1));
    assert_eq!(told.rated(FOG_IDS[0], Quality::Unusable), failed);
    assert_eq!(told.flagged(FOG_IDS[1], Faults::STUCK), failed);
    assert_eq!((told.failed(), told.rated(OWN, Quality::Unusable)), (None, None));
}

/// Criterion: 100 ms without a wheel frame (`WheelSettings::TOYOTA`, five of their periods). The last
/// one came with sample `BEGIN - 3`, so it is met between `BEGIN + 7` and `BEGIN + 8`.
#[test]
fn wheels_gone_and_back() {
    const GONE: usize = 160;
    let Some(told) = Told::of("wheels_gone_and_back", GONE, |_, step| step.wheels = None) else { return };
    for id in [OWN + 1, FOG_IDS[1]] {
        assert_eq!(told.flagged(id, Faults::WHEELS), Some((BEGIN + 8, BEGIN + GONE - 1)), "{id:#x}");
    }
    // The estimate in use is of seconds that had wheels. It ends with the second that has none, and
    // comes back two seconds after the wheels.
    let raw = told.rated(FOG_IDS[0], Quality::Degraded).expect("no estimate without wheels");
    assert!((BEGIN + 8..BEGIN + 108).contains(&raw.0) && raw.1 <= BEGIN + GONE + 201, "{raw:?}");
    assert_eq!((told.failed(), told.rated(FOG_IDS[0], Quality::Unusable)), (None, None));
}

/// Criterion: the part says so, in the sample itself.
#[test]
fn saturated_sensor() {
    const SATURATED: usize = 3;
    let Some(told) = Told::of("saturated_sensor", SATURATED, |_, step| step.imu.status = Some(CLIPPED))
    else {
        return;
    };
    let failed = Some((BEGIN, BEGIN + SATURATED + usize::from(HOLD) - 1));
    assert_eq!((told.failed(), told.flagged(OWN + 1, Faults::CLIPPED)), (failed, failed));
    assert_eq!(told.rated(FOG_IDS[0], Quality::Unusable), None);
}

/// Criterion: [`STUCK_AFTER`] samples equal to the one before, in the last of them.
#[test]
fn stuck_sensor() {
    const STUCK: usize = 40;
    let rows = drive();
    let held = replay::message(BEGIN - 1, &rows[BEGIN - 1]);
    let stuck = |_: usize, step: &mut Step| {
        step.imu.acceleration = held.acceleration;
        step.imu.rate_of_turn = held.rate_of_turn;
    };
    let Some(told) = Told::of("stuck_sensor", STUCK, stuck) else { return };
    let failed = Some((BEGIN + usize::from(STUCK_AFTER) - 1, BEGIN + STUCK - 1));
    assert_eq!((told.failed(), told.flagged(OWN + 1, Faults::STUCK)), (failed, failed));
    assert_eq!(told.rated(FOG_IDS[0], Quality::Unusable), None);
}

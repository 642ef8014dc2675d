//! Faults while everything is connected, in the emulated image: GyroNet and the default lane of a fibre-optic gyro run,
//! and one input fails. Every frame equals the host's; here is what these frames say, and how soon.
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
use gyronet_host_tests::stored::Stored;
use gyronet_host_tests::{image, replay};

/// The sample with which a fault begins: the vehicle moves.
const BEGIN: usize = 640;
/// The number of samples after which both rates are good again after any of these faults.
const RECOVERED: usize = 320;
const OWN: u16 = 0x1A0;
/// The first sample with which nothing is reported: before it some inputs have not been heard.
const STARTED: usize = 600;
/// MTData2 status: a gyro axis is clipped.
const CLIPPED: u32 = 1 << 11;
/// The simulated gyro does not turn with the Earth.
const AT_THE_EQUATOR: Configuration = Configuration { latitude_deg: Some(0.0), ..Configuration::DEFAULT };

fn drive() -> Vec<Row> {
    recordings::rows(&workspace().join("tools/data/simulated_drive.csv"))
}

/// The lines of the emulated board, and the host's, with one input failing.
struct Reported(Vec<Vec<u8>>);

impl Reported {
    /// Lets an input fail for so many samples from [`BEGIN`] on.
    fn of(test: &str, samples: usize, fail: impl Fn(usize, &mut Step)) -> Option<Self> {
        let scratch = env!("CARGO_TARGET_TMPDIR");
        let elf = image::coprocessor(test, scratch)?;
        let (end, all) = (BEGIN + samples, BEGIN + samples + RECOVERED);
        let rows = drive();
        let mut steps: Vec<Step> =
            rows.iter().take(all).enumerate().map(|(number, row)| Step::from_row(number, row)).collect();
        let undamaged = Self(connected::on_host(&AT_THE_EQUATOR, &steps).lines);
        (BEGIN..end).zip(&mut steps[BEGIN..end]).for_each(|(number, step)| fail(number, step));
        let stored = Stored::default().record(&AT_THE_EQUATOR);
        let mut board = stored.boot(&elf, connected::USARTS, scratch, test);
        let outcome = connected::run(&mut board, &AT_THE_EQUATOR, &steps);
        let reported = Self(outcome.host.lines);
        println!("{test}: {} frames, {} because the host was busy", outcome.sent, outcome.followed.followed);
        // Until then nothing is wrong, and in the end nothing is.
        for id in [OWN, FOG_IDS[0]] {
            assert_eq!(reported.rated(id, Quality::Good), Some((STARTED, all - 1)), "{test}: {id:#x}");
        }
        reported.against(&undamaged, test);
        Some(reported)
    }

    fn rates(&self, id: u16) -> Vec<(usize, RateMessage)> {
        connected::rates(&self.0, id).collect()
    }

    /// Checks that no rate that is marked good differs from what it is without the fault by more than a correction
    /// may (of GyroNet 1 deg/s; a window that begins elsewhere has another one), or than the vehicle's
    /// rate changes before a gyro is known to be stuck, or than the first 10 ms after a gap differ that begin at another
    /// increment (0.0036 deg/s, 6e-7 rad); and none that is marked unusable is a number.
    fn against(&self, undamaged: &Self, test: &str) {
        for (id, most) in [(OWN, 1_000_000), (FOG_IDS[0], 5_000)] {
            let (reported, right) = (self.rates(id), undamaged.rates(id));
            assert_eq!(reported.len(), right.len());
            let mut worst = 0;
            for ((sample, reported), (_, right)) in reported.into_iter().zip(right) {
                match reported.quality {
                    Quality::Good => worst = worst.max(reported.rate.abs_diff(right.rate)),
                    Quality::Unusable => assert_eq!(reported.rate, RATE_NOT_AVAILABLE, "sample {sample}"),
                    Quality::Degraded | Quality::Initialising => {}
                }
            }
            let degrees = f64::from(worst) * 1e-6;
            println!("{test}: {id:#x} marked good differs by {degrees:.6} deg/s at most");
            assert!(worst < most);
        }
    }

    /// Returns the first and the last sample after the start with which a frame fulfils a condition.
    fn samples(&self, id: u16, is: impl Fn(&[u8]) -> bool) -> Option<(usize, usize)> {
        let after = connected::frames_with_id(&self.0, id)
            .filter(|(sample, frame)| *sample >= STARTED && is(frame.data()));
        let samples: Vec<usize> = after.map(|(sample, _)| sample).collect();
        Some((*samples.first()?, *samples.last()?))
    }

    /// Returns the first and the last sample with a fault's bit.
    fn flagged(&self, id: u16, fault: Faults) -> Option<(usize, usize)> {
        self.samples(id, |data| AngleMessage::parse(data).is_ok_and(|angle| angle.faults.0 & fault.0 != 0))
    }

    /// Returns the first and the last sample with a rate of such a quality.
    fn rated(&self, id: u16, quality: Quality) -> Option<(usize, usize)> {
        self.samples(id, |data| RateMessage::parse(data).is_ok_and(|rate| rate.quality == quality))
    }

    /// Returns the first and the last sample with a failed drop-in rate.
    fn failed(&self) -> Option<(usize, usize)> {
        let failed = |data: &[u8]| Tx1::parse(data).expect("a good checksum").yaw_rate_status;
        self.samples(TX1_ID.as_raw(), |data| failed(data) == SignalStatus::FAILURE)
    }
}

/// Criterion: a message that does not come whole. The first one belongs to the 10 ms that end with
/// sample [`BEGIN`].
#[test]
fn garbage_from_the_fibre_optic_gyro_is_a_gap() {
    const GARBAGE: usize = 30;
    let garbage = |number: usize, step: &mut Step| {
        let mut noise = Noise::new(number as u64);
        step.fog.iter_mut().for_each(|byte| *byte = noise.byte());
    };
    let Some(reported) = Reported::of("garbage_from_the_fibre_optic_gyro_is_a_gap", GARBAGE, garbage) else {
        return;
    };
    // Reported with the next sample, 20 ms after that message began, and over with the first whole 10 ms.
    let missing = Some((BEGIN + 1, BEGIN + GARBAGE));
    assert_eq!(reported.rated(FOG_IDS[0], Quality::Unusable), missing);
    assert_eq!(reported.flagged(FOG_IDS[1], Faults::GAP), missing);
    // The lane goes on where it was.
    assert_eq!(reported.rated(FOG_IDS[0], Quality::Degraded), None);
    // The other sensor has nothing to do with it.
    assert_eq!((reported.failed(), reported.rated(OWN, Quality::Unusable)), (None, None));
}

/// Criterion: [`fog::STUCK_US`] of increments equal to the one before. Here a row has ten equal ones, so the first of
/// the next row is the one that ends 10 ms of them.
#[test]
fn a_stuck_fibre_optic_gyro_is_reported_after_10_ms() {
    const STUCK: usize = 40;
    let rows = drive();
    let held = connected::fog_reading(BEGIN - 1, &rows[BEGIN - 1]);
    let stuck = |number: usize, step: &mut Step| step.fog = connected::fog_bytes(number, held);
    let Some(reported) = Reported::of("a_stuck_fibre_optic_gyro_is_reported_after_10_ms", STUCK, stuck)
    else {
        return;
    };
    assert_eq!(fog::STUCK_US, 10_000);
    let failed = Some((BEGIN, BEGIN + STUCK - 1));
    assert_eq!(reported.rated(FOG_IDS[0], Quality::Unusable), failed);
    assert_eq!(reported.flagged(FOG_IDS[1], Faults::STUCK), failed);
    assert_eq!((reported.failed(), reported.rated(OWN, Quality::Unusable)), (None, None));
}

/// Criterion: 100 ms without a wheel frame (`WheelSettings::TOYOTA`, five of their periods). The last
/// one came with sample `BEGIN - 3`, so it is met between `BEGIN + 7` and `BEGIN + 8`.
#[test]
fn lost_wheels_are_reported() {
    const GONE: usize = 160;
    let Some(reported) = Reported::of("lost_wheels_are_reported", GONE, |_, step| step.wheels = None) else {
        return;
    };
    for id in [OWN + 1, FOG_IDS[1]] {
        assert_eq!(reported.flagged(id, Faults::WHEELS), Some((BEGIN + 8, BEGIN + GONE - 1)), "{id:#x}");
    }
    // No standstill can be seen meanwhile.
    let degraded = Some((BEGIN + 8, BEGIN + GONE - 1));
    assert_eq!(reported.rated(FOG_IDS[0], Quality::Degraded), degraded);
    assert_eq!((reported.failed(), reported.rated(FOG_IDS[0], Quality::Unusable)), (None, None));
}

/// Criterion: the part says so, in the sample itself.
#[test]
fn a_saturated_sensor_leaves_the_fibre_optic_gyro_alone() {
    const SATURATED: usize = 3;
    let Some(reported) =
        Reported::of("a_saturated_sensor_leaves_the_fibre_optic_gyro_alone", SATURATED, |_, step| {
            step.imu.status = Some(CLIPPED)
        })
    else {
        return;
    };
    let failed = Some((BEGIN, BEGIN + SATURATED + usize::from(HOLD) - 1));
    assert_eq!((reported.failed(), reported.flagged(OWN + 1, Faults::CLIPPED)), (failed, failed));
    assert_eq!(reported.rated(FOG_IDS[0], Quality::Unusable), None);
}

/// Criterion: [`STUCK_AFTER`] samples equal to the one before, in the last of them.
#[test]
fn a_stuck_sensor_leaves_the_fibre_optic_gyro_alone() {
    const STUCK: usize = 40;
    let rows = drive();
    let held = replay::message(BEGIN - 1, &rows[BEGIN - 1]);
    let stuck = |_: usize, step: &mut Step| {
        step.imu.acceleration = held.acceleration;
        step.imu.rate_of_turn = held.rate_of_turn;
    };
    let Some(reported) = Reported::of("a_stuck_sensor_leaves_the_fibre_optic_gyro_alone", STUCK, stuck)
    else {
        return;
    };
    let failed = Some((BEGIN + usize::from(STUCK_AFTER) - 1, BEGIN + STUCK - 1));
    assert_eq!((reported.failed(), reported.flagged(OWN + 1, Faults::STUCK)), (failed, failed));
    assert_eq!(reported.rated(FOG_IDS[0], Quality::Unusable), None);
}

//! The coprocessor as a caller sees it: frames, windows, lateness, and every way to use it wrongly.

use embedded_can::Frame;
use gyronet::align::AlignError;
use gyronet::align::clock::ClockError;
use gyronet::can::DataFrame;
use gyronet::can::yaw::{FOG_IDS, RateMessage};
use gyronet::compensate::DELAY;
use gyronet::coprocessor::{Clock, InputError, Observation, StorageFaults};
use gyronet::health::{Faults, InputCounters, Quality, Status};
use gyronet::model::Estimate;
use gyronet::monitor::TIMEOUT_US;
use gyronet::pipeline::DueWindow;
use gyronet::sample::{FogSample, PERIOD_US, Standstill};
use gyronet::units::{Angle, Duration, Micros};
use gyronet::{Config, Coprocessor};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::synthetic::idling;
use gyronet_host_tests::wire::{id11, wheels};
use gyronet_tools::drive::wheel_frames::receiver;

/// Frames of a sample.
const SET: usize = 6;

fn at(tick: u64) -> Micros {
    Micros(tick * PERIOD_US)
}

fn fog(millisecond: u64) -> FogSample {
    let increment = [None, None, Some(Angle(1_000_000 + (millisecond * 7_919 % 1_000) as i64))];
    FogSample { time: Micros(millisecond * 1_000), span: 1_000, lost: 0, increment, temperature: None }
}

/// A parked car; whoever runs the network is up to the test.
struct Car {
    coprocessor: Coprocessor,
    noise: Noise,
    tick: u64,
    sent: Sent,
}

impl Car {
    fn new(config: Config) -> Self {
        Self { coprocessor: Coprocessor::new(config), noise: Noise::new(5), tick: 0, sent: Sent::default() }
    }

    fn sample(&mut self) -> Observation {
        let sample = idling(self.tick, 0.001, &mut self.noise);
        self.tick += 1;
        self.coprocessor.imu(sample, at(self.tick), &mut self.sent).expect("in time").expect("a step")
    }

    fn until_window(&mut self) -> DueWindow {
        loop {
            self.sample();
            if let Some(window) = self.coprocessor.window() {
                return window;
            }
        }
    }

    fn counted(&self) -> InputCounters {
        *self.coprocessor.input_counters()
    }
}

#[test]
fn a_sample_gives_its_frames_once_and_an_observation() {
    let mut car = Car::new(Config::DEFAULT);
    let observation = car.sample();
    assert_eq!(observation.sample.map(|sample| sample.time), Some(Micros(0)));
    assert_eq!(
        (observation.vehicle.live.status, observation.wheels.standstill),
        (Status::Init, Standstill::Unknown)
    );
    assert_eq!(car.sent.frames.len(), SET);
    assert!(car.sent.frames.iter().all(|frame| frame.time == Micros(0)), "stamped with the sample's time");
    assert_eq!(car.counted(), InputCounters::default());
}

#[test]
fn a_window_is_handed_out_once_and_its_estimate_is_used_two_samples_later() {
    let mut car = Car::new(Config::DEFAULT);
    let window = car.until_window();
    assert_eq!(car.coprocessor.window(), None);
    car.coprocessor.deliver(window.end, Estimate::NONE).expect("the window that is due");
    for sample in 1..=DELAY {
        let status = car.sample().vehicle.live.status;
        assert_eq!(status == Status::Ready, sample == DELAY, "{sample}");
    }
}

#[test]
fn an_estimate_for_no_window_is_an_error_and_counted() {
    let mut car = Car::new(Config::DEFAULT);
    let missing = |end| Err(InputError::NoWindow { end });
    assert_eq!(car.coprocessor.deliver(3, Estimate::NONE), missing(3), "before the first window");
    let window = car.until_window();
    assert_eq!(car.coprocessor.deliver(window.end + 1, Estimate::NONE), missing(window.end + 1));
    assert_eq!(car.coprocessor.deliver(window.end, Estimate::NONE), Ok(()));
    assert_eq!(car.coprocessor.deliver(window.end, Estimate::NONE), missing(window.end), "twice");
    let late = car.until_window();
    for _ in 0..DELAY {
        let _ = car.sample();
    }
    assert_eq!(car.coprocessor.deliver(late.end, Estimate::NONE), missing(late.end), "its turn has passed");
    assert_eq!(car.counted().unclaimed_estimates, 4);
    assert_eq!(car.coprocessor.pipeline().counters().late, 1);
    // A window that nobody takes is replaced.
    while car.counted().replaced_windows == 0 {
        car.sample();
    }
    assert_eq!(u64::from(car.coprocessor.window().expect("the newest one").end), car.tick - 1);
    assert_eq!(car.coprocessor.pipeline().counters().late, 2);
}

#[test]
fn a_sample_out_of_order_is_an_error_and_the_next_ones_report_a_gap() {
    let mut car = Car::new(Config::DEFAULT);
    for _ in 0..400 {
        let _ = car.sample();
    }
    car.sent.frames.clear();
    let old = idling(300, 0.001, &mut car.noise);
    let error = car.coprocessor.imu(old, at(car.tick), &mut car.sent).expect_err("an old one");
    let backwards = AlignError::Backwards { last: at(399), at: at(300) };
    assert_eq!(error, InputError::Imu(backwards));
    assert_eq!(car.sent.frames, [], "no frame is sent for it");
    assert_eq!(car.coprocessor.pipeline().counters().misplaced, 1);
    assert!(car.sample().vehicle.delayed.faults.contains(Faults::GAP));
    car.coprocessor.fog(fog(10), at(car.tick), &mut ()).expect("the first one");
    let again = car.coprocessor.fog(fog(10), at(car.tick), &mut ());
    assert_eq!(again, Err(InputError::Fog(ClockError::Duplicate { at: Micros(10_000) })));
    assert_eq!(car.coprocessor.fog_counters().misplaced, 1);
}

#[test]
fn a_clock_that_goes_back_is_an_error_and_followed_from_there() {
    let mut car = Car::new(Config::DEFAULT);
    for _ in 0..400 {
        let _ = car.sample();
    }
    let back = Err(InputError::ClockWentBack { by: Duration(1_000_000) });
    assert_eq!(car.coprocessor.poll(Micros(at(car.tick).0 - 1_000_000), &mut ()), back);
    assert_eq!(car.counted().clock_back, 1);
    // 20 ms later by the clock that was set back nothing is missing yet; 30 ms later the sensor is silent.
    let set_back = |ms: u64| Micros(at(400).0 - 1_000_000 + ms * 1_000);
    assert_eq!(car.coprocessor.poll(set_back(20), &mut ()), Ok(None));
    assert!(matches!(car.coprocessor.poll(set_back(30), &mut ()), Ok(Some(_))));
    for time in [0, u64::MAX, 0, u64::MAX, 7] {
        let _ = car.coprocessor.poll(Micros(time), &mut ());
        let _ = car.coprocessor.imu(idling(400, 0.001, &mut car.noise), Micros(time), &mut ());
        let _ = car.coprocessor.fog(fog(time % 1_000), Micros(time), &mut ());
        let _ = car.coprocessor.can(&wheels(0.0), Micros(time));
    }
}

/// Samples that come faster than 100 times a second wait for the estimate that they want, until it is late.
#[test]
fn the_next_sample_waits_for_the_estimate_until_it_is_late() {
    let mut car = Car::new(Config::DEFAULT);
    let window = car.until_window();
    let now = at(car.tick);
    assert!(car.coprocessor.is_ready(now), "the next sample does not want it yet");
    let early = idling(car.tick, 0.001, &mut car.noise);
    car.coprocessor.imu(early, now, &mut ()).expect("in time");
    assert!(!car.coprocessor.is_ready(now));
    assert!(!car.coprocessor.is_ready(Micros(now.0 + u64::from(DELAY) * PERIOD_US - 1)));
    let mut waited = car.coprocessor.clone();
    waited.deliver(window.end, Estimate::NONE).expect("the window that is due");
    assert!(waited.is_ready(now));
    let late = Micros(now.0 + u64::from(DELAY) * PERIOD_US);
    assert!(car.coprocessor.is_ready(late));
    // A sensor whose samples wait is not silent.
    assert_eq!(waited.poll(Micros(now.0 + TIMEOUT_US), &mut ()), Ok(None));
}

/// Standstill takes, with a clock of the board's own, half a second of that clock, with the sensor's of the samples.
#[test]
fn wheels_are_judged_by_the_clock_that_is_configured() {
    for (clock, pace) in [(Clock::Outside, 1), (Clock::Outside, 10), (Clock::Sensor, 1), (Clock::Sensor, 10)]
    {
        let mut coprocessor = Coprocessor::new(Config { wheels: Some(receiver()), clock, ..Config::DEFAULT });
        let mut noise = Noise::new(5);
        let still = (0..200).find(|tick| {
            // Samples that come at ten times their pace.
            let now = Micros(at(*tick).0 / pace);
            coprocessor.can(&wheels(0.0), now).expect("a wheel frame");
            let observation =
                coprocessor.imu(idling(*tick, 0.001, &mut noise), now, &mut ()).expect("in time");
            observation.is_some_and(|seen| seen.wheels.standstill == Standstill::Still)
        });
        let expected = if clock == Clock::Outside && pace == 10 { None } else { Some(50) };
        assert_eq!(still, expected, "{clock:?} at {pace} times the pace");
    }
}

#[test]
fn damage_and_losses_are_reported_with_every_set() {
    let storage = StorageFaults { damaged: true, configuration_lost: true };
    let mut lost = Car::new(Config { storage, ..Config::DEFAULT });
    loop {
        let window = lost.until_window();
        lost.coprocessor.deliver(window.end, Estimate::NONE).expect("the window that is due");
        let sent = lost.sample().vehicle;
        if sent.live.status == Status::Ready {
            // No rate is better than degraded with another vehicle's configuration.
            assert_eq!((sent.live.quality, sent.live.faults), (Quality::Degraded, Faults::STORED));
            break;
        }
    }
    let mut car = Car::new(Config::DEFAULT);
    assert_eq!(car.sample().vehicle.delayed.faults, Faults::NONE);
    car.coprocessor.bus(3, false);
    assert_eq!(car.sample().vehicle.delayed.faults, Faults::BUS, "lost frames are reported once");
    assert_eq!(car.sample().vehicle.delayed.faults, Faults::NONE);
    car.coprocessor.bus(3, true);
    assert_eq!(car.sample().vehicle.delayed.faults, Faults::BUS, "the controller is off the bus");
    car.coprocessor.bus(3, false);
    car.coprocessor.weights_damaged();
    for _ in 0..400 {
        assert!(car.sample().vehicle.delayed.faults.contains(Faults::STORED));
        assert_eq!(car.coprocessor.window(), None);
    }
}

#[test]
fn a_fibre_optic_gyro_sends_its_own_messages() {
    let mut car = Car::new(Config { wheels: Some(receiver()), ..Config::DEFAULT });
    let mut sent = 0;
    for millisecond in 1..6_000_u64 {
        let now = Micros(millisecond * 1_000);
        if millisecond.is_multiple_of(10) {
            car.coprocessor.can(&wheels(0.0), now).expect("a wheel frame");
            car.tick = millisecond / 10 - 1;
            car.sample();
        }
        car.coprocessor.fog(fog(millisecond), now, &mut car.sent).expect("in order");
        let own = |frame: &DataFrame| FOG_IDS.iter().any(|id| frame.id() == id11(*id));
        sent += car.sent.frames.drain(..).filter(|sent| own(&sent.frame)).count();
    }
    assert_eq!(sent, 3 * 599, "a set of three messages every 10 ms");
    let estimate = *car.sent.fog.last().expect("it was heard");
    assert_eq!(estimate.faults, Faults::NONE);
}

#[test]
fn a_fibre_optic_gyro_that_is_configured_and_never_heard_is_reported_every_10_ms() {
    let mut coprocessor = Coprocessor::new(Config { fog_expected: true, ..Config::DEFAULT });
    let mut sent = Sent::default();
    for ms in 1..1_000 {
        coprocessor.poll(Micros(ms * 1_000), &mut sent).expect("the time goes on");
    }
    let rates = sent.frames.iter().filter(|sent| sent.frame.id() == id11(FOG_IDS[0]));
    let rates: Vec<_> =
        rates.map(|sent| RateMessage::parse(sent.frame.data()).expect("a rate").quality).collect();
    assert!(rates.len() >= 95 && rates.iter().all(|rate| *rate == Quality::Unusable), "{rates:?}");
}

/// An inertial sensor, or wheels, that have fallen silent are not taken for those of the gyro's step.
#[test]
fn a_fibre_optic_gyro_does_not_use_old_wheels() {
    let mut car = Car::new(Config { wheels: Some(receiver()), ..Config::DEFAULT });
    car.coprocessor.can(&wheels(0.0), at(1)).expect("a wheel frame");
    car.sample();
    let mut silent = None;
    for millisecond in 11..400_u64 {
        let now = Micros(millisecond * 1_000);
        car.coprocessor.fog(fog(millisecond), now, &mut car.sent).expect("in order");
        let faults = car.sent.fog.last().map_or(Faults::NONE, |estimate| estimate.faults);
        silent = silent.or(faults.contains(Faults::WHEELS).then_some(millisecond));
    }
    // The last frame came at 10 ms and is good for 100 ms, though no sample of the other sensor has come since.
    assert!(silent.is_some_and(|at| (110..=135).contains(&at)), "{silent:?}");
}

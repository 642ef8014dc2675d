//! An inertial sensor and a fibre-optic gyro at 1 kHz together, and everything that can go wrong
//! with their times: each fault is counted where it belongs, flagged in its step, and over soon.

use gyronet::align::clock::ClockCounters;
use gyronet::align::increments::IncrementCounters;
use gyronet::align::resample::Quality;
use gyronet::align::streams::{Fitted, MAX_DELAY_US, Step, Streams};
use gyronet::sample::{FogSample, ImuSample, PERIOD_US, Validity};
use gyronet::units::{Angle, AngularRate, Micros, SpecificForce};
use gyronet_host_tests::noise::Noise;

/// Length of every run.
const END_US: u64 = 4_000_000;
/// The faults lie from here on.
const FAULT_US: u64 = 2_000_000;
/// The rate of the vehicle, rad/s; both parts measure it.
const RATE: f64 = 0.25;
/// The parts' clocks started elsewhere.
const IMU_EPOCH: u64 = 77_000_000_300;
const FOG_EPOCH: u64 = 5_000_700;

/// One message: when it arrives by the board's clock, and what it is.
#[derive(Clone, Copy)]
struct Arrival<T> {
    now: u64,
    sample: T,
}

/// Both streams in order of arrival, fit to be disturbed.
struct Cable {
    imu: Vec<Arrival<ImuSample>>,
    fog: Vec<Arrival<FogSample>>,
}

impl Cable {
    /// Both parts without a fault, the inertial one with this period.
    fn new(imu_period: f64) -> Self {
        let imu = |n: u64| {
            let taken = 3_700 + (n as f64 * imu_period) as u64;
            let sample = ImuSample {
                time: Micros(IMU_EPOCH + taken),
                specific_force: [SpecificForce(0); 3],
                angular_rate: [0.0, 0.0, RATE].map(|r| AngularRate::from_rad_per_sec(r as f32).unwrap()),
                temperature: None,
                validity: Validity::Good,
            };
            Arrival { now: taken + 900, sample }
        };
        let fog = |n: u64| {
            let taken = (n + 1) * 1_000;
            let increment = [None, None, Some(Angle::from_rad((RATE * 1e-3) as f32).unwrap())];
            let (time, span, lost) = (Micros(FOG_EPOCH + taken), 1_000, 0);
            let sample = FogSample { time, span, lost, increment, temperature: None };
            Arrival { now: taken + 400, sample }
        };
        let imu_count = (END_US as f64 / imu_period) as u64;
        Self { imu: (0..imu_count).map(imu).collect(), fog: (0..END_US / 1_000).map(fog).collect() }
    }

    /// Returns all steps, asked for every 100 us, and the streams.
    fn run(mut self) -> (Vec<Step>, Streams) {
        self.imu.sort_by_key(|arrival| arrival.now);
        self.fog.sort_by_key(|arrival| arrival.now);
        let mut streams = Streams::new(Fitted { imu: true, fog: true });
        let (mut imu, mut fog) = (self.imu.iter().peekable(), self.fog.iter().peekable());
        let mut steps = Vec::new();
        for now in (0..END_US).step_by(100) {
            while let Some(arrival) = imu.next_if(|arrival| arrival.now <= now) {
                // What is refused is counted.
                let _ = streams.add_imu(Micros(arrival.now), arrival.sample);
            }
            while let Some(arrival) = fog.next_if(|arrival| arrival.now <= now) {
                let _ = streams.add_fog(Micros(arrival.now), arrival.sample);
            }
            while let Some(step) = streams.next_step(Micros(now)) {
                let delay = now.saturating_sub(step.time.0);
                assert!(delay <= MAX_DELAY_US, "the step at {} us is {delay} us late", step.time.0);
                steps.push(step);
            }
        }
        assert!(steps.windows(2).all(|pair| pair[1].time.0 - pair[0].time.0 == PERIOD_US));
        (steps, streams)
    }

    fn after_fault<T>(arrivals: &mut [Arrival<T>]) -> impl Iterator<Item = &mut Arrival<T>> {
        arrivals.iter_mut().filter(|arrival| arrival.now >= FAULT_US)
    }
}

/// Steps from their time on, and whether all of them are whole and right.
fn all_good(steps: &[Step]) -> bool {
    let expected = AngularRate::from_rad_per_sec(RATE as f32).unwrap().0;
    steps.iter().all(|step| {
        step.fog.rate(2).is_some_and(|rate| rate.0.abs_diff(expected) <= 8)
            && step.imu.is_some_and(|(sample, _)| sample.angular_rate[2].0.abs_diff(expected) <= 1)
    })
}

fn between(steps: &[Step], from: u64, to: u64) -> Vec<Step> {
    steps.iter().copied().filter(|step| (from..to).contains(&step.time.0)).collect()
}

/// The first step that says so, microseconds.
fn flagged(steps: &[Step], what: impl Fn(&Step) -> bool) -> u64 {
    steps.iter().find(|step| what(step)).expect("a step is flagged").time.0
}

#[test]
fn sensors_of_any_rate_share_the_grid() {
    for (hertz, held_allowed) in [(100.0, 0), (120.0, 0), (47.0, 300)] {
        let (steps, streams) = Cable::new(1e6 / hertz).run();
        assert!(steps.len() >= 397, "{hertz} Hz: {} steps", steps.len());
        assert!(all_good(&steps[2..]), "{hertz} Hz");
        let held = steps.iter().filter(|s| matches!(s.imu, Some((_, Quality::Held { .. })))).count();
        println!("{hertz} Hz beside 1 kHz: {} steps, {held} of them held", steps.len());
        assert!(held <= held_allowed, "{hertz} Hz: {held}");
        let events = streams.events();
        let (imu, fog) = (events.imu, events.fog);
        assert_eq!(imu, ClockCounters { samples: imu.samples, ..ClockCounters::default() });
        assert_eq!(fog, ClockCounters { samples: fog.samples, ..ClockCounters::default() });
        assert_eq!(events.increments, IncrementCounters::default());
        // The reports of the steps add up to all that has been counted by then.
        let reported: u32 = steps.iter().map(|step| step.events.fog.samples).sum();
        assert!(fog.samples - reported <= 21, "{reported} of {}", fog.samples);
    }
}

#[test]
fn jitter_is_taken_out_by_the_parts_clocks() {
    let mut noise = Noise::new(11);
    let mut cable = Cable::new(10_000.0);
    // Late by up to 1.5 ms: in order still, for the gyro two messages may come at once.
    cable.imu.iter_mut().for_each(|arrival| arrival.now += noise.int(0, 1_500) as u64);
    let mut latest = 0;
    for arrival in &mut cable.fog {
        arrival.now = (arrival.now + noise.int(0, 1_500) as u64).max(latest);
        latest = arrival.now;
    }
    let (steps, streams) = cable.run();
    assert_eq!((streams.events().imu.late, streams.events().fog.late), (0, 0));
    // The clock that is found moves by some microseconds, and 10 ms with it; the angle does not.
    let settled = between(&steps, 500_000, END_US);
    let rates: Vec<f64> = settled.iter().map(|s| s.fog.rate(2).expect("whole").rad_per_sec()).collect();
    let worst = rates.iter().map(|rate| (rate / RATE - 1.0).abs()).fold(0.0, f64::max);
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    println!(
        "1.5 ms of jitter: rate of a step off by {worst:.1e} at most, mean by {:.1e}",
        mean / RATE - 1.0
    );
    assert!(worst <= 0.02 && (mean / RATE - 1.0).abs() <= 1e-4);
    assert!(settled.iter().all(|step| matches!(step.imu, Some((_, Quality::Interpolated | Quality::Exact)))));
    // Beyond 2 ms it is counted and flagged.
    let mut cable = Cable::new(10_000.0);
    for arrival in Cable::after_fault(&mut cable.imu).take(3) {
        arrival.now += 4_000;
    }
    let (steps, streams) = cable.run();
    assert_eq!(streams.events().imu.late, 3);
    let at = flagged(&steps, |step| step.events.imu.late > 0);
    assert!((FAULT_US..FAULT_US + 20_000).contains(&at), "{at}");
    assert!(all_good(&steps[2..]), "late is not wrong");
}

#[test]
fn a_gap_in_either_stream_is_marked() {
    let mut cable = Cable::new(10_000.0);
    let gap = FAULT_US..FAULT_US + 50_000;
    cable.imu.retain(|arrival| !gap.contains(&arrival.now));
    let (steps, streams) = cable.run();
    let blind = steps.iter().filter(|s| !matches!(s.imu, Some((_, Quality::Interpolated)))).count();
    assert!((3..=6).contains(&blind), "{blind} steps without a fresh sample");
    assert!(steps.iter().skip(2).all(|step| step.fog.rate(2).is_some()), "the gyro goes on");
    assert_eq!(streams.events().increments.gaps, 0);

    let mut cable = Cable::new(10_000.0);
    cable.fog.retain(|arrival| !gap.contains(&arrival.now));
    // The part's sequence number says that 50 are missing.
    let first = cable.fog.iter_mut().find(|arrival| arrival.now >= gap.end).expect("it goes on");
    first.sample.lost = 50;
    let (steps, streams) = cable.run();
    assert_eq!(streams.events().increments.gaps, 1);
    let silent: Vec<u32> = steps.iter().skip(1).map(|s| s.fog.covered).filter(|c| *c < 10_000).collect();
    assert_eq!(silent.iter().map(|covered| 10_000 - covered).sum::<u32>(), 50_000, "{silent:?}");
    assert!(steps.iter().all(|step| (step.fog.covered == 10_000) == step.fog.rate(2).is_some()));
    assert!(all_good(&between(&steps, FAULT_US + 70_000, END_US)));
}

#[test]
fn duplicates_and_disorder_in_either_stream_are_refused() {
    let mut cable = Cable::new(10_000.0);
    let again = cable.imu[200];
    cable.imu.insert(201, Arrival { now: again.now + 50, ..again });
    let again = cable.fog[2_500];
    cable.fog.insert(2_501, Arrival { now: again.now + 50, ..again });
    let (steps, streams) = cable.run();
    let events = streams.events();
    assert_eq!((events.imu.duplicates, events.fog.duplicates), (1, 1));
    assert!(flagged(&steps, |step| step.events.imu.duplicates > 0).abs_diff(2_000_000) <= 20_000);
    assert!(flagged(&steps, |step| step.events.fog.duplicates > 0).abs_diff(2_500_000) <= 20_000);
    assert!(all_good(&steps[2..]), "a duplicate is not used twice");

    let mut cable = Cable::new(10_000.0);
    cable.imu[200].now = cable.imu[201].now + 50;
    cable.fog[2_500].now = cable.fog[2_501].now + 50;
    let (steps, streams) = cable.run();
    let events = streams.events();
    assert_eq!((events.imu.out_of_order, events.fog.out_of_order), (1, 1));
    assert!(flagged(&steps, |step| step.events.imu.out_of_order > 0).abs_diff(2_010_000) <= 20_000);
    assert!(flagged(&steps, |step| step.events.fog.out_of_order > 0).abs_diff(2_500_000) <= 20_000);
    // What came too late is missing, and its step says so.
    let short: Vec<u32> = steps.iter().map(|step| step.fog.covered).filter(|c| *c < 10_000).skip(1).collect();
    assert_eq!((short, events.increments.gaps), (vec![9_000], 1));
    let fresh: Vec<Step> = steps.iter().skip(2).copied().filter(|step| step.fog.covered == 10_000).collect();
    assert!(all_good(&fresh));
}

#[test]
fn a_clock_that_jumps_is_followed_in_either_stream() {
    for by in [-3_000_000i64, 500_000, 40_000_000] {
        let mut cable = Cable::new(10_000.0);
        for arrival in Cable::after_fault(&mut cable.imu) {
            arrival.sample.time.0 = arrival.sample.time.0.wrapping_add_signed(by);
        }
        let (steps, streams) = cable.run();
        assert_eq!((streams.events().imu.jumps, streams.events().fog.jumps), (1, 0), "by {by} us");
        assert!(flagged(&steps, |step| step.events.imu.jumps > 0).abs_diff(FAULT_US) <= 20_000);
        assert!(all_good(&between(&steps, FAULT_US + 40_000, END_US)), "by {by} us");

        let mut cable = Cable::new(10_000.0);
        for arrival in Cable::after_fault(&mut cable.fog) {
            arrival.sample.time.0 = arrival.sample.time.0.wrapping_add_signed(by);
        }
        let (steps, streams) = cable.run();
        assert_eq!((streams.events().imu.jumps, streams.events().fog.jumps), (0, 1), "by {by} us");
        assert!(flagged(&steps, |step| step.events.fog.jumps > 0).abs_diff(FAULT_US) <= 20_000);
        assert!(all_good(&between(&steps, FAULT_US + 40_000, END_US)), "by {by} us");
    }
}

#[test]
fn everything_at_once_and_no_step_too_late() {
    let mut noise = Noise::new(5);
    let mut cable = Cable::new(1e6 / 120.0);
    for arrival in &mut cable.imu {
        arrival.now += noise.int(0, 30_000) as u64 / (1 + noise.int(0, 9) as u64);
    }
    for arrival in &mut cable.fog {
        arrival.now += noise.int(0, 9_000) as u64 / (1 + noise.int(0, 9) as u64);
    }
    cable.imu.retain(|_| noise.int(0, 19) > 0);
    cable.fog.retain(|_| noise.int(0, 99) > 0);
    let (steps, streams) = cable.run();
    let events = streams.events();
    println!("delay of a step: {MAX_DELAY_US} us at most, as asserted for each; {events:?}");
    assert!(steps.len() >= 397 && events.imu.out_of_order > 0 && events.fog.out_of_order > 0);
    // A rate is right or not there.
    let expected = AngularRate::from_rad_per_sec(RATE as f32).unwrap().0;
    for step in steps.iter().skip(2) {
        if let Some((sample, _)) = step.imu {
            assert!(sample.angular_rate[2].0.abs_diff(expected) <= 1);
        }
    }
}

//! A fibre-optic gyro at 1 kHz, and everything that can go wrong with its times: each fault is counted where it
//! belongs, while its step is emitted, and over soon.

use gyronet::align::clock::ClockCounters;
use gyronet::align::fog_grid::{FogGrid, MAX_DELAY_US, Step};
use gyronet::sample::{FogSample, PERIOD_US};
use gyronet::units::{Angle, AngularRate, Micros};
use gyronet_host_tests::noise::Noise;

/// Length of every run.
const END_US: u64 = 4_000_000;
/// The faults lie from here on.
const FAULT_US: u64 = 2_000_000;
/// The rate of the vehicle, rad/s.
const RATE: f64 = 0.25;
/// The part's clock started elsewhere.
const EPOCH: u64 = 5_000_700;

/// One message: when it arrives by the board's clock, and what it is.
#[derive(Clone, Copy)]
struct Arrival {
    now: u64,
    sample: FogSample,
}

/// The messages in order of arrival, fit to be disturbed.
struct Cable(Vec<Arrival>);

/// All steps with the clock's events up to each, and the grid at the end.
struct Run {
    steps: Vec<Step>,
    events: Vec<ClockCounters>,
    grid: FogGrid,
}

impl Cable {
    fn new() -> Self {
        let arrival = |n: u64| {
            let taken = (n + 1) * 1_000;
            let increment = [None, None, Some(Angle::from_rad((RATE * 1e-3) as f32).unwrap())];
            let (time, span, lost) = (Micros(EPOCH + taken), 1_000, 0);
            let sample = FogSample { time, span, lost, increment, temperature: None };
            Arrival { now: taken + 400, sample }
        };
        Self((0..END_US / 1_000).map(arrival).collect())
    }

    /// Returns what the grid makes of it, asked for steps every 100 us.
    fn run(mut self) -> Run {
        self.0.sort_by_key(|arrival| arrival.now);
        let mut grid = FogGrid::new(false);
        let mut arrivals = self.0.iter().peekable();
        let (mut steps, mut events) = (Vec::new(), Vec::new());
        for now in (0..END_US).step_by(100) {
            while let Some(arrival) = arrivals.next_if(|arrival| arrival.now <= now) {
                // What is refused is counted.
                let _ = grid.add(Micros(arrival.now), arrival.sample);
            }
            while let Some(step) = grid.next_step(Micros(now)) {
                let delay = now.saturating_sub(step.time.0);
                assert!(delay <= MAX_DELAY_US, "the step at {} us is {delay} us late", step.time.0);
                steps.push(step);
                events.push(*grid.clock());
            }
        }
        assert!(steps.windows(2).all(|pair| pair[1].time.0 - pair[0].time.0 == PERIOD_US));
        Run { steps, events, grid }
    }

    fn after_fault(&mut self) -> impl Iterator<Item = &mut Arrival> {
        self.0.iter_mut().filter(|arrival| arrival.now >= FAULT_US)
    }
}

impl Run {
    /// The time of the first step by which the clock has counted such an event, microseconds.
    fn counted(&self, what: impl Fn(&ClockCounters) -> u32) -> u64 {
        let found = self.steps.iter().zip(&self.events).find(|(_, events)| what(events) > 0);
        found.expect("an event is counted").0.time.0
    }
}

fn expected() -> i32 {
    AngularRate::from_rad_per_sec(RATE as f32).unwrap().0
}

/// True if all steps are whole and right.
fn all_good(steps: &[Step]) -> bool {
    steps.iter().all(|step| step.turn.rate(2).is_some_and(|rate| rate.0.abs_diff(expected()) <= 8))
}

fn between(steps: &[Step], from: u64, to: u64) -> Vec<Step> {
    steps.iter().copied().filter(|step| (from..to).contains(&step.time.0)).collect()
}

#[test]
fn jitter_is_taken_out_by_the_parts_clock() {
    let mut noise = Noise::new(11);
    let mut cable = Cable::new();
    // Late by up to 1.5 ms: two messages may come at once, in order still.
    let mut latest = 0;
    for arrival in &mut cable.0 {
        arrival.now = (arrival.now + noise.int(0, 1_500) as u64).max(latest);
        latest = arrival.now;
    }
    let run = cable.run();
    assert_eq!(run.grid.clock().late, 0);
    // The clock that is found moves by some microseconds, and 10 ms with it; the angle does not.
    let settled = between(&run.steps, 500_000, END_US);
    let rates: Vec<f64> = settled.iter().map(|s| s.turn.rate(2).expect("whole").rad_per_sec()).collect();
    let worst = rates.iter().map(|rate| (rate / RATE - 1.0).abs()).fold(0.0, f64::max);
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    println!(
        "1.5 ms of jitter: rate of a step off by {worst:.1e} at most, mean by {:.1e}",
        mean / RATE - 1.0
    );
    assert!(worst <= 0.02 && (mean / RATE - 1.0).abs() <= 1e-4);
    // Beyond 2 ms it is counted.
    let mut cable = Cable::new();
    for arrival in cable.after_fault() {
        arrival.now = arrival.now.max(FAULT_US + 4_900);
    }
    let run = cable.run();
    assert_eq!(run.grid.clock().late, 3);
    let at = run.counted(|events| events.late);
    assert!((FAULT_US..FAULT_US + 20_000).contains(&at), "{at}");
    let off = |step: &Step| (step.turn.rate(2).expect("whole").rad_per_sec() / RATE - 1.0).abs();
    assert!(run.steps[2..].iter().all(|step| off(step) <= 1e-3), "late is not wrong");
}

#[test]
fn a_gap_is_marked() {
    let mut cable = Cable::new();
    let gap = FAULT_US..FAULT_US + 50_000;
    cable.0.retain(|arrival| !gap.contains(&arrival.now));
    // The part's sequence number says that 50 are missing.
    let first = cable.0.iter_mut().find(|arrival| arrival.now >= gap.end).expect("it goes on");
    first.sample.lost = 50;
    let Run { steps, grid, .. } = cable.run();
    assert_eq!(grid.increments().gaps, 1);
    let silent: Vec<u32> = steps.iter().skip(1).map(|s| s.turn.covered).filter(|c| *c < 10_000).collect();
    assert_eq!(silent.iter().map(|covered| 10_000 - covered).sum::<u32>(), 50_000, "{silent:?}");
    assert!(steps.iter().all(|step| (step.turn.covered == 10_000) == step.turn.rate(2).is_some()));
    assert!(all_good(&between(&steps, FAULT_US + 70_000, END_US)));
}

#[test]
fn duplicates_and_disorder_are_refused() {
    let mut cable = Cable::new();
    let again = cable.0[2_500];
    cable.0.insert(2_501, Arrival { now: again.now + 50, ..again });
    let run = cable.run();
    assert_eq!(run.grid.clock().duplicates, 1);
    assert!(run.counted(|events| events.duplicates).abs_diff(2_500_000) <= 20_000);
    assert!(all_good(&run.steps[2..]), "a duplicate is not used twice");

    let mut cable = Cable::new();
    cable.0[2_500].now = cable.0[2_501].now + 50;
    let run = cable.run();
    assert_eq!(run.grid.clock().out_of_order, 1);
    assert!(run.counted(|events| events.out_of_order).abs_diff(2_500_000) <= 20_000);
    // What came too late is missing, and its step says so.
    let steps = &run.steps;
    let short: Vec<u32> =
        steps.iter().map(|step| step.turn.covered).filter(|c| *c < 10_000).skip(1).collect();
    assert_eq!((short, run.grid.increments().gaps), (vec![9_000], 1));
    let fresh: Vec<Step> = steps.iter().skip(2).copied().filter(|step| step.turn.covered == 10_000).collect();
    assert!(all_good(&fresh));
}

#[test]
fn a_clock_that_jumps_is_followed() {
    for by in [-3_000_000i64, 500_000, 40_000_000] {
        let mut cable = Cable::new();
        for arrival in cable.after_fault() {
            arrival.sample.time.0 = arrival.sample.time.0.wrapping_add_signed(by);
        }
        let run = cable.run();
        assert_eq!(run.grid.clock().jumps, 1, "by {by} us");
        assert!(run.counted(|events| events.jumps).abs_diff(FAULT_US) <= 20_000);
        assert!(all_good(&between(&run.steps, FAULT_US + 40_000, END_US)), "by {by} us");
    }
}

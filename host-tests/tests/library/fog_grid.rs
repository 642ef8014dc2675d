//! A fibre-optic gyro with its own clock on the board's grid: sums, gaps, duplicates, jumps, order.

use gyronet::align::clock::{BoardTime, ClockError, JUMP_US, PartClock};
use gyronet::align::fog_grid::{FogGrid, MAX_DELAY_US, MAX_SILENCE_US, Step};
use gyronet::align::increments::Increments;
use gyronet::sample::{FogSample, PERIOD_US};
use gyronet::units::{Angle, Micros};
use proptest::prelude::*;

fn fog(stamp: u64, angle: i64) -> FogSample {
    let increment = [None, None, Some(Angle(angle))];
    FogSample { time: Micros(stamp), span: 1_000, lost: 0, increment, temperature: None }
}

fn drain(grid: &mut FogGrid, now: u64) -> Vec<Step> {
    std::iter::from_fn(|| grid.next_step(Micros(now))).collect()
}

#[test]
fn increments_are_neither_lost_nor_made_up() {
    for phase in [0, 1, 300, 999] {
        let mut grid = FogGrid::new(false);
        let mut steps = Vec::new();
        for n in 1..=2_000u64 {
            let angle = (n * n % 1_000_003) as i64 * 1_000_001 - 500_000_000_000;
            let now = n * 1_000 + phase;
            // A part whose own clock started elsewhere.
            grid.add(Micros(now), fog(77_000_000 + n * 1_000, angle)).expect("in order");
            steps.extend(drain(&mut grid, now));
        }
        let sum: i64 = steps.iter().map(|step| step.turn.angle[2].expect("good").0).sum();
        assert!(steps[1..].iter().all(|step| step.turn.covered == 10_000), "phase {phase}");
        // Off phase, the last millisecond's increment is still partly the next step's.
        if phase == 0 {
            let all = (1..=2_000u64).map(|n| (n * n % 1_000_003) as i64 * 1_000_001 - 500_000_000_000);
            assert_eq!(sum, all.sum::<i64>());
        }
    }
}

proptest! {
    /// An increment that straddles a grid step is split there in proportion to time, rounded towards
    /// zero, whatever its size; the second part is what is left of it.
    #[test]
    fn an_increment_is_split_in_proportion(
        angle in prop_oneof![any::<i64>(), Just(i64::MIN + 1), Just(i64::MAX), -1_000_000..1_000_000_i64],
        span in 2..=PERIOD_US as u32,
        part in any::<prop::sample::Index>(),
    ) {
        let before = 1 + part.index(span as usize - 1) as u64;
        let step = 10 * PERIOD_US;
        let mut increments = Increments::default();
        let end = Micros(step - before + u64::from(span));
        increments.add(end, &FogSample { span, ..fog(end.0, angle) });
        let first = (i128::from(angle) * i128::from(before) / i128::from(span)) as i64;
        let [_, _, taken] = increments.take(Micros(step)).angle;
        prop_assert_eq!(taken, Some(Angle(first)));
        let [_, _, rest] = increments.take(Micros(step + PERIOD_US)).angle;
        prop_assert_eq!(rest, Some(Angle(angle - first)));
    }
}

/// Ends jitter by less than half a span; where one is lost or later than that, its time stays uncovered.
#[test]
fn an_increment_begins_where_the_one_before_ended() {
    for (lost, late, covered) in [(0, 0, 10_000), (0, 450, 10_000), (0, 600, 9_400), (1, 450, 9_550)] {
        let mut increments = Increments::default();
        for n in 1..=11u64 {
            let end = Micros(n * 1_000 + if n >= 5 { late } else { 0 });
            increments.add(end, &FogSample { lost: if n == 5 { lost } else { 0 }, ..fog(end.0, 1_000) });
        }
        assert_eq!(increments.take(Micros(PERIOD_US)).covered, covered, "{lost} lost, {late} us late");
    }
}

#[test]
fn an_increment_after_a_jump_covers_its_own_span() {
    let mut grid = FogGrid::new(false);
    assert!(!grid.is_running());
    grid.add(Micros(5_000), fog(5_000, 1)).expect("the first");
    assert!(grid.is_running() && !grid.is_due(Micros(19_999)));
    grid.add(Micros(6_400), fog(900_000, 1)).expect("its clock has jumped");
    let covered: Vec<u32> = drain(&mut grid, 20_000).iter().map(|step| step.turn.covered).collect();
    assert_eq!(covered, [2_000]);
}

#[test]
fn no_step_is_later_than_ten_milliseconds() {
    // The gyro is silent for every other 100 ms.
    let mut grid = FogGrid::new(false);
    let (mut steps, mut worst) = (Vec::new(), 0);
    for now in (0..2_000_000u64).step_by(100) {
        if now % 1_000 == 300 && now / 100_000 % 2 == 0 {
            grid.add(Micros(now), fog(now, 5)).expect("in order");
        }
        for step in drain(&mut grid, now) {
            worst = worst.max(now.saturating_sub(step.time.0));
            steps.push(step);
        }
    }
    println!("latest step {worst} us after its time");
    assert!(worst <= MAX_DELAY_US);
    assert!(steps.windows(2).all(|pair| pair[1].time.0 - pair[0].time.0 == PERIOD_US));
    assert!(steps.len() >= 198);
}

#[test]
fn events_of_a_clock_are_reported() {
    let mut clock = PartClock::default();
    let mut at = |stamp, arrival| clock.translate(Micros(stamp), Micros(arrival));
    let board = |time, jumped| Ok(BoardTime { time: Micros(time), jumped });
    // The first arrival was 3 ms late, as the second shows; the third is 5 ms late.
    assert_eq!(at(910_000, 503_000), board(503_000, false));
    assert_eq!(at(920_000, 510_000), board(510_000, false));
    assert_eq!(at(930_000, 525_000), board(520_002, false));
    assert_eq!(at(930_000, 526_000), Err(ClockError::Duplicate { at: Micros(930_000) }));
    let (last, early) = (Micros(930_000), Micros(929_000));
    assert_eq!(at(929_000, 527_000), Err(ClockError::OutOfOrder { last, at: early }));
    // The part restarts; then its messages are held up, for longer than any jitter the second time.
    assert_eq!(at(0, 530_000), board(530_000, true));
    assert_eq!(at(10_000, 540_000 + JUMP_US), board(540_002, false));
    assert_eq!(at(20_000, 560_000 + 2 * JUMP_US), board(560_000 + 2 * JUMP_US, true));
}

#[test]
fn a_small_jump_is_found_within_a_second() {
    let mut clock = PartClock::default();
    for n in 0..300u64 {
        // From the hundredth sample on the stamps are 40 ms behind.
        let stamp = 1_000_000 + n * 10_000 - if n >= 100 { 40_000 } else { 0 };
        let board = clock.translate(Micros(stamp), Micros(n * 10_000));
        let Ok(board) = board else {
            assert!((100..=104).contains(&n), "sample {n}");
            continue;
        };
        assert_eq!(board.jumped, n == 201, "sample {n}");
        assert!(board.time.0.abs_diff(n * 10_000) < 10 || (100..201).contains(&n), "sample {n}");
    }
    // Silence is not lateness.
    assert!(!clock.translate(Micros(13_950_000), Micros(12_995_000)).expect("in order").jumped);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever comes, steps ascend by 10 ms but for restarts, and nothing panics.
    #[test]
    fn any_times_are_survived(
        events in prop::collection::vec((0..30_000u64, -200_000..200_000i64, 0..4u8), 0..300),
        wild in any::<Option<u64>>(),
        pauses in prop::collection::vec(any::<prop::sample::Index>(), 0..3),
    ) {
        let mut grid = FogGrid::new(false);
        let pauses: Vec<usize> = pauses.iter().map(|pause| pause.index(events.len().max(1))).collect();
        let (mut now, mut last) = (1_000_000u64, None);
        for (n, (passed, off, kind)) in events.into_iter().enumerate() {
            // After a second without a call the grid restarts.
            let pause = if pauses.contains(&n) { 2 * MAX_SILENCE_US } else { 0 };
            now += passed + pause;
            let stamp = match kind {
                0 => wild.unwrap_or(now),
                1 => now.wrapping_add_signed(off),
                _ => now,
            };
            let _ = grid.add(Micros(now), FogSample { span: passed as u32, ..fog(stamp, i64::MAX) });
            for step in drain(&mut grid, now) {
                prop_assert!(last.is_none_or(|last| step.time.0 == last + PERIOD_US));
                prop_assert!(u64::from(step.turn.covered) <= PERIOD_US);
                last = Some(step.time.0);
            }
            if pause > 0 {
                last = None;
            }
        }
    }
}

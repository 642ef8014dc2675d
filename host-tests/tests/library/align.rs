//! Time stamps on the 100 Hz grid: every rule of the module, and no way to get stuck.

use gyronet::align::{AlignError, Aligner, MAX_GAP, TOLERANCE_US};
use gyronet::sample::PERIOD_US;
use gyronet::units::{AngularRate, Micros};
use gyronet_host_tests::noise::{Noise, cases};
use gyronet_host_tests::synthetic::turning;
use proptest::prelude::*;

/// Tick and missing steps of a sample at this time, or why it has no place.
fn place(aligner: &mut Aligner, time: u64) -> Result<(u32, u32), AlignError> {
    let mut sample = turning(0, AngularRate(7));
    sample.time = Micros(time);
    aligner
        .align(sample)
        .inspect(|frame| assert_eq!(frame.sample, sample))
        .map(|frame| (frame.tick, frame.missing))
}

/// An aligner whose last sample was tick 0 at this time.
fn begun(time: u64) -> Aligner {
    let mut aligner = Aligner::default();
    assert_eq!(place(&mut aligner, time), Ok((0, 0)));
    aligner
}

#[test]
fn a_clock_slow_or_fast_by_three_percent_stays_in_step() {
    for period in [9_700, PERIOD_US, 10_300] {
        let mut aligner = begun(0);
        for tick in 1..60_000 {
            assert_eq!(place(&mut aligner, u64::from(tick) * period), Ok((tick, 0)), "{period} us");
        }
    }
}

#[test]
fn jitter_within_the_tolerance_changes_no_step() {
    // Half the tolerance each: two neighbours may err in opposite ways.
    let half = TOLERANCE_US as i64 / 2;
    let mut noise = Noise::new(4);
    let mut aligner = begun(1_000_000);
    for tick in 1..10_000 {
        let time = 1_000_000 + i64::from(tick) * PERIOD_US as i64 + noise.int(-half, half);
        assert_eq!(place(&mut aligner, time as u64), Ok((tick, 0)));
    }
}

#[test]
fn a_sample_beyond_the_tolerance_is_off_the_grid() {
    let off = |time| AlignError::OffGrid { last: Micros(50_000), at: Micros(time) };
    for steps in [1, 2, 7, 101] {
        let exact = 50_000 + steps * PERIOD_US;
        for time in [exact - TOLERANCE_US, exact + TOLERANCE_US] {
            assert_eq!(place(&mut begun(50_000), time), Ok((steps as u32, steps as u32 - 1)));
        }
        for time in [exact - TOLERANCE_US - 1, exact + TOLERANCE_US + 1] {
            assert_eq!(place(&mut begun(50_000), time), Err(off(time)));
        }
    }
    assert_eq!(place(&mut begun(50_000), 50_001), Err(off(50_001)));
    assert_eq!(
        off(55_000).to_string(),
        "time stamp 55000 us, 5000 us after the last one, fits no 100 Hz step"
    );
}

#[test]
fn gaps_are_counted_up_to_a_second() {
    for missing in 0..=u64::from(MAX_GAP) {
        let mut aligner = begun(0);
        let tick = missing as u32 + 1;
        assert_eq!(place(&mut aligner, (missing + 1) * PERIOD_US), Ok((tick, missing as u32)));
        assert_eq!(place(&mut aligner, (missing + 2) * PERIOD_US), Ok((tick + 1, 0)));
    }
}

#[test]
fn duplicates_and_steps_back_leave_the_grid() {
    let mut aligner = begun(2_000_000);
    let mut other = turning(0, AngularRate(8));
    other.time = Micros(2_000_000);
    let (last, at) = (Micros(2_000_000), Micros(1_990_000));
    assert_eq!(place(&mut aligner, 2_000_000), Err(AlignError::Duplicate { at: last }));
    // A clock that was set back by 10 ms.
    assert_eq!(aligner.align(other), Err(AlignError::OffGrid { last, at: last }));
    assert_eq!(place(&mut aligner, 2_000_000), Err(AlignError::Duplicate { at: last }));
    assert_eq!(place(&mut aligner, 1_990_000), Err(AlignError::Backwards { last, at }));
    assert_eq!(place(&mut aligner, 1_000_000), Err(AlignError::Backwards { last, at: Micros(1_000_000) }));
    assert_eq!(place(&mut aligner, 2_004_000), Err(AlignError::OffGrid { last, at: Micros(2_004_000) }));
    assert_eq!(place(&mut aligner, 2_010_000), Ok((1, 0)));
    let text = |error: AlignError| error.to_string();
    assert_eq!(text(AlignError::Duplicate { at }), "duplicate sample at 1990000 us");
    assert_eq!(text(AlignError::Backwards { last, at }), "time goes backwards, from 2000000 to 1990000 us");
}

#[test]
fn a_jump_starts_a_new_grid() {
    for to in [0, 1, 3_999_999, 6_020_000, 100_000_000, u64::MAX / 2, u64::MAX - 20_000, u64::MAX] {
        let mut aligner = begun(4_000_000 + 1_000_000);
        let error = AlignError::Jump { last: Micros(5_000_000), at: Micros(to) };
        assert_eq!(place(&mut aligner, to), Err(error));
        assert_eq!(error.to_string(), format!("time jumps from 5000000 to {to} us, more than 1 s"));
        if let Some(next) = to.checked_add(PERIOD_US) {
            assert_eq!(place(&mut aligner, next), Ok((1, 0)), "after a jump to {to}");
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    #[test]
    fn a_regular_stream_is_taken_up_again_within_two_seconds(
        before in prop::collection::vec(0u64..10_000_000, 1..20),
        start in 0u64..10_000_000,
        period in 9_700u64..=10_300,
    ) {
        let mut aligner = Aligner::default();
        for time in before {
            let _ = place(&mut aligner, time);
        }
        // At worst it begins a second before the last sample and then lies between the steps
        // for another second, until the jump; at 9.7 ms a sample that is 209 of them.
        let stream: Vec<bool> = (0..400).map(|k| place(&mut aligner, start + k * period).is_ok()).collect();
        prop_assert!(stream[209..].iter().all(|taken| *taken), "{:?}", stream);
    }
}

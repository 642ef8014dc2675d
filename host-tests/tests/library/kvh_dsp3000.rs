//! KVH DSP-3000: lines of text and binary words.

use gyronet::sensor::dsp3000::ascii::{Dsp3000Ascii, LineError, Reading};
use gyronet::sensor::dsp3000::binary::{
    ANGLE_LSB, Dsp3000Binary, INCREMENT_LSB, LOCK, RATE_LSB, Word, WordError,
};
use gyronet::sensor::dsp3000::{Command, Mode};
use gyronet::units::Micros;
use proptest::prelude::*;

fn rate(value: i32) -> Word {
    Word { valid: true, sync: 0, mode: Mode::Rate, value }
}

#[test]
fn words_are_read_and_written() {
    for (bytes, value) in [([0x80, 0x02, 0x8B, 0x0B], 166_667), ([0x87, 0xFD, 0x74, 0xF5], -166_667)] {
        let word = Word::parse(bytes).expect("odd parity");
        assert_eq!(word, rate(value));
        assert_eq!(word.emit(), bytes);
        // 10 deg/s to half a bit.
        assert!((word.degrees().abs() - 10.0).abs() < 30e-6, "{}", word.degrees());
    }
    // 60 and 6 millionths; 360 deg in 23 bits.
    assert_eq!((RATE_LSB, INCREMENT_LSB), (60e-6, 6e-6));
    assert!((ANGLE_LSB - 42.915_34e-6).abs() < 5e-12);
    let turn = Word { mode: Mode::Integrated, ..rate(1 << 23 | 1 << 22) };
    assert!((turn.degrees() - 540.0).abs() < 1e-9);
    let increment = Word { mode: Mode::Incremental, ..rate(-1_000_000) };
    assert!((increment.degrees() + 6.0).abs() < 1e-9);
    assert_eq!(Word::parse([0x80, 0x02, 0x8B, 0x0A]), Err(WordError::Parity { word: 0x8002_8B0A }));
    assert_eq!(Word::parse([0x9C, 0, 0, 0]), Err(WordError::Parity { word: 0x9C00_0000 }));
    assert_eq!(Word::parse([0x98, 0, 0, 0]), Err(WordError::Type { word: 0x9800_0000 }));
}

/// Returns the values that come out when one byte of 200 words is lost, with and without pauses.
fn with_a_byte_lost(lost: usize, pauses: bool) -> (Vec<i32>, Vec<i32>) {
    let values: Vec<i32> = (0..200).map(|n| 166_667 - 37 * n).collect();
    let mut part = Dsp3000Binary::new(Mode::Rate, 0);
    let mut got = Vec::new();
    for (n, value) in values.iter().enumerate() {
        let bytes = rate(*value).emit();
        let sent = bytes.iter().enumerate().filter(|(k, _)| 4 * n + k != lost);
        got.extend(sent.filter_map(|(_, byte)| part.receive(*byte)).map(|word| word.value));
        if pauses {
            part.pause();
        }
    }
    assert!(part.losses() <= 1, "byte {lost}");
    (values, got)
}

#[test]
fn a_lost_byte_costs_few_words() {
    for lost in 400..440 {
        let (values, got) = with_a_byte_lost(lost, true);
        assert!(got.iter().all(|value| values.contains(value)), "byte {lost}: a wrong value");
        // The words before the first lock, the damaged one, and those before the next lock.
        assert_eq!(got.len(), values.len() - 2 * (usize::from(LOCK) - 1) - 1, "byte {lost}");
        let (values, got) = with_a_byte_lost(lost, false);
        // Parity alone lets wrong values through, but the stream comes back.
        let good = got.iter().filter(|value| values.contains(value)).count();
        assert!(good >= values.len() - 16, "byte {lost}: {good} good values");
    }
}

#[test]
fn words_of_another_kind_are_no_readings() {
    for (mode, sync) in [(Mode::Incremental, 0), (Mode::Rate, 1)] {
        let mut part = Dsp3000Binary::new(Mode::Rate, 0);
        let words = (0..200).map(|n| Word { mode, sync, ..rate(166_667 - 37 * n) });
        let readings = words.flat_map(|word| word.emit()).filter_map(|byte| part.receive(byte));
        // In another phase some may look as if they were.
        for word in readings {
            assert_eq!((word.mode, word.sync), (Mode::Rate, 0));
        }
    }
}

#[test]
fn readings_become_samples() {
    let expected = 0.1f64.to_radians();
    let word = rate(166_667).sample(Micros(5), 10_000).expect("a rate");
    let line = Reading { millionths: 100_000, valid: true };
    let line = line.sample(Mode::Incremental, Micros(5), 10_000).expect("an increment");
    for sample in [word, line] {
        assert_eq!((sample.time, sample.span, sample.increment[0]), (Micros(5), 10_000, None));
        assert!((sample.increment[2].expect("valid").rad() / expected - 1.0).abs() < 3e-6);
    }
    let fault = Word { valid: false, ..rate(1) }.sample(Micros(5), 1_000).expect("a rate");
    assert_eq!(fault.increment, [None; 3]);
    assert_eq!(Word { mode: Mode::Integrated, ..rate(1) }.sample(Micros(5), 1_000), None);
}

fn lines(text: &[u8]) -> Vec<Result<Reading, LineError>> {
    let mut part = Dsp3000Ascii::new();
    text.iter().filter_map(|byte| part.receive(*byte)).collect()
}

#[test]
fn lines_are_read_and_written() {
    let good = |millionths, valid| Ok(Reading { millionths, valid });
    assert_eq!(
        lines(b"   10.000000  1\r\n  -0.000123 0\r\n\r\n359.999999 1 \r\n-12.500000\t1\n"),
        [good(10_000_000, true), good(-123, false), good(359_999_999, true), good(-12_500_000, true)]
    );
    let bad = ["10.00000 1", "10.000000", "10.0000001", "1234.000000 1", ".000000 1", "1O.000000 1"];
    for line in bad.iter().chain(&["10.000000 2", "--1.000000 1", "1", "+1.000000 1", "1.0 0000 1"]) {
        assert_eq!(lines(format!("{line}\r\n").as_bytes()), [Err(LineError::Form)], "{line}");
    }
    let long = [&[b' '; 40], &b"1.000000 1\r\n2.000000 1\r\n"[..]].concat();
    assert_eq!(lines(&long), [Err(LineError::TooLong), good(2_000_000, true)]);
}

#[test]
fn commands_equal_those_of_the_manual() {
    for letter in 0..=255u8 {
        assert_eq!(Command::parse(letter).map(Command::emit), b"RAPZ".contains(&letter).then_some(letter));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn round_trips(
        valid: bool,
        sync in 0..4u8,
        mode in prop_oneof![Just(Mode::Rate), Just(Mode::Incremental), Just(Mode::Integrated)],
        value in -(1 << 25)..(1 << 25),
        millionths in -999_999_999..=999_999_999i32,
    ) {
        let word = Word { valid, sync, mode, value };
        prop_assert_eq!(Word::parse(word.emit()), Ok(word));
        // Parity finds every single flipped bit.
        for bit in 0..32 {
            let damaged = u32::from_be_bytes(word.emit()) ^ 1 << bit;
            let refused = matches!(Word::parse(damaged.to_be_bytes()), Err(WordError::Parity { .. }));
            prop_assert!(refused);
        }
        let reading = Reading { millionths, valid };
        prop_assert_eq!(lines(reading.emit().as_bytes()), [Ok(reading)]);
    }
}

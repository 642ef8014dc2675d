//! Any bytes: as lines, as words.
#![no_main]

use gyronet::sensor::dsp3000::Mode;
use gyronet::sensor::dsp3000::ascii::{Dsp3000Ascii, Reading};
use gyronet::sensor::dsp3000::binary::{Dsp3000Binary, Word};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut lines = Dsp3000Ascii::new();
    let mut words = Dsp3000Binary::new(Mode::Rate, 0);
    for byte in data {
        if let Some(Ok(reading)) = lines.push(*byte) {
            let line = reading.emit();
            assert_eq!(Reading::parse(line.trim_end().as_bytes()), Ok(reading));
        }
        if let Some(word) = words.push(*byte) {
            assert_eq!(Word::parse(word.emit()), Ok(word));
        }
    }
});

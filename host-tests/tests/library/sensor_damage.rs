//! Every truncation and every flipped bit of the frames whose own tests do not try it: the
//! built-in-test messages, and the kinds without a checksum, for which the tests say what
//! is found out and what is not. MTData2 has its own in `xsens_formats` and `xsens_stream`, the
//! DSP-1760's data messages in `kvh_dsp1760`, the DSP-3000's words in `kvh_dsp3000`, the ADIS burst
//! in `adis16465`.

use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::sensor::dsp3000::ascii::{Dsp3000Ascii, LineError, Reading};
use gyronet::sensor::icm42688::packet::{Packet, PacketError, Resolution};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::wire::feed;

/// Returns all copies of some bytes with one bit flipped.
fn flips(bytes: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    (0..bytes.len() * 8).map(|bit| {
        let mut damaged = bytes.to_vec();
        damaged[bit / 8] ^= 1 << (bit % 8);
        damaged
    })
}

fn data_message() -> Vec<u8> {
    let message = Message {
        rotation: [1e-6, -2e-6, 3e-6],
        acceleration: [0.0; 3],
        extra: Extra::Temperature(25),
        validity: Validity::GYRO,
        sequence: 7,
    };
    message.emit().to_vec()
}

/// Samples that a DSP-1760 gives for these bytes.
fn samples(bytes: &[u8]) -> usize {
    feed(&mut Dsp1760::new(Dsp1760Config::DEFAULT), bytes).len()
}

/// Damaged as they may be, they give no sample and take none away.
#[test]
fn damaged_built_in_test_messages_take_no_sample_away() {
    let data = data_message();
    for message in
        [&b"\xFE\x81\x00\xAA\x7F\x01\x40\x00\x2A\x15\x55"[..], b"\xFE\x81\x00\xAB\x7F\x01\0\0\0\0\0\x7F\x55"]
    {
        for length in 0..=message.len() {
            assert_eq!(samples(&message[..length]), 0);
            assert_eq!(samples(&[&message[..length], &data].concat()), 1, "{length} bytes");
        }
        for damaged in flips(message) {
            assert_eq!(samples(&damaged), 0);
            assert_eq!(samples(&[&damaged[..], &data].concat()), 1, "{damaged:02x?}");
        }
    }
}

/// Lines of text without a checksum, but of few words: a flipped bit makes another rate of the same
/// list, another case of a letter (which means the same), or nothing.
#[test]
fn a_flipped_bit_of_an_icm42688_packet_breaks_its_header_or_changes_a_value() {
    let narrow = Packet {
        resolution: Resolution::Bits16,
        acceleration: [12, -40, 2048].map(Some),
        rate: [3, -2, 1310].map(Some),
        temperature: Some(10),
        time: 1_000,
    };
    let wide = Packet {
        resolution: Resolution::Bits20,
        acceleration: [12, -4, 32_768].map(Some),
        rate: [6, -2, 2_620].map(Some),
        temperature: Some(662),
        time: 1_000,
    };
    for packet in [narrow, wide] {
        let bytes = packet.emit();
        for length in 0..bytes.len() {
            let got = Packet::parse(packet.resolution, &bytes[..length]);
            assert_eq!(got, Err(PacketError::Length { got: length, expected: bytes.len() }));
        }
        let (mut refused, mut same, mut wrong) = (0, 0, 0);
        for (bit, damaged) in flips(&bytes).enumerate() {
            match Packet::parse(packet.resolution, &damaged) {
                Err(_) => refused += 1,
                Ok(read) if read == packet => same += 1,
                Ok(read) => {
                    let axes = |a: &[Option<i32>; 3], b: &[Option<i32>; 3]| {
                        a.iter().zip(b).filter(|(a, b)| a != b).count()
                    };
                    let changed = axes(&read.acceleration, &packet.acceleration)
                        + axes(&read.rate, &packet.rate)
                        + usize::from(read.temperature != packet.temperature)
                        + usize::from(read.time != packet.time);
                    assert_eq!(changed, 1, "bit {bit}");
                    wrong += 1;
                }
            }
        }
        println!(
            "{:?}: {refused} flips refused, {same} without effect, {wrong} not found",
            packet.resolution
        );
        // Six bits of the header tell the content; the two others a change of rate.
        assert_eq!((refused, same, wrong), (6, 2, 8 * (bytes.len() - 1)));
    }
}

fn lines(bytes: &[u8]) -> Vec<Result<Reading, LineError>> {
    let mut part = Dsp3000Ascii::new();
    bytes.iter().filter_map(|byte| part.receive(*byte)).collect()
}

/// No checksum: a flipped bit is found where it leaves the form of a line; else it changes a digit,
/// or the mark of validity.
#[test]
fn a_flipped_bit_of_a_dsp3000_line_breaks_its_form_or_changes_a_digit() {
    let (mut refused, mut same, mut wrong) = (0, 0, 0);
    let next = Reading { millionths: 5_000_000, valid: true };
    for millionths in [10_000_000, -123, 359_999_999, -12_345_678] {
        let reading = Reading { millionths, valid: true };
        let line = reading.emit();
        for damaged in flips(line.as_bytes()) {
            // A line end that is hit glues the next line on: then there is one line less.
            let got = lines(&[&damaged[..], next.emit().as_bytes()].concat());
            assert!(matches!(got.len(), 1 | 2), "{damaged:?}: {got:?}");
            match got[0] {
                Err(_) => refused += 1,
                Ok(read) if read == reading => same += 1,
                Ok(read) => {
                    let digits = |reading: &Reading| format!("{:09}", reading.millionths.unsigned_abs());
                    let pairs = digits(&read).into_bytes().into_iter().zip(digits(&reading).into_bytes());
                    let changed = pairs.filter(|(a, b)| a != b).count();
                    let signs = read.millionths.signum() * reading.millionths.signum() < 0;
                    let changed = changed + usize::from(signs) + usize::from(read.valid != reading.valid);
                    assert_eq!(changed, 1, "{damaged:?}: {read:?}");
                    wrong += 1;
                }
            }
        }
        // Cut off behind, nothing comes until the next line's end, and that has not the form, but
        // where a few digits are left over: they stand before the next line's number.
        for length in 1..line.len() - 2 {
            let got = lines(&[&line.as_bytes()[..length], next.emit().as_bytes()].concat());
            assert_eq!(got.len(), 1);
            let glued = line.as_bytes()[..length].iter().all(|byte| b"-0123456789".contains(byte));
            assert!(got[0].is_err() || glued, "{length} bytes of {line:?}: {got:?}");
        }
    }
    println!("DSP-3000 line: {refused} flips refused, {same} without effect, {wrong} not found");
    assert!(refused > 5 * wrong / 4 && wrong > 0);
}

/// A million random bytes in lines of noise, good lines strewn in, one of ten damaged.
#[test]
fn lines_of_the_dsp3000_are_found_in_noise() {
    let mut noise = Noise::new(17);
    let (mut stream, mut sent, mut random) = (Vec::new(), Vec::new(), 0);
    while random < 1_000_000 {
        let run = noise.int(0, 400);
        random += run;
        // A line of noise ends like any other.
        stream.extend((0..run).map(|_| noise.byte()));
        stream.push(b'\n');
        let reading =
            Reading { millionths: noise.int(-359_999_999, 359_999_999) as i32, valid: noise.int(0, 1) > 0 };
        let mut line = reading.emit().into_bytes();
        if noise.int(0, 9) == 0 {
            // Its decimal point: that is found out.
            let point = line.iter().position(|byte| *byte == b'.').expect("a point");
            line[point] = noise.byte() | 0x80;
        } else {
            sent.push(reading);
        }
        stream.extend(line);
    }
    let got: Vec<Reading> = lines(&stream).into_iter().filter_map(Result::ok).collect();
    println!("DSP-3000: {} of {} intact lines among {random} random bytes", got.len(), sent.len());
    // A line of noise could be a reading by chance; with a fixed seed none is.
    assert_eq!(got, sent);
}

//! Parsers find every intact frame among random bytes. That no bytes harm them is tried in `entrances`.

use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::sensor::xsens::precision::Precision;
use gyronet::sensor::xsens::{MtData2, Mti};
use gyronet_host_tests::wire::feed;
use proptest::prelude::Rng;
use proptest::test_runner::{RngAlgorithm, TestRng};

const NOISE: usize = 100_000;

fn random(seed: u8) -> TestRng {
    TestRng::from_seed(RngAlgorithm::ChaCha, &[seed; 32])
}

/// Random bytes, half of them from `alphabet` so that false headers are common, with `frame(n)`
/// every few hundred of them; a frame out of ten is damaged. The stream and the numbers of the
/// intact frames.
fn strewn(seed: u8, alphabet: &[u8], frame: impl Fn(u32) -> Vec<u8>) -> (Vec<u8>, Vec<u32>) {
    let mut rng = random(seed);
    let (mut stream, mut intact, mut noise, mut n) = (Vec::new(), Vec::new(), 0, 0);
    while noise < NOISE {
        for _ in 0..rng.next_u32() % 600 {
            let word = rng.next_u32();
            let [kind, byte, letter, _] = word.to_le_bytes();
            stream.push(if kind & 1 == 0 { byte } else { alphabet[usize::from(letter) % alphabet.len()] });
            noise += 1;
        }
        let mut bytes = frame(n);
        if rng.next_u32().is_multiple_of(10) {
            let at = rng.next_u32() as usize % bytes.len();
            bytes[at] ^= 1 << (rng.next_u32() % 8);
        } else {
            intact.push(n);
        }
        stream.extend(bytes);
        n += 1;
    }
    // What a false header at the end still waits for.
    stream.extend([0; 300]);
    (stream, intact)
}

#[test]
fn dsp1760_finds_every_intact_frame() {
    let frame = |n: u32| {
        let message = Message {
            rotation: [0.0, 0.0, 1e-5],
            acceleration: [0.0; 3],
            extra: match n % 3 {
                0 => Extra::Temperature(n as i16),
                1 => Extra::Timed { time: n, temperature: 0 },
                _ => Extra::Slow(n as f32),
            },
            validity: Validity::GYRO,
            sequence: (n % 128) as u8,
        };
        message.emit().to_vec()
    };
    let (stream, intact) = strewn(1, &[0xFE, 0x81, 0xFF, 0x55, 0x56, 0x57, 0x00, 0xAA], frame);
    let mut part = Dsp1760::new(Dsp1760Config::DEFAULT);
    let found: Vec<_> = feed(&mut part, stream).into_iter().flatten().collect();
    println!("DSP-1760: {} of {} intact frames, {} false", found.len(), intact.len(), part.bad_checksums());
    assert_eq!(found.len(), intact.len());
    // One lost message for each damaged frame between the first and the last intact one.
    let (first, last) = (intact[0], intact[intact.len() - 1]);
    assert_eq!(part.counters().lost, last - first + 1 - intact.len() as u32);
}

/// A sum of eight bits lets one of 256 false candidates pass, and such a one takes what lies
/// inside it with it. So the noise must not make up a header: what is tested is that nothing
/// else is lost.
#[test]
fn xsens_finds_every_intact_frame() {
    let precisions = [Precision::Single, Precision::Fixed1220, Precision::Fixed1632, Precision::Double];
    let frame = |n: u32| {
        let message = MtData2 {
            packet_counter: Some(n as u16),
            sample_time_fine: Some(n * 100),
            acceleration: Some([0.5, -0.25, 9.8125]),
            rate_of_turn: Some([0.0, 0.125, 0.25]),
            temperature: Some(25.0),
            status: Some(3),
        };
        message.emit_as(precisions[n as usize % 4]).to_vec()
    };
    let (mut stream, intact) = strewn(2, &[0xFA, 0xFE, 0x36, 0x31, 0x10], frame);
    // No FA FF outside a frame: its MID is not that of a message with a sample either way.
    let mut at = 0;
    while at + 3 < stream.len() {
        if stream[at..at + 2] == [0xFA, 0xFF] && stream[at + 2] != 0x36 {
            stream[at + 1] = 0;
        }
        at += 1;
    }
    let mut part = Mti::new();
    let found: Vec<_> = feed(&mut part, stream).into_iter().flatten().collect();
    let times: Vec<u32> = found.iter().map(|sample| (sample.time.0 / 10_000) as u32).collect();
    let missed = intact.iter().filter(|n| !times.contains(n)).count();
    println!("MTi: {} of {} intact frames, {} false", found.len(), intact.len(), part.bad_checksums());
    assert_eq!(missed, 0);
    assert_eq!(found.len(), intact.len());
}

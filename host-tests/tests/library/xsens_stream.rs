//! MTData2 frames out of a byte stream: damage of every kind, and time that wraps.

use gyronet::sensor::xsens::{MtData2, Mti, XsensError};
use gyronet::units::{Micros, SpecificForce};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::wire::{bytes, feed, feed_new, message, real_frame, synthetic_frame};

#[test]
fn the_parser_resynchronises() {
    let (first, second) = (synthetic_frame(), real_frame());
    let expected = feed_new(second.clone());
    for before in [
        bytes("fa fa fa ff fa ff 36"),
        bytes("fa ff 36 ff 00 fa ff ff fa"),
        bytes("fa ff 36 fe"),
        first[first.len() - 20..].to_vec(),
        first[..20].to_vec(),
        second[..second.len() - 1].to_vec(),
        bytes("fa ff 30 00 d1 fa ff 3f 00 c2 fa ff 42 01 04 ba"),
    ] {
        // A false header may announce 254 bytes more than are there: fill up.
        let mut samples = feed_new(before.iter().chain(&second).copied().chain([0; 260]));
        samples.retain(|result| !matches!(result, Err(XsensError::Foreign { .. })));
        assert_eq!(samples, expected, "after {before:02x?}");
    }
}

#[test]
fn a_header_inside_the_payload_is_passed_over() {
    let inner = f32::from_be_bytes([0x3E, 0xFA, 0xFF, 0x36]);
    let made = MtData2 { acceleration: Some([inner, inner, 9.81]), ..message(100) };
    let [Ok(sample)] = feed_new(made.emit())[..] else { panic!("one sample") };
    assert_eq!(sample.specific_force[1], SpecificForce::from_metre_per_sec2(inner).unwrap());
    // Begun in the middle, the inner headers are what is seen first.
    let cut = made.emit()[22..].iter().chain(&message(200).emit()).copied().collect::<Vec<_>>();
    let samples = feed_new(cut.into_iter().chain([0; 260]));
    assert_eq!(samples, feed_new(message(200).emit()));
}

#[test]
fn frames_strewn_into_noise_are_all_found() {
    const NOISE: usize = 200_000;
    let mut noise = Noise::new(3);
    let (mut stream, mut sent) = (Vec::new(), 0u32);
    let mut noise_left = NOISE as i64;
    while noise_left > 0 {
        let run = noise.int(0, 400).min(noise_left);
        noise_left -= run;
        stream.extend((0..run).map(|_| noise.byte()));
        sent += 1;
        stream.extend(message(sent * 100).emit());
    }
    stream.extend([0; 260]);
    let mut mti = Mti::new();
    let samples = feed(&mut mti, stream);
    let times: Vec<Micros> = samples.iter().map(|sample| sample.expect("an intact frame").time).collect();
    assert_eq!(times, (1..=sent).map(|k| Micros(u64::from(k) * 10_000)).collect::<Vec<_>>());
    println!("{sent} frames among {NOISE} random bytes, {} false headers", mti.bad_checksums());
}

#[test]
fn time_wraps_and_steps_back() {
    let mut mti = Mti::new();
    let ticks = [u32::MAX - 149, u32::MAX - 49, 50, 150, 100, 250];
    let samples = feed(&mut mti, ticks.iter().flat_map(|ticks| message(*ticks).emit()));
    let first = u64::from(u32::MAX - 149) * 100;
    let times: Vec<u64> = samples.iter().map(|sample| sample.unwrap().time.0 - first).collect();
    assert_eq!(times, [0, 10_000, 20_000, 30_000, 25_000, 40_000]);
}

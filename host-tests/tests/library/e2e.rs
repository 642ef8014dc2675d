//! AUTOSAR E2E: published vectors, and the sequence judgement.

use gyronet::can::bosch::Message;
use gyronet::can::e2e::{Checker, DataIdMode, Fault, P01, P02, P05, Profile, Protector, Verdict};
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::wire::bytes;
use proptest::prelude::*;

const ZEROS: [u8; 6] = [0; 6];
const ONE_TO_SIX: [u8; 6] = [1, 2, 3, 4, 5, 6];
const TWO_TO_SEVEN: [u8; 6] = [2, 3, 4, 5, 6, 7];

fn p01(mode: DataIdMode) -> Profile {
    Profile::P01(P01 { data_id: 0x123, mode })
}

fn p02(first: u8, step: u8) -> Profile {
    Profile::P02(P02 { data_ids: core::array::from_fn(|k| first + step * k as u8) })
}

fn p05() -> Profile {
    Profile::P05(P05 { data_id: 0x1234 })
}

fn all() -> [Profile; 7] {
    use DataIdMode::{Alternating, Both, Low, Nibble};
    [p01(Both), p01(Alternating), p01(Low), p01(Nibble), p02(0, 0), p02(1, 1), p05()]
}

#[test]
fn frames_equal_published_vectors() {
    use DataIdMode::{Alternating, Both, Low, Nibble};
    let vectors = [
        (p01(Both), 0, ZEROS, &[0xCC, 0x00][..]),
        (p01(Both), 1, ZEROS, &[0x91, 0x01]),
        (p01(Alternating), 0, ZEROS, &[0xCE, 0x00]),
        (p01(Alternating), 1, ZEROS, &[0x02, 0x01]),
        (p01(Low), 0, ZEROS, &[0xCE, 0x00]),
        (p01(Low), 1, ZEROS, &[0x93, 0x01]),
        (p01(Nibble), 0, ZEROS, &[0x2A, 0x10]),
        (p01(Nibble), 1, ZEROS, &[0x77, 0x11]),
        (p01(Both), 1, ONE_TO_SIX, &[0x90, 0x01]),
        (p01(Nibble), 1, ONE_TO_SIX, &[0x76, 0x11]),
        (p02(0, 0), 1, ZEROS, &[0x45, 0x01]),
        (p02(0, 1), 1, ZEROS, &[0x6A, 0x01]),
        (p02(0, 1), 2, TWO_TO_SEVEN, &[0xBC, 0x02]),
        (p02(0, 1), 1, TWO_TO_SEVEN, &[0x61, 0x01]),
        (p02(1, 1), 0, ZEROS, &[0x0E, 0x00]),
        (p05(), 0, ZEROS, &[0x1C, 0xCA, 0x00]),
        (p05(), 1, ZEROS, &[0xCF, 0x8D, 0x01]),
    ];
    for (profile, counter, payload, header) in vectors {
        let mut data = [0; 8];
        data[2..].copy_from_slice(&payload);
        profile.protect(&mut data, counter).expect("eight bytes");
        assert_eq!(data[..header.len()], *header, "{profile:?} counter {counter}");
        assert_eq!(data[3..], payload[1..]);
        assert_eq!(profile.check(&data), Ok(counter));
    }
}

/// Those by which a receiver's checksums can be tried out.
#[test]
fn the_frames_on_the_page_are_good() {
    let page = std::fs::read_to_string(workspace().join("src/can/README.md")).expect("the page");
    let frames = page.split('`').filter(|word| word.len() == 20 && word.contains('#'));
    let frames: Vec<_> = frames.filter_map(|word| word.split_once('#')).collect();
    let [("174", bosch), ("1A0", own)] = frames[..] else { panic!("{frames:?}") };
    let (mut bosch, mut own) = (bytes(bosch), bytes(own));
    let profile = Profile::P01(P01 { data_id: 0x1A0, mode: DataIdMode::Both });
    assert!(Message::parse(&bosch).is_ok() && profile.check(&own).is_ok());
    (bosch[7], own[7]) = (bosch[7] ^ 1, own[7] ^ 1);
    assert!(Message::parse(&bosch).is_err() && profile.check(&own).is_err());
}

#[test]
fn a_verdict_decides_what_is_used() {
    for verdict in [Verdict::First, Verdict::Ok, Verdict::Lost(1)] {
        assert!(verdict.usable(), "{verdict:?}");
    }
    for verdict in [Verdict::Repeated, Verdict::WrongSequence { delta: 9 }] {
        assert!(!verdict.usable(), "{verdict:?}");
    }
}

#[test]
fn lengths_and_counters_that_cannot_be_are_refused() {
    for profile in all() {
        let header = if matches!(profile, Profile::P05(_)) { 3 } else { 2 };
        for len in (0..header).chain([65]) {
            let mut data = vec![0; len];
            assert_eq!(profile.protect(&mut data, 0), Err(Fault::Length(len)), "{profile:?}");
            assert_eq!(profile.check(&data), Err(Fault::Length(len)), "{profile:?}");
        }
    }
    for (profile, longest) in [(p01(DataIdMode::Both), 30), (p02(0, 0), 14), (p05(), 64)] {
        let mut data = vec![0; longest];
        assert_eq!(profile.protect(&mut data, 1), Ok(()), "{profile:?}");
        assert_eq!(profile.check(&data), Ok(1), "{profile:?}");
        let mut data = vec![0; longest + 1];
        assert_eq!(profile.protect(&mut data, 1), Err(Fault::Length(longest + 1)), "{profile:?}");
        assert_eq!(profile.check(&data), Err(Fault::Length(longest + 1)), "{profile:?}");
    }
    assert_eq!(p01(DataIdMode::Both).protect(&mut [0; 8], 15), Err(Fault::Counter(15)));
    assert_eq!(p02(0, 0).protect(&mut [0; 8], 16), Err(Fault::Counter(16)));
    // Counter 15 behind a CRC that fits. The CRC is linear: the difference of the two messages
    // has as its CRC the difference of their CRCs.
    let mut data = [0; 8];
    p01(DataIdMode::Both).protect(&mut data, 14).expect("eight bytes");
    let linear = crc::Crc::<u8>::new(&crc::Algorithm { xorout: 0, init: 0, ..crc::CRC_8_SAE_J1850 });
    data[0] ^= linear.checksum(&[14 ^ 15, 0, 0, 0, 0, 0, 0]);
    data[1] = 15;
    assert_eq!(p01(DataIdMode::Both).check(&data), Err(Fault::Counter(15)));
}

#[test]
fn a_foreign_identifier_is_noticed() {
    for profile in all() {
        let foreign = match profile {
            Profile::P01(p) => Profile::P01(P01 { data_id: p.data_id ^ 0x301, ..p }),
            Profile::P02(p) => Profile::P02(P02 { data_ids: p.data_ids.map(|id| id ^ 1) }),
            Profile::P05(p) => Profile::P05(P05 { data_id: p.data_id ^ 0x301 }),
        };
        for counter in 0..14 {
            let mut data = [0x5A; 8];
            foreign.protect(&mut data, counter).expect("eight bytes");
            assert!(profile.check(&data).is_err(), "{profile:?} counter {counter}");
        }
    }
    // Same low byte, other nibble, the CRC made to fit: the nibble itself is compared.
    let mut data = [0; 8];
    Profile::P01(P01 { data_id: 0x423, mode: DataIdMode::Nibble })
        .protect(&mut data, 0)
        .expect("eight bytes");
    assert_eq!(p01(DataIdMode::Nibble).check(&data), Err(Fault::DataId { received: 4 }));
}

#[test]
fn a_flipped_bit_gives_no_message_with_the_counter_that_was_sent() {
    for profile in all() {
        let mut sent = [0x5A; 8];
        profile.protect(&mut sent, 9).expect("eight bytes");
        for bit in 0..64 {
            let damaged = (u64::from_le_bytes(sent) ^ 1 << bit).to_le_bytes();
            assert_ne!(profile.check(&damaged), Ok(9), "{profile:?}, bit {bit}");
        }
    }
}

fn messages(profile: Profile, count: usize) -> Vec<[u8; 8]> {
    let mut protector = Protector::new(profile);
    (0..count)
        .map(|k| {
            let mut data = [k as u8; 8];
            protector.protect(&mut data).expect("eight bytes");
            data
        })
        .collect()
}

#[test]
fn sequence_is_judged_as_the_profiles_say() {
    for profile in all() {
        let sent = messages(profile, 600);
        let mut checker = Checker::new(profile, 3);
        assert_eq!(checker.check(&sent[0]), Ok(Verdict::First));
        for data in &sent[1..300] {
            assert_eq!(checker.check(data), Ok(Verdict::Ok), "{profile:?}");
        }
        assert_eq!(checker.check(&sent[299]), Ok(Verdict::Repeated));
        assert_eq!(checker.check(&sent[302]), Ok(Verdict::Lost(2)));
        assert_eq!(checker.check(&sent[306]), Ok(Verdict::WrongSequence { delta: 4 }));
        assert_eq!(checker.check(&sent[307]), Ok(Verdict::Ok));
        let mut damaged = sent[308];
        damaged[7] ^= 0x10;
        assert!(matches!(checker.check(&damaged), Err(Fault::Crc { .. })));
        assert_eq!(checker.check(&sent[309]), Ok(Verdict::Lost(1)));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is lost, doubled or exchanged: the verdict where it shows is not Ok.
    #[test]
    fn every_lost_repeated_and_reordered_message_shows(
        which in 0..7_usize, at in 1..500_usize, distance in 1..14_usize,
    ) {
        let profile = all()[which];
        let sent = messages(profile, 540);
        let judge = |received: &[[u8; 8]]| {
            let mut checker = Checker::new(profile, 1);
            received.iter().filter(|data| checker.check(&data[..]) != Ok(Verdict::Ok)).count()
        };
        prop_assert_eq!(judge(&sent), 1, "only the first, which has no predecessor");

        let mut lost = sent.clone();
        lost.drain(at..at + distance);
        prop_assert_eq!(judge(&lost), 2);

        let mut repeated = sent.clone();
        repeated.insert(at, sent[at]);
        prop_assert_eq!(judge(&repeated), 2);

        let mut reordered = sent.clone();
        reordered.swap(at, at + distance);
        prop_assert!(judge(&reordered) >= 3);
    }
}

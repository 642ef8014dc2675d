//! Who may write: a board with a key takes what is signed with its private part, once, and nothing else.

use super::uds::{Bench, bench, download};
use gyronet::can::e2e::{P02, Profile};
use gyronet::can::signal::{BitField, ByteOrder};
use gyronet::can::wheel::{Checksum, WheelFrame, WheelSettings, WheelSignal};
use gyronet::model::weights;
use gyronet::service::message::Refusal;
use gyronet::store::{Access, Configuration, Record};
use gyronet::uds::signature;
use gyronet::units::{Duration, WheelSpeed};
use gyronet_host_tests::flash::{Cut, Flash, shared};
use gyronet_host_tests::stored::{crc, other_weights};
use gyronet_host_tests::wire::id29;
use gyronet_tools::signing::{PrivateKey, unhex};

pub const SERIAL: [u8; 12] = *b"a test board";
const CONFIGURATION: u16 = 0x0100;

pub fn a_key() -> PrivateKey {
    PrivateKey::generate().expect("random numbers")
}

/// A board with a key, in an extended session at standstill.
pub fn locked() -> (Flash, Bench, PrivateKey) {
    let (flash, mut bench) = bench();
    let key = a_key();
    bench.enter(3);
    bench.expect(&[&[0x2E, 1, 0x10][..], &key.public()].concat(), &[0x6E, 1, 0x10]);
    let mut bench = Bench::new(&flash);
    bench.enter(3);
    (flash, bench, key)
}

fn configuration(k: u8) -> Configuration {
    // Its last byte is no scope of a trailer.
    Configuration { latitude_deg: Some(f32::from(k)), ..Configuration::DEFAULT }
}

pub fn content(k: u8) -> Vec<u8> {
    [&[Configuration::VERSION][..], &postcard::to_stdvec(&configuration(k)).expect("there is room")].concat()
}

pub fn write(content: &[u8], trailer: &[u8]) -> Vec<u8> {
    [&[0x2E][..], &CONFIGURATION.to_be_bytes(), content, trailer].concat()
}

fn refusal(bench: &mut Bench) -> Option<Refusal> {
    let read = bench.ask(&[0x22, 1, 0x0B]).expect("the reason");
    postcard::from_bytes(&read[3..]).expect("as it is documented")
}

/// The state of access: 0 open, 1 locked, 2 unlocked; the counter; wrong answers.
fn access(bench: &mut Bench) -> (u8, u32, u8) {
    let read = bench.ask(&[0x22, 1, 0x11]).expect("a response");
    (read[3], u32::from_be_bytes([read[4], read[5], read[6], read[7]]), read[8])
}

/// Whoever signs with a tool of their own needs these bytes. The hash is FIPS 180-2's of "abc".
#[test]
fn the_signed_bytes_are_those_of_the_page() {
    let hash: [u8; 64] = unhex(
        "ddaf35a193617abacc417349ae20413112e6fa4e89a97ea20a9eeee64b55d39a2192992a274fc1a836ba3c23a3feebbd454d4423643ce80e2a9ac94fa54ca49f",
    )
    .expect("a hash");
    let statement = signature::Statement { target: CONFIGURATION, serial: SERIAL, counter: 5 };
    let signed = signature::message(&statement, &signature::digest(b"abc"));
    let content =
        [&b"gyronet content 1"[..], &[1, 0], b"a test board", &[0, 0, 0, 5], &[0, 0, 0, 3], &hash].concat();
    assert_eq!(signed[..], content);
    let answer = [&b"gyronet access 1"[..], b"a test board", &[9; 32]].concat();
    assert_eq!(signature::challenge(&SERIAL, &[9; 32])[..], answer);
}

/// RFC 8032, section 7.1, tests 1 to 3, and each with a bit flipped.
#[test]
fn signatures_are_those_of_rfc_8032() {
    for (public, message, signature) in [
        (
            "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a",
            &[][..],
            "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46bd25bf5f0595bbe24655141438e7a100b",
        ),
        (
            "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c",
            &[0x72],
            "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c387b2eaeb4302aeeb00d291612bb0c00",
        ),
        (
            "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025",
            &[0xAF, 0x82],
            "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc6594a7c15e9716ed28dc027beceea1ec40a",
        ),
    ] {
        let public: [u8; 32] = unhex(public).expect("a key");
        let signature: [u8; 64] = unhex(signature).expect("a signature");
        assert!(signature::is_valid(&public, message, &signature));
        for bit in (0..512).step_by(37) {
            let mut other = signature;
            other[bit / 8] ^= 1 << (bit % 8);
            assert!(!signature::is_valid(&public, message, &other), "bit {bit}");
        }
        assert!(!signature::is_valid(&public, &[message, b"x"].concat(), &signature));
        // The order of the group added to S is the same number to a verifier that does not look.
        let mut other = signature;
        let order: [u8; 32] =
            unhex("edd3f55c1a631258d69cf7a2def9de1400000000000000000000000000000010").expect("the order");
        let mut carry = 0;
        for (byte, more) in other[32..].iter_mut().zip(order) {
            let sum = u16::from(*byte) + u16::from(more) + carry;
            (*byte, carry) = (sum as u8, sum >> 8);
        }
        assert!(carry == 0 && !signature::is_valid(&public, message, &other));
    }
}

#[test]
fn a_board_without_a_key_is_open_and_reports_it() {
    let (_, mut bench) = bench();
    assert_eq!(access(&mut bench), (0, 0, 0));
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x27, 1], &[&[0x67, 1][..], &[0; 32]].concat());
    bench.stand();
    bench.expect(&write(&content(1), &[]), &[0x6E, 1, 0]);
    let serial = bench.ask(&[0x22, 0xF1, 0x8C]).expect("a serial number");
    assert_eq!(unhex(std::str::from_utf8(&serial[3..]).expect("text")), Some(SERIAL));
}

#[test]
fn what_is_signed_is_accepted_once() {
    let (flash, mut bench, key) = locked();
    assert_eq!(access(&mut bench), (1, 0, 0));
    let signed =
        |k: u8, counter| write(&content(k), &key.trailer(CONFIGURATION, Some(SERIAL), counter, &content(k)));
    bench.expect(&signed(1, 5), &[0x6E, 1, 0]);
    assert_eq!(start(&flash).latitude_deg, Some(1.0));
    // Again, and an older one; then one for any board.
    bench.expect(&signed(1, 5), &[0x7F, 0x2E, 0x31]);
    assert_eq!(refusal(&mut bench), Some(Refusal::Counter { found: 5, newest: 5 }));
    bench.expect(&signed(2, 4), &[0x7F, 0x2E, 0x31]);
    bench.expect(&write(&content(3), &key.trailer(CONFIGURATION, None, 6, &content(3))), &[0x6E, 1, 0]);
    // Also after a restart.
    let mut bench = Bench::new(&flash);
    bench.enter(3);
    bench.expect(&signed(2, 6), &[0x7F, 0x2E, 0x31]);
    assert_eq!(start(&flash).latitude_deg, Some(3.0));
}

fn start(flash: &Flash) -> Configuration {
    *super::start(flash).configuration()
}

#[test]
fn what_is_unsigned_cut_foreign_or_changed_is_refused() {
    let (flash, mut bench, key) = locked();
    let other = a_key();
    let good = key.trailer(CONFIGURATION, Some(SERIAL), 9, &content(1));
    let mut elsewhere = SERIAL;
    elsewhere[3] ^= 1;
    let mut changed = content(1);
    changed[3] ^= 1;
    let with = |at: usize, byte: u8| {
        let mut trailer = good;
        trailer[at] = byte;
        write(&content(1), &trailer)
    };
    let by = |key: &PrivateKey, target, serial| {
        write(&content(1), &key.trailer(target, Some(serial), 9, &content(1)))
    };
    bench.expect(&write(&content(1)[..40], &[]), &[0x7F, 0x2E, 0x13]);
    assert_eq!(refusal(&mut bench), Some(Refusal::Unsigned));
    // A cut trailer takes a byte of the content for its own first one.
    let cut = bench.ask(&write(&content(1), &good[..68])).expect("a response");
    assert!(cut[..2] == [0x7F, 0x2E] && [0x13, 0x31, 0x35].contains(&cut[2]), "{cut:02x?}");
    for (what, request) in [
        ("of another key", by(&other, CONFIGURATION, SERIAL)),
        ("for wheels", by(&key, 0x0101, SERIAL)),
        ("for another board", by(&key, CONFIGURATION, elsewhere)),
        ("another content", write(&changed, &good)),
        ("another counter", with(4, 10)),
        ("another scope", with(0, 1)),
    ] {
        assert_eq!(bench.ask(&request), Some(vec![0x7F, 0x2E, 0x35]), "{what}");
        assert_eq!(refusal(&mut bench), Some(Refusal::Signature), "{what}");
    }
    // All the rest that writes or silences wants access.
    for request in [&[0x11, 1][..], &[0x14, 255, 255, 255], &[0x28, 1, 1], &[0x31, 1, 2, 5], &[0x85, 2]] {
        bench.expect(request, &[0x7F, request[0], 0x33]);
    }
    assert_eq!(refusal(&mut bench), Some(Refusal::Locked));
    assert_eq!((start(&flash), access(&mut bench)), (Configuration::DEFAULT, (1, 0, 0)));
    // And reading does not.
    assert!(bench.ask(&[0x22, 1, 0]).is_some_and(|response| response[0] == 0x62));
    bench.expect(&write(&content(1), &good), &[0x6E, 1, 0]);
}

#[test]
fn access_is_proven_for_one_session() {
    let (_, mut bench, key) = locked();
    bench.is_random = false;
    bench.expect(&[&[0x27, 2][..], &[0; 64]].concat(), &[0x7F, 0x27, 0x24]);
    let seed = [7; 32];
    bench.seeds = vec![seed];
    bench.expect(&[0x27, 1], &[&[0x67, 1][..], &seed].concat());
    bench.expect(&[&[0x27, 2][..], &key.answer(&SERIAL, &seed)].concat(), &[0x67, 2]);
    assert_eq!(access(&mut bench).0, 2);
    bench.expect(&[0x27, 1], &[&[0x67, 1][..], &[0; 32]].concat());
    bench.expect(&[0x14, 255, 255, 255], &[0x54]);
    // Access holds for its session, which five seconds of silence end.
    bench.now += 5_001;
    bench.expect(&[0x28, 0, 1], &[0x7F, 0x28, 0x7F]);
    assert_eq!(access(&mut bench).0, 1);
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x14, 255, 255, 255], &[0x7F, 0x14, 0x33]);
}

#[test]
fn wrong_answers_cost_time_also_over_a_restart() {
    let (flash, mut bench, key) = locked();
    let mut seed = 0;
    let mut attempt = |bench: &mut Bench, answer: [u8; 64]| {
        seed += 1;
        bench.seeds = vec![[seed; 32]];
        bench.stand();
        let mut response = bench.ask(&[0x27, 1]).expect("a response");
        if response[0] == 0x67 {
            response = bench.ask(&[&[0x27, 2][..], &answer].concat()).expect("a response");
        }
        *response.last().expect("a code")
    };
    for code in [0x35, 0x35, 0x36] {
        assert_eq!(attempt(&mut bench, [0; 64]), code);
    }
    assert_eq!(attempt(&mut bench, [0; 64]), 0x37, "ten seconds");
    // A restart does not help: the delay begins again.
    let mut bench = Bench::new(&flash);
    assert_eq!(access(&mut bench), (1, 0, 3));
    // Ten seconds, then twenty after the fourth wrong answer.
    for (wait, code) in [(0, 0x37), (9_000, 0x37), (1_000, 0x36), (19_000, 0x37)] {
        bench.now += wait;
        bench.enter(3);
        assert_eq!(attempt(&mut bench, [0; 64]), code, "{wait} ms later");
    }
    bench.now += 1_100;
    bench.enter(3);
    let right = key.answer(&SERIAL, &[9; 32]);
    assert_eq!(attempt(&mut bench, right), 2, "the right answer");
    assert_eq!(access(&mut bench), (2, 0, 0));
}

#[test]
fn another_key_wants_the_signature_of_the_one_before() {
    let (flash, mut bench, key) = locked();
    let next = a_key();
    let write = |public: [u8; 32], trailer: &[u8]| [&[0x2E, 1, 0x10][..], &public, trailer].concat();
    bench.expect(&write(next.public(), &[]), &[0x7F, 0x2E, 0x13]);
    // What is no point of the curve, or one of low order, locks out or in everyone.
    let mut low_order = [0; 32];
    low_order[0] = 1;
    for (counter, bad) in [(1, [2; 32]), (2, low_order)] {
        let response = bench.ask(&write(bad, &key.trailer(0x0110, None, counter, &bad)));
        assert_eq!(response, Some(vec![0x7F, 0x2E, 0x31]), "{bad:02x?}");
    }
    bench.expect(&write(next.public(), &next.trailer(0x0110, None, 3, &next.public())), &[0x7F, 0x2E, 0x35]);
    bench.expect(&write(next.public(), &key.trailer(0x0110, None, 3, &next.public())), &[0x6E, 1, 0x10]);
    bench.expect(&write([0; 32], &key.trailer(0x0110, None, 4, &[0; 32])), &[0x7F, 0x2E, 0x35]);
    bench.expect(&write([0; 32], &next.trailer(0x0110, None, 4, &[0; 32])), &[0x6E, 1, 0x10]);
    assert_eq!(super::start(&flash).access(), Some(Access { key: None, counter: 4, wrong: 0 }));
}

/// Downloads a file, and returns the response to the routine that uses it.
fn use_file(bench: &mut Bench, file: &[u8], trailer: &[u8]) -> Vec<u8> {
    assert_eq!(download(bench, file)[0], 0x77);
    bench.ask(&[&[0x31, 1, 0xFF, 1][..], trailer].concat()).expect("a response")
}

#[test]
fn a_weight_file_is_used_with_its_own_signature_alone() {
    let (flash, mut bench, key) = locked();
    let (file, other) = (other_weights(1), other_weights(2));
    let sign = |file: &[u8], counter| key.trailer(0xFF01, None, counter, file);
    assert_eq!(use_file(&mut bench, &file, &[]), [0x7F, 0x31, 0x13]);
    assert_eq!(use_file(&mut bench, &file, &sign(&other, 1)), [0x7F, 0x31, 0x35]);
    let running = |flash: &Flash| super::start(flash).info().weights_crc;
    assert_eq!(running(&flash), Some(crc(&weights::DEFAULT.0)));
    assert_eq!(use_file(&mut bench, &file, &sign(&file, 1)), [0x71, 1, 0xFF, 1]);
    assert_eq!(running(&flash), Some(crc(&file)));
    // The same file again is a replay.
    assert_eq!(use_file(&mut bench, &file, &sign(&file, 1)), [0x7F, 0x31, 0x31]);
}

/// A cut leaves the counter as it was, or burnt; never a signature that is accepted twice.
#[test]
fn a_power_cut_never_takes_the_counter_back() {
    let (flash, _, key) = locked();
    let before = flash.borrow().clone();
    let mut cuts = 0;
    loop {
        let flash = shared(before.clone());
        let mut bench = Bench::new(&flash);
        bench.enter(3);
        flash.borrow_mut().cut_after(cuts, Cut::ALL[cuts as usize % Cut::ALL.len()]);
        let request = write(&content(1), &key.trailer(CONFIGURATION, None, 1, &content(1)));
        let response = bench.ask(&request).expect("a response");
        if !flash.borrow_mut().restore() {
            assert_eq!(response, [0x6E, 1, 0]);
            break;
        }
        let board = super::start(&flash);
        let access = board.access().expect("it is read");
        assert_eq!(access.key, Some(key.public()), "cut {cuts}");
        let is_written = *board.configuration() == configuration(1);
        assert!(is_written || *board.configuration() == Configuration::DEFAULT, "cut {cuts}");
        assert!(!is_written || access.counter == 1, "cut {cuts}: {access:?}");
        cuts += 1;
    }
    assert!(cuts > 4, "{cuts} operations to cut");
}

/// A workshop and the owner see that somebody has tried.
#[test]
fn refusals_are_counted_and_a_trouble_that_stays() {
    let (flash, mut bench, key) = locked();
    let counters = |bench: &mut Bench| bench.ask(&[0x22, 1, 0x13]).expect("counters")[3..].to_vec();
    let words = |words: [u32; 5]| words.iter().flat_map(|word| word.to_be_bytes()).collect::<Vec<u8>>();
    assert_eq!(counters(&mut bench), words([0; 5]));
    let signed = |counter| key.trailer(CONFIGURATION, None, counter, &content(1));
    bench.expect(&[0x28, 1, 1], &[0x7F, 0x28, 0x33]);
    bench.expect(&write(&content(1)[..40], &[]), &[0x7F, 0x2E, 0x13]);
    bench.seeds = vec![[1; 32]];
    assert!(bench.ask(&[0x27, 1]).is_some_and(|response| response[0] == 0x67));
    bench.expect(&[&[0x27, 2][..], &[0; 64]].concat(), &[0x7F, 0x27, 0x35]);
    bench.expect(&write(&content(2), &signed(1)), &[0x7F, 0x2E, 0x35]);
    bench.expect(&write(&content(1), &signed(1)), &[0x6E, 1, 0]);
    bench.expect(&write(&content(1), &signed(1)), &[0x7F, 0x2E, 0x31]);
    assert_eq!(counters(&mut bench), words([1; 5]));
    // U1A03-81, present with the last request, in the memory after another one, and after a restart.
    let status = |bench: &mut Bench| {
        let list = bench.ask(&[0x19, 2, 0x08]).expect("a list");
        list[3..]
            .chunks(4)
            .find(|trouble| trouble[..3] == [0xDA, 0x03, 0x81])
            .map(|trouble| trouble[3] & 0x09)
    };
    assert_eq!(status(&mut bench), Some(0x09));
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    assert_eq!(status(&mut bench), Some(0x08));
    let mut bench = Bench::new(&flash);
    assert_eq!((status(&mut bench), counters(&mut bench)), (Some(0x08), words([0; 5])));
}

#[test]
fn a_challenge_that_comes_twice_is_none() {
    let (_, mut bench, key) = locked();
    bench.seeds = vec![[7; 32], [7; 32]];
    assert!(bench.ask(&[0x27, 1]).is_some_and(|response| response[0] == 0x67));
    bench.expect(&[0x27, 1], &[0x7F, 0x27, 0x22]);
    // Without a positive response where none is wanted; behind "response pending" there is a response all the same.
    bench.seeds = vec![[8; 32]];
    assert_eq!(bench.ask(&[0x27, 0x81]), None);
    bench.expect(&[&[0x27, 0x82][..], &key.answer(&SERIAL, &[8; 32])].concat(), &[0x67, 2]);
    assert_eq!(access(&mut bench).0, 2);
}

/// Four frames of 29 bits with the longest protection, and the largest numbers.
#[test]
fn the_longest_wheel_settings_fit_with_their_trailer() {
    let (flash, mut bench, key) = locked();
    let frame = |k: u32| WheelFrame {
        id: id29(0x1FFF_FFF0 + k),
        counter: Some(BitField::new(24, 8, ByteOrder::Intel, false).expect("it fits").into()),
        checksum: Checksum::E2e(Profile::P02(P02 { data_ids: [0xFF; 16] })),
    };
    let field = BitField::new(39, 32, ByteOrder::Motorola, true).expect("it fits");
    let signal = |frame| WheelSignal {
        offset: WheelSpeed(i32::MIN),
        invalid: [Some(u32::MAX), None, None],
        ..WheelSignal::new(frame, field, i32::MIN)
    };
    let wheels = WheelSettings {
        frames: [0, 1, 2, 3].map(|k| Some(frame(k))),
        signals: [0, 1, 2, 3].map(|k| Some(signal(k))),
        timeout: Duration(10_000_000),
        still_speed: WheelSpeed(i32::MAX),
        still_for: Duration(10_000_000),
    };
    let content = postcard::to_stdvec(&wheels).expect("there is room");
    assert!(content.len() > 180, "{}", content.len());
    let request = [&[0x2E, 1, 1][..], &content, &key.trailer(0x0101, None, 1, &content)].concat();
    bench.expect(&request, &[0x6E, 1, 1]);
    assert_eq!(*super::start(&flash).wheels(), wheels);
}

//! The diagnostic server as a tester sees it: sessions, data, troubles, routines and downloads, with the responses of
//! ISO 14229-1 word for word.

use super::{Board, sample, start};
use gyronet::health::{Faults, Status};
use gyronet::model::weights;
use gyronet::sample::{Standstill, WheelSample};
use gyronet::service::event::SensorFault;
use gyronet::service::message::{AllCounters, Refusal};
use gyronet::store::{Configuration, Field, FieldError, Record, StoreError};
use gyronet::uds::Server;
use gyronet::uds::data::{Access, IDENTIFIERS, Identifier};
use gyronet::uds::dtc::{TROUBLES, bit};
use gyronet_host_tests::flash::F405;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::stored::other_weights;
use gyronet_host_tests::synthetic::judged;
use gyronet_host_tests::tester::{Tester, frame};
use std::cell::RefCell;
use std::rc::Rc;

/// A board with its server, and the time in milliseconds.
pub struct Bench {
    server: Server,
    pub board: Board,
    pub now: u32,
    tester: Tester,
    /// The challenges that come next; none, where there are no random numbers.
    pub seeds: Vec<[u8; 32]>,
}

impl Bench {
    pub fn new(flash: &Rc<RefCell<F405>>) -> Self {
        Self {
            server: Server::new(),
            board: start(flash),
            now: 0,
            tester: Tester::default(),
            seeds: Vec::new(),
        }
    }

    /// Asks over frames, a millisecond each turn.
    pub fn ask(&mut self, request: &[u8]) -> Option<Vec<u8>> {
        let Self { server, board, now, tester, seeds } = self;
        tester.ask(request, 400, |frames| {
            frames.iter().for_each(|data| server.receive(data, *now));
            server.poll(board, &AllCounters::default(), *now, || seeds.pop());
            *now += 1;
            std::iter::from_fn(|| server.next_frame(*now)).collect()
        })
    }

    pub fn expect(&mut self, request: &[u8], response: &[u8]) {
        assert_eq!(self.ask(request).as_deref(), Some(response), "{request:02x?}");
    }

    /// Lets a vehicle stand long enough to prove it.
    pub fn stand(&mut self) {
        for k in 0..400 {
            let at_rest = sample(k, [0.0, 0.0, 9.81], 0.0);
            let good = (Status::Ready, Faults::NONE);
            self.board.observe(
                Some(&at_rest),
                k as u32,
                good,
                &WheelSample::without_speeds(Standstill::Still),
                &judged(Standstill::Still),
            );
        }
    }

    fn fail(&mut self, status: Status, faults: Faults) {
        self.board.observe(
            None,
            0,
            (status, faults),
            &WheelSample::without_speeds(Standstill::Unknown),
            &judged(Standstill::Unknown),
        );
        self.server.poll(&mut self.board, &AllCounters::default(), self.now, || None);
    }
}

pub fn bench() -> (Rc<RefCell<F405>>, Bench) {
    let flash = Rc::new(RefCell::new(F405::default()));
    let bench = Bench::new(&flash);
    (flash, bench)
}

#[test]
fn a_session_ends_after_five_seconds_of_silence() {
    let (_, mut bench) = bench();
    bench.expect(
        &[0x22, 0xF1, 0x86, 0xF1, 0x89, 0xF1, 0x97],
        &[&[0x62, 0xF1, 0x86, 1, 0xF1, 0x89, 0, 1, 0, 0xF1, 0x97][..], b"gyronet"].concat(),
    );
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    for _ in 0..5 {
        bench.now += 4_500;
        // Kept by a tester that wants no response.
        assert_eq!(bench.ask(&[0x3E, 0x80]), None);
    }
    bench.expect(&[0x22, 0xF1, 0x86], &[0x62, 0xF1, 0x86, 3]);
    bench.now += 5_001;
    bench.expect(&[0x22, 0xF1, 0x86], &[0x62, 0xF1, 0x86, 1]);
}

#[test]
fn what_is_wrong_with_a_request_has_the_standard_s_code() {
    let (_, mut bench) = bench();
    for (request, code) in [
        (&[0x10, 9][..], 0x12),
        (&[0x10], 0x13),
        (&[0x10, 3, 0], 0x13),
        (&[0x11, 2], 0x12),
        (&[0x14, 1, 2, 3], 0x31),
        (&[0x19, 0x42], 0x12),
        (&[0x19, 2], 0x13),
        (&[0x19, 6, 1, 2, 3, 1], 0x31),
        (&[0x22, 0xF1], 0x13),
        (&[0x22, 0x12, 0x34], 0x31),
        (&[0x23, 1], 0x11),
        (&[0x28, 1, 1], 0x7F),
        (&[0x2E, 1, 0, 0], 0x7F),
        (&[0x31, 1, 2, 0], 0x7F),
        (&[0x34, 0, 0x11, 0, 4], 0x7F),
        (&[0x36, 1, 0], 0x7F),
        (&[0x37], 0x7F),
        (&[0x3E, 1], 0x12),
        (&[0x85, 2], 0x7F),
        (&[0xBA], 0x11),
    ] {
        bench.expect(request, &[0x7F, request[0], code]);
    }
    bench.expect(&[0x10, 2], &[0x50, 2, 0, 50, 0x01, 0xF4]);
    for (request, code) in [
        (&[0x28, 2, 1][..], 0x12),
        (&[0x28, 1, 2], 0x31),
        (&[0x28, 1], 0x13),
        (&[0x2E, 0xF1, 0x86, 1], 0x31),
        (&[0x2E, 1, 0], 0x13),
        (&[0x2E, 1, 0, 99, 0], 0x31),
        (&[0x31, 1, 9, 9], 0x31),
        (&[0x31, 3, 2, 0], 0x24),
        (&[0x31, 2, 2, 2], 0x12),
        (&[0x34, 0x10, 0x11, 0, 4], 0x31),
        (&[0x34, 0, 0x55, 0, 4], 0x31),
        (&[0x34, 0, 0x11, 0], 0x13),
        (&[0x34, 0, 0x11, 2, 4], 0x31),
        (&[0x36, 1, 0], 0x24),
        (&[0x37], 0x24),
    ] {
        bench.expect(request, &[0x7F, request[0], code]);
    }
}

#[test]
fn requests_to_all_servers_are_refused_in_silence() {
    let (_, mut bench) = bench();
    let mut functional = |request: &[u8]| {
        let Bench { server, board, now, .. } = &mut bench;
        server.receive_functional(&frame(&[request.len() as u8], request), *now);
        server.poll(board, &AllCounters::default(), *now, || None);
        server.next_frame(*now).map(|data| data[1..=usize::from(data[0])].to_vec())
    };
    assert_eq!(functional(&[0x3E, 0]), Some(vec![0x7E, 0]));
    assert_eq!(functional(&[0xBA]), None);
    assert_eq!(functional(&[0x22, 0x12, 0x34]), None);
    assert_eq!(functional(&[0x3E, 0x80]), None);
    assert_eq!(functional(&[0x10]), Some(vec![0x7F, 0x10, 0x13]), "a length is refused aloud");
    // One that is no request changes nothing for the next, and all but "tester present" is counted.
    assert_eq!(functional(&[]), None);
    bench.expect(&[0xBA], &[0x7F, 0xBA, 0x11]);
    bench.server.receive(&[0x10, 20, 0x22, 1, 0, 1, 1, 1], bench.now);
    bench.server.receive_functional(&[2, 0x3E, 0x80], bench.now);
    bench.server.receive_functional(&[2, 0x10, 1], bench.now);
    let _ = bench.server.next_frame(bench.now);
    bench.now += 1_001;
    bench.fail(Status::Ready, Faults::NONE);
    let errors = bench.ask(&[0x22, 1, 7]).expect("the errors");
    assert_eq!(errors[3..7], [0, 0, 0, 2], "the empty one and the one that had to wait");
    assert_eq!(errors[15..19], [0, 0, 0, 1], "the request that stayed in pieces");
}

#[test]
fn a_trouble_is_kept_when_its_cause_is_over_and_until_it_is_cleared() {
    let (_, mut bench) = bench();
    bench.fail(Status::Ready, Faults::NONE);
    // The board of these tests has crashed before.
    let crash = [0x5A, 0x03, 0x47];
    let mut listed = vec![0x59, 2, bit::AVAILABLE];
    listed.extend(crash);
    listed.push(0x2F);
    bench.expect(&[0x19, 2, 0xFF], &listed);
    bench.fail(Status::Silent, Faults::NONE);
    bench.fail(Status::Ready, Faults::NONE);
    bench.fail(Status::Silent, Faults::BUS);
    bench.expect(&[0x19, 1, 1], &[0x59, 1, bit::AVAILABLE, 0, 0, 3]);
    bench.fail(Status::Ready, Faults::NONE);
    bench.expect(&[0x19, 1, 1], &[0x59, 1, bit::AVAILABLE, 0, 0, 1]);
    // Silence: came twice, is over.
    bench.expect(&[0x19, 6, 0x5A, 0x01, 0x31, 1], &[0x59, 6, 0x5A, 0x01, 0x31, 0x2E, 1, 2]);
    bench.expect(&[0x14, 0x5A, 0x01, 0x31], &[0x54]);
    bench.fail(Status::Ready, Faults::NONE);
    bench.expect(&[0x19, 6, 0x5A, 0x01, 0x31, 1], &[0x59, 6, 0x5A, 0x01, 0x31, 0, 1, 0]);
    let all = bench.ask(&[0x19, 0x0A]).expect("all troubles");
    assert_eq!(all.len(), 3 + 4 * TROUBLES.len());
    // Stopped, the memory takes nothing; the end of the session starts it again.
    bench.expect(&[0x14, 0xFF, 0xFF, 0xFF], &[0x54]);
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x85, 2], &[0xC5, 2]);
    bench.fail(Status::Stuck, Faults::NONE);
    bench.expect(&[0x19, 1, 8], &[0x59, 1, bit::AVAILABLE, 0, 0, 1]);
    bench.expect(&[0x10, 1], &[0x50, 1, 0, 50, 0x01, 0xF4]);
    bench.fail(Status::Stuck, Faults::NONE);
    bench.expect(&[0x19, 1, 8], &[0x59, 1, bit::AVAILABLE, 0, 0, 2]);
}

#[test]
fn a_trouble_survives_a_restart_with_the_state_in_which_it_came() {
    let (flash, mut bench) = bench();
    // Something has been stored before: there is room without an erase.
    assert_eq!(bench.board.set_configuration(&Configuration::DEFAULT), Ok(()));
    bench.board.observe(
        None,
        1_234,
        (Status::Silent, Faults::GAP),
        &WheelSample::without_speeds(Standstill::Unknown),
        &judged(Standstill::Unknown),
    );
    let operations = flash.borrow().operations();
    bench.server.poll(&mut bench.board, &AllCounters::default(), 0, || None);
    assert!(flash.borrow().operations() > operations);
    // It is stored once, whatever it does afterwards.
    let operations = flash.borrow().operations();
    for _ in 0..10 {
        bench.fail(Status::Ready, Faults::NONE);
        bench.fail(Status::Silent, Faults::GAP);
    }
    assert_eq!(flash.borrow().operations(), operations);
    let mut after = Bench::new(&flash);
    let snapshot = [1, 2, 1, 4, Status::Silent as u8, Faults::GAP.0, 1, 8, 0, 0, 0x04, 0xD2];
    let response = [&[0x59, 4, 0x5A, 0x01, 0x31, 0x28][..], &snapshot].concat();
    after.fail(Status::Ready, Faults::NONE);
    after.expect(&[0x19, 4, 0x5A, 0x01, 0x31, 1], &response);
    after.expect(&[0x14, 0xFF, 0xFF, 0xFF], &[0x54]);
    after.fail(Status::Ready, Faults::NONE);
    let mut cleared = Bench::new(&flash);
    cleared.expect(&[0x19, 4, 0x5A, 0x01, 0x31, 1], &[0x59, 4, 0x5A, 0x01, 0x31, 0]);
}

#[test]
fn a_trouble_erases_nothing_before_a_tester_s_session_at_standstill() {
    let (flash, mut bench) = bench();
    bench.fail(Status::Silent, Faults::NONE);
    assert_eq!(flash.borrow().operations(), 0, "the flash of a new board has no room without an erase");
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.stand();
    bench.fail(Status::Silent, Faults::NONE);
    assert!(flash.borrow().operations() > 0);
    let mut after = Bench::new(&flash);
    after.expect(&[0x19, 6, 0x5A, 0x01, 0x31, 1], &[0x59, 6, 0x5A, 0x01, 0x31, 0x28, 1, 1]);
}

#[test]
fn each_trouble_has_a_code_of_its_own_and_one_condition() {
    for (k, trouble) in TROUBLES.iter().enumerate() {
        assert!(trouble.code < 0xFF_FFFF && !trouble.name.is_empty());
        assert!(TROUBLES[..k].iter().all(|other| other.code != trouble.code), "{:06x}", trouble.code);
    }
    // Other people's tools read them here.
    let description =
        std::fs::read_to_string(workspace().join("tools/gyronet_uds.yaml")).expect("it is there");
    for trouble in &TROUBLES {
        let line =
            format!("  0x{:06X}: {{code: {}, name: \"{}\"}}", trouble.code, trouble.display(), trouble.name);
        assert!(description.contains(&line), "{line}");
        assert!(!trouble.check.is_empty());
    }
}

#[test]
fn messages_are_stopped_at_standstill_and_for_the_length_of_a_session() {
    let (_, mut bench) = bench();
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    let turning = sample(0, [0.0, 0.0, 9.81], 0.3);
    bench.board.observe(
        Some(&turning),
        0,
        (Status::Ready, Faults::NONE),
        &WheelSample::without_speeds(Standstill::Moving),
        &judged(Standstill::Moving),
    );
    bench.expect(&[0x28, 1, 1], &[0x7F, 0x28, 0x22]);
    assert!(!bench.server.is_silenced());
    bench.stand();
    bench.expect(&[0x28, 1, 1], &[0x68, 1]);
    assert!(bench.server.is_silenced());
    bench.expect(&[0x28, 0, 1], &[0x68, 0]);
    assert!(!bench.server.is_silenced());
    bench.expect(&[0x28, 1, 3], &[0x68, 1]);
    bench.now += 5_001;
    bench.fail(Status::Ready, Faults::NONE);
    assert!(!bench.server.is_silenced(), "the session has ended");
}

#[test]
fn a_configuration_is_read_changed_and_written_at_standstill() {
    let (flash, mut bench) = bench();
    let read = bench.ask(&[0x22, 1, 0]).expect("the configuration");
    assert_eq!(read[..4], [0x62, 1, 0, Configuration::VERSION]);
    let found: Configuration = postcard::from_bytes(&read[4..]).expect("as it is stored");
    let changed = Configuration { latitude_deg: Some(-33.9), ..found };
    let mut write = vec![0x2E, 1, 0, Configuration::VERSION];
    write.extend(postcard::to_stdvec(&changed).expect("it fits"));
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    let turning = sample(0, [0.0, 0.0, 9.81], 0.3);
    bench.board.observe(
        Some(&turning),
        0,
        (Status::Ready, Faults::NONE),
        &WheelSample::without_speeds(Standstill::Moving),
        &judged(Standstill::Moving),
    );
    bench.expect(&write, &[0x7F, 0x2E, 0x22]);
    bench.stand();
    bench.expect(&write, &[0x6E, 1, 0]);
    assert_eq!(bench.tester.pending, 2, "a write may erase");
    assert_eq!(start(&flash).configuration(), &changed);
    write[3] += 1;
    bench.expect(&write, &[0x7F, 0x2E, 0x31]);
    let expected = Configuration::VERSION;
    assert_eq!(bench.board.refusal(), Some(Refusal::Version { found: expected + 1, expected }));
    write[3] = expected;
    let far = Configuration { latitude_deg: Some(99.0), ..found };
    write.truncate(4);
    write.extend(postcard::to_stdvec(&far).expect("it fits"));
    bench.expect(&write, &[0x7F, 0x2E, 0x31]);
    // Why, in the board's own words; the next request that is no reading ends them.
    let range = FieldError::Range { field: Field::LatitudeDeg, value: 99.0, low: -90.0, high: 90.0 };
    let refusal = |bench: &mut Bench| -> Option<Refusal> {
        let read = bench.ask(&[0x22, 1, 0x0B]).expect("the reason");
        postcard::from_bytes(&read[3..]).expect("as it is documented")
    };
    assert_eq!(refusal(&mut bench), Some(Refusal::Store(StoreError::Field(range))));
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    assert_eq!(refusal(&mut bench), None);
}

#[test]
fn a_static_calibration_runs_as_a_routine() {
    let (flash, mut bench) = bench();
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x31, 1, 2, 2], &[0x7F, 0x31, 0x22]);
    bench.expect(&[0x31, 1, 2, 0], &[0x71, 1, 2, 0]);
    bench.expect(&[0x31, 3, 2, 0], &[0x71, 3, 2, 0, 1]);
    bench.expect(&[0x31, 3, 2, 1], &[0x7F, 0x31, 0x24]);
    bench.stand();
    bench.expect(&[0x31, 3, 2, 0], &[0x71, 3, 2, 0, 2]);
    bench.expect(&[0x31, 1, 2, 2], &[0x71, 1, 2, 2]);
    assert_eq!(start(&flash).learned(), bench.board.learned());
    assert_ne!(start(&flash).learned(), &gyronet::store::Learned::NOTHING);
}

/// Downloads a file; returns the response to the last step.
fn download(bench: &mut Bench, file: &[u8]) -> Vec<u8> {
    bench.expect(&[0x10, 2], &[0x50, 2, 0, 50, 0x01, 0xF4]);
    bench.stand();
    let [a, b, c, d] = (file.len() as u32).to_be_bytes();
    let granted = bench.ask(&[0x34, 0, 0x44, 0, 0, 0, 0, a, b, c, d]).expect("an answer");
    assert_eq!(granted, [0x74, 0x20, 1, 2]);
    for (number, bytes) in (1u8..=255).chain(0..=255).cycle().zip(file.chunks(256)) {
        let block = [&[0x36, number], bytes].concat();
        bench.expect(&block, &[0x76, number]);
        if number == 7 {
            // The answer was lost; and a block that is not the next one.
            bench.expect(&block, &[0x76, number]);
            bench.expect(&[0x36, 9, 0, 0, 0, 0], &[0x7F, 0x36, 0x73]);
            bench.expect(&[0x37], &[0x7F, 0x37, 0x24]);
        }
    }
    bench.ask(&[0x37]).expect("an answer")
}

#[test]
fn weights_are_downloaded_and_used_after_a_restart() {
    let (flash, mut bench) = bench();
    let file = other_weights(1);
    assert_eq!(download(&mut bench, &file), [&[0x77, 0][..], &crc(&file)].concat(), "slot A");
    bench.expect(&[0x22, 1, 3], &[&[0x62, 1, 3, 1][..], &crc(&weights::DEFAULT.0)].concat());
    bench.expect(&[0x31, 1, 0xFF, 1], &[0x71, 1, 0xFF, 1]);
    bench.expect(&[0x11, 1], &[0x51, 1]);
    assert!(bench.server.restart_is_due());
    let mut after = Bench::new(&flash);
    after.expect(&[0x22, 1, 3], &[&[0x62, 1, 3, 2][..], &crc(&file)].concat());
}

#[test]
fn a_damaged_file_is_not_used() {
    let (flash, mut bench) = bench();
    let mut file = other_weights(1);
    file[5_000] ^= 4;
    assert_eq!(download(&mut bench, &file), [0x7F, 0x37, 0x72]);
    bench.expect(&[0x31, 1, 0xFF, 1], &[0x7F, 0x31, 0x24]);
    // And a session that ends takes the download with it.
    bench.now += 6_000;
    bench.expect(&[0x10, 2], &[0x50, 2, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x36, 1, 0], &[0x7F, 0x36, 0x24]);
    let mut after = Bench::new(&flash);
    after.expect(&[0x22, 1, 3], &[&[0x62, 1, 3, 1][..], &crc(&weights::DEFAULT.0)].concat());
}

fn crc(file: &[u8]) -> [u8; 4] {
    u32::from_le_bytes(*file.last_chunk().expect("a checksum")).to_be_bytes()
}

#[test]
fn a_single_setting_is_refused_and_the_successor_named() {
    let (_, mut bench) = bench();
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.stand();
    for id in [0x01, 0x0C, 0x1E] {
        bench.expect(&[0x22, 2, id], &[0x7F, 0x22, 0x31]);
        bench.expect(&[0x2E, 2, id, 0x42, 0xB4, 0, 0], &[0x7F, 0x2E, 0x31]);
        let refusal = bench.board.refusal().expect("a reason");
        assert_eq!(refusal, Refusal::SingleSetting);
        assert!(refusal.to_string().contains("device set"), "{refusal}");
    }
    // Neither was ever one.
    for id in [0x00, 0x1F] {
        bench.expect(&[0x2E, 2, id, 0], &[0x7F, 0x2E, 0x31]);
        assert_eq!(bench.board.refusal(), None);
    }
}

/// Every identifier of the list answers, and is in the description for testers under the same name.
#[test]
fn the_list_of_identifiers_is_that_of_the_server_and_of_the_description() {
    let (_, mut bench) = bench();
    let description =
        std::fs::read_to_string(workspace().join("tools/gyronet_uds.yaml")).expect("it is there");
    let data = description.split_once("data:").expect("data").1.split_once("routines:").expect("routines").0;
    for Identifier { id, name, access, .. } in &IDENTIFIERS {
        let [high, low] = id.to_be_bytes();
        let response = bench.ask(&[0x22, high, low]).expect("a response");
        let positive = response.starts_with(&[0x62, high, low]);
        assert_eq!(positive, *access != Access::Write, "{id:04X}: {response:02x?}");
        let multi = format!("  0x{id:04X}:\n    name: {name}\n");
        let single = format!("  0x{id:04X}: {{name: {name}, ");
        assert!(data.contains(&multi) || data.contains(&single), "{id:04X} {name}");
    }
    assert_eq!(data.matches("\n  0x").count(), IDENTIFIERS.len());
}

#[test]
fn a_self_test_names_the_parts_that_fail() {
    let (_, mut bench) = bench();
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x31, 1, 2, 4], &[0x71, 1, 2, 4, 1 << 6]);
    bench.seeds = vec![[1; 32]];
    bench.expect(&[0x31, 1, 2, 4], &[0x71, 1, 2, 4, 0]);
    bench.board.sensor(Err(SensorFault::Reset));
    bench.board.weights_damaged();
    bench.expect(&[0x31, 1, 2, 4], &[0x71, 1, 2, 4, 1 << 6 | 1 << 4 | 1 << 2]);
    bench.expect(&[0x31, 3, 2, 4], &[0x7F, 0x31, 0x12]);
}

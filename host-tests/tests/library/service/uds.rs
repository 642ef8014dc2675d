//! The diagnostic server as a tester sees it: sessions, data, troubles, routines and downloads, with the responses of
//! ISO 14229-1 word for word.

use super::access::locked;
use super::{Board, GOOD, LEVEL, observe, sample, start};
use gyronet::coprocessor::Contradiction;
use gyronet::health::{Faults, Quality, Status};
use gyronet::model::weights;
use gyronet::sample::{Standstill, WheelSample};
use gyronet::service::event::SensorFault;
use gyronet::service::message::{AllCounters, Refusal};
use gyronet::standstill::Standing;
use gyronet::store::{Configuration, Record};
use gyronet::uds::Server;
use gyronet::uds::dtc::{PASSED_TICKS, TROUBLES, bit};
use gyronet::units::WheelSpeed;
use gyronet_host_tests::flash::Flash;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::stored::{crc, other_weights};
use gyronet_host_tests::synthetic::judged;
use gyronet_host_tests::tester::{Tester, frame};
use gyronet_host_tests::wire::bytes;
use gyronet_tools::reference::identifiers;

/// A board with its server, and the time in milliseconds.
pub struct Bench {
    server: Server,
    pub board: Board,
    pub now: u32,
    tester: Tester,
    /// The challenges that come next.
    pub seeds: Vec<[u8; 32]>,
    /// False on a board that has no random numbers but those.
    pub is_random: bool,
}

impl Bench {
    pub fn new(flash: &Flash) -> Self {
        Self::of(start(flash))
    }

    pub fn of(board: Board) -> Self {
        let (server, tester, seeds) = (Server::new(), Tester::default(), Vec::new());
        Self { server, board, now: 0, tester, seeds, is_random: true }
    }

    /// Asks over frames, a millisecond each turn.
    pub fn ask(&mut self, request: &[u8]) -> Option<Vec<u8>> {
        self.ask_with(&AllCounters::default(), request)
    }

    fn ask_with(&mut self, counters: &AllCounters, request: &[u8]) -> Option<Vec<u8>> {
        let Self { server, board, now, tester, seeds, is_random } = self;
        tester.ask(request, 400, |frames| {
            frames.iter().for_each(|data| server.receive(data, *now));
            server.poll(board, || *counters, *now, || seeds.pop().or(is_random.then_some([0x5E; 32])));
            *now += 1;
            std::iter::from_fn(|| server.next_frame(*now)).collect()
        })
    }

    /// Asks all servers: a single frame. "Response pending" is counted.
    fn ask_all(&mut self, request: &[u8]) -> Option<Vec<u8>> {
        self.server.receive_functional(&frame(&[request.len() as u8], request), self.now);
        (0..2).find_map(|_| {
            self.server.poll(&mut self.board, AllCounters::default, self.now, || None);
            let answer = self.server.next_frame(self.now)?;
            let is_pending = matches!(answer, [3, 0x7F, _, 0x78, ..]);
            self.tester.pending += usize::from(is_pending);
            (!is_pending).then(|| answer[1..=usize::from(answer[0])].to_vec())
        })
    }

    pub fn turn(&mut self) {
        observe(&mut self.board, 0, Some(&sample(0, LEVEL, 0.3)), GOOD, Standstill::Moving);
    }

    pub fn expect(&mut self, request: &[u8], response: &[u8]) {
        assert_eq!(self.ask(request).as_deref(), Some(response), "{request:02x?}");
    }

    /// Lets a vehicle stand long enough to prove it.
    pub fn stand(&mut self) {
        for k in 0..400 {
            observe(&mut self.board, k, Some(&sample(k.into(), LEVEL, 0.0)), GOOD, Standstill::Still);
        }
    }

    pub fn enter(&mut self, session: u8) {
        self.expect(&[0x10, session], &[0x50, session, 0, 50, 0x01, 0xF4]);
        self.stand();
    }

    fn fail(&mut self, status: Status, faults: Faults) {
        self.fail_at(0, status, faults);
    }

    fn fail_at(&mut self, tick: u32, status: Status, faults: Faults) {
        observe(&mut self.board, tick, None, (status, faults), Standstill::Unknown);
        self.server.poll(&mut self.board, AllCounters::default, self.now, || None);
    }
}

pub fn bench() -> (Flash, Bench) {
    let flash = Flash::default();
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

/// The checks of ISO 14229-1 that each service makes, in the standard's order: a request that fails the check, and its
/// code. Wherever it can, the request also fails a later check. The vehicle moves; `locked` is the extended session of a
/// board with a key.
const CHECKS: &str = "
    default     BA=11 2301=11                                           services that the board does not have
    default     10=13 100900=12 100300=13                               DiagnosticSessionControl
    locked      110200=12 110100=33                                     ECUReset
    default     11=13 110100=13 1101=22
    locked      1401=33                                                 ClearDiagnosticInformation
    default     140102=13 14010203=31
    default     19=13 1942010203=12 1902=13 1906010203=13 190601020301=31  ReadDTCInformation
    default     22=13 221234F1=13 221234FFFF=31                         ReadDataByIdentifier
    default     27=7F                                                   SecurityAccess
    extended    27=13 270300=12 270100=13 270200=13
    locked      2701=22
    default     28=7F                                                   CommunicationControl
    locked      2809=12 2801=33
    extended    28=13 2801=13 280302=31 280301=22
    default     2E=7F                                                   WriteDataByIdentifier
    locked      2E0100=13 2EF18601=31 2E010000=13
    extended    2E01006300=31 2E011A00=31
    default     31=7F 31010205=7F                                       RoutineControl
    locked      31090909=31 3109020500=33
    extended    310902=13 3109FF01=31 31010200=31 3109020500=12 31030204=12
    extended    3101020500=13 31010205=22
    extended    34=7F                                                   RequestDownload
    programming 3410=13 341011=31 3400550004=31 34001100=13 3400110304=31 3400110204=24 3400110004=22
    extended    36=7F 37=7F                                             TransferData, RequestTransferExit
    programming 36=13 3601=24 3700=13 37=24
    default     3E=13 3E0100=12 3E0000=13                               TesterPresent
    default     85=7F                                                   ControlDTCSetting
    extended    85=13
    locked      8509=12 8502=33
";

#[test]
fn each_service_makes_its_checks_in_the_order_of_the_standard() {
    let mut served = [false; 256];
    for line in CHECKS.trim().lines() {
        let mut words = line.split_whitespace();
        let state = words.next().expect("a state");
        let mut bench = if state == "locked" { locked().1 } else { bench().1 };
        bench.is_random = false;
        match state {
            "default" => {}
            "programming" => bench.expect(&[0x10, 2], &[0x50, 2, 0, 50, 0x01, 0xF4]),
            _ => bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]),
        }
        bench.turn();
        for (request, code) in words.filter_map(|word| word.split_once('=')) {
            let (request, code) = (bytes(request), bytes(code)[0]);
            let answer = [0x7F, request[0], code];
            bench.expect(&request, &answer);
            served[usize::from(request[0])] |= code != 0x11;
            // To all servers, what a server does not have or do is refused in silence, unless it asked to wait.
            let pending = bench.tester.pending;
            let to_all = bench.ask_all(&request);
            let is_aloud =
                !matches!(code, 0x11 | 0x12 | 0x31 | 0x7E | 0x7F) || bench.tester.pending > pending;
            assert_eq!(to_all.as_deref(), is_aloud.then_some(&answer[..]), "{line}");
        }
    }
    // No service is left out.
    let (_, mut bench) = bench();
    for service in 0..=u8::MAX {
        let is_served = bench.ask(&[service]) != Some(vec![0x7F, service, 0x11]);
        assert_eq!(is_served, served[usize::from(service)], "{service:02x}");
    }
}

/// A tester on another line has no part in the session, nor in the access that was proven in it.
#[test]
fn a_second_tester_neither_uses_nor_ends_the_session_of_the_first() {
    let (_, mut bench) = bench();
    bench.stand();
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.server.set_guest(true);
    bench.expect(&[0x22, 0xF1, 0x86], &[0x62, 0xF1, 0x86, 1]);
    for request in ["2E010000", "2701", "1003", "1101", "14FFFFFF"].map(bytes) {
        bench.expect(&request, &[0x7F, request[0], 0x22]);
        let reason = postcard::to_stdvec(&Some(Refusal::OtherTester)).expect("short");
        bench.expect(&[0x22, 1, 0x0B], &[&[0x62, 1, 0x0B], &reason[..]].concat());
    }
    bench.server.set_guest(false);
    bench.expect(&[0x22, 0xF1, 0x86], &[0x62, 0xF1, 0x86, 3]);
    bench.fail(Status::Ready, Faults::NONE);
    for refused_owner in [true, false] {
        bench.now += 4_900;
        bench.server.set_guest(true);
        bench.expect(&[0x3E, 0], &[0x7E, 0]);
        // The owner's frames are refused while the other is served.
        bench.server.refuse(refused_owner, bench.now);
        assert!(bench.server.has_session());
    }
    bench.now += 200;
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    assert!(!bench.server.has_session(), "nor keeps it");
}

/// Wheel speeds in 0.01 m/s, 0x7FFF where one is not known; then whether the vehicle stands.
#[test]
fn live_wheel_speeds_are_read_in_centimetres_a_second() {
    let (_, mut bench) = bench();
    let speeds = [Some(WheelSpeed(10 << 16)), Some(WheelSpeed(-(1 << 15))), None, Some(WheelSpeed(0))];
    let wheels = WheelSample { speeds, standstill: Standstill::Moving, ..WheelSample::default() };
    bench.board.observe(Some(&sample(0, LEVEL, 0.0)), 0, GOOD, &wheels, &Standing::UNKNOWN);
    let codes = [0x03, 0xE8, 0xFF, 0xCE, 0x7F, 0xFF, 0, 0];
    bench.expect(&[0x22, 1, 0x17], &[&[0x62, 1, 0x17][..], &codes, &[Standstill::Moving as u8, 0]].concat());
}

/// Case bus/06.
#[test]
fn a_list_with_unknown_identifiers_gives_the_known_ones() {
    let (_, mut bench) = bench();
    for list in [[0xF1, 0x86, 0xFF, 0xFF], [0xFF, 0xFF, 0xF1, 0x86]] {
        bench.expect(&[&[0x22][..], &list].concat(), &[0x62, 0xF1, 0x86, 1]);
    }
}

#[test]
fn requests_to_all_servers_are_counted_where_they_come_between() {
    let (_, mut bench) = bench();
    assert_eq!(bench.ask_all(&[0x3E, 0]), Some(vec![0x7E, 0]));
    assert_eq!(bench.ask_all(&[0x3E, 0x80]), None);
    // One that is no request changes nothing for the next, and all but "tester present" is counted.
    assert_eq!(bench.ask_all(&[]), None);
    bench.expect(&[0xBA], &[0x7F, 0xBA, 0x11]);
    bench.server.receive(&[0x10, 20, 0x22, 1, 0, 1, 1, 1], bench.now);
    bench.server.receive_functional(&[2, 0x3E, 0x80], bench.now);
    (0..2).for_each(|_| bench.server.receive_functional(&[2, 0x10, 1], bench.now));
    let _ = bench.server.next_frame(bench.now);
    bench.now += 1_001;
    bench.fail(Status::Ready, Faults::NONE);
    let errors = bench.ask(&[0x22, 1, 7]).expect("the errors");
    assert_eq!(errors[3..7], [0, 0, 0, 3], "the empty one and the two that had to wait");
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
    bench.expect(&[0x85, 1], &[0xC5, 1]);
    bench.expect(&[0x85, 2], &[0xC5, 2]);
    assert!(bench.server.has_session());
    bench.fail(Status::Stuck, Faults::NONE);
    bench.expect(&[0x19, 1, 8], &[0x59, 1, bit::AVAILABLE, 0, 0, 1]);
    // ISO 14229-1 D.2: not tested since the memory was cleared, nor in this cycle.
    bench.expect(&[0x14, 0xFF, 0xFF, 0xFF], &[0x54]);
    bench.expect(&[0x19, 6, 0x5A, 0x01, 0x31, 1], &[0x59, 6, 0x5A, 0x01, 0x31, 0x50, 1, 0]);
    bench.expect(&[0x10, 1], &[0x50, 1, 0, 50, 0x01, 0xF4]);
    bench.fail(Status::Stuck, Faults::NONE);
    bench.expect(&[0x19, 1, 8], &[0x59, 1, bit::AVAILABLE, 0, 0, 2]);
}

#[test]
fn a_trouble_survives_a_restart_with_the_state_in_which_it_came() {
    let (flash, mut bench) = bench();
    // Something has been stored before: there is room without an erase.
    assert_eq!(bench.board.set_configuration(&Configuration::DEFAULT), Ok(()));
    observe(&mut bench.board, 1_234, None, (Status::Silent, Faults::GAP), Standstill::Unknown);
    let operations = flash.borrow().operations();
    bench.server.poll(&mut bench.board, AllCounters::default, 0, || None);
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
    let response = [&[0x59, 4, 0x5A, 0x01, 0x31, 0x2C][..], &snapshot].concat();
    after.fail(Status::Ready, Faults::NONE);
    after.expect(&[0x19, 4, 0x5A, 0x01, 0x31, 1], &response);
    for is_stored in [true, false] {
        let operations = flash.borrow().operations();
        after.expect(&[0x14, 0x5A, 0x01, 0x31], &[0x54]);
        after.fail(Status::Ready, Faults::NONE);
        assert_eq!(flash.borrow().operations() > operations, is_stored);
    }
    let mut cleared = Bench::new(&flash);
    cleared.expect(&[0x19, 4, 0x5A, 0x01, 0x31, 1], &[0x59, 4, 0x5A, 0x01, 0x31, 0]);
}

/// ISO 14229-1 D.2: pending from the cycle with the fault to the end of the next one without.
#[test]
fn a_trouble_is_pending_for_two_cycles_and_confirmed_until_it_is_cleared() {
    const SILENCE: [u8; 6] = [0x19, 6, 0x5A, 0x01, 0x31, 1];
    let status = |bench: &mut Bench| bench.ask(&SILENCE).expect("the trouble")[5];
    let (flash, mut bench) = bench();
    assert_eq!(bench.board.set_configuration(&Configuration::DEFAULT), Ok(()));
    bench.fail(Status::Silent, Faults::NONE);
    assert_eq!(status(&mut bench), 0x2F);
    bench.fail(Status::Ready, Faults::NONE);
    assert_eq!(status(&mut bench), 0x2E, "over, but of this cycle");
    // A cycle that ends early is none that has passed.
    for ticks in [PASSED_TICKS - 1, PASSED_TICKS] {
        let mut next = Bench::new(&flash);
        next.fail_at(0, Status::Init, Faults::NONE);
        assert_eq!(status(&mut next), 0x2C);
        next.fail_at(ticks, Status::Ready, Faults::NONE);
        assert_eq!(status(&mut next), 0x2C, "until the end of the cycle");
    }
    let mut third = Bench::new(&flash);
    third.fail_at(0, Status::Init, Faults::NONE);
    assert_eq!(status(&mut third), 0x28, "confirmed stays");
    third.fail(Status::Silent, Faults::NONE);
    assert_eq!(status(&mut third), 0x2F);
    assert_eq!(status(&mut Bench::new(&flash)), 0x2C, "pending again");
}

/// Case bus/20: what an erase of the board's own makes its lines miss is no trouble; what lasts longer is.
#[test]
fn a_stall_for_a_request_leaves_no_troubles() {
    let (_, mut bench) = bench();
    bench.expect(&[0x14, 0xFF, 0xFF, 0xFF], &[0x54]);
    bench.enter(3);
    let before = bench.ask(&[0x19, 2, 8]).expect("the crash of these tests");
    let record = postcard::to_stdvec(&Configuration::DEFAULT).expect("it fits");
    bench.expect(&[&[0x2E, 1, 0, Configuration::VERSION][..], &record].concat(), &[0x6E, 1, 0]);
    let stall = Faults::GAP.with(Faults::BUS).with(Faults::WHEELS);
    bench.fail(Status::Silent, stall);
    bench.now += 990;
    bench.fail(Status::Silent, stall);
    assert_eq!(bench.ask(&[0x19, 2, 8]).as_deref(), Some(&before[..]));
    // Another fault is recorded at once, and one that stays after a second.
    bench.fail(Status::Stuck, stall);
    assert_eq!(bench.ask(&[0x19, 2, 8]).map(|all| all.len()), Some(before.len() + 4));
    bench.now += 20;
    bench.fail(Status::Silent, stall);
    assert_eq!(bench.ask(&[0x19, 2, 8]).map(|all| all.len()), Some(before.len() + 4 + 4 * 4));
}

#[test]
fn a_trouble_erases_nothing_before_a_tester_s_session_at_standstill() {
    let (flash, mut bench) = bench();
    bench.fail(Status::Silent, Faults::NONE);
    assert_eq!(flash.borrow().operations(), 0, "the flash of a new board has no room without an erase");
    bench.enter(3);
    bench.fail(Status::Silent, Faults::NONE);
    // Case bus/05: a request in the middle of an erase would be answered late, so the erase waits for one.
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    assert_eq!((flash.borrow().operations(), bench.tester.pending), (0, 0));
    bench.expect(&[0x22, 0xF1, 0x86], &[0x62, 0xF1, 0x86, 3]);
    assert!(flash.borrow().operations() > 0);
    assert_eq!(bench.tester.pending, 1, "the tester was told to wait");
    bench.expect(&[0x22, 0xF1, 0x86], &[0x62, 0xF1, 0x86, 3]);
    assert_eq!(bench.tester.pending, 1);
    let mut after = Bench::new(&flash);
    after.expect(&[0x19, 6, 0x5A, 0x01, 0x31, 1], &[0x59, 6, 0x5A, 0x01, 0x31, 0x2C, 1, 1]);
}

/// C1A01-54 and C1A01-92: ten minutes of driving without a good rate, and without a fault that says why.
#[test]
fn a_rate_that_is_never_good_is_a_trouble() {
    const TEN_MINUTES: usize = 60_000;
    let [driving, parked] = [Standstill::Moving, Standstill::Still].map(judged);
    for (status, code) in [(Status::Init, 0x54), (Status::Ready, 0x92)] {
        let (_, mut bench) = bench();
        let is_present = |bench: &mut Bench| {
            bench.fail(status, Faults::NONE);
            bench.ask(&[0x19, 6, 0x5A, 0x01, code, 1]).expect("it is known")[5] & bit::FAILED != 0
        };
        let drive = |bench: &mut Bench, samples| {
            (0..samples).for_each(|_| bench.board.rated(Quality::Degraded, &driving));
        };
        (0..TEN_MINUTES).for_each(|_| bench.board.rated(Quality::Degraded, &parked));
        assert!(!is_present(&mut bench), "a parked board has nothing to wait for");
        drive(&mut bench, TEN_MINUTES - 1);
        assert!(!is_present(&mut bench));
        drive(&mut bench, 1);
        assert!(is_present(&mut bench));
        // A good rate ends it, and a fault, which has a trouble of its own.
        bench.board.rated(Quality::Good, &driving);
        assert!(!is_present(&mut bench));
        drive(&mut bench, TEN_MINUTES);
        bench.fail(status, Faults::GAP);
        bench.board.rated(Quality::Degraded, &driving);
        assert!(!is_present(&mut bench));
    }
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
    bench.turn();
    bench.expect(&[0x28, 1, 1], &[0x7F, 0x28, 0x22]);
    assert!(!bench.server.is_silenced());
    bench.stand();
    // Case bus/14: with 03 and 02 a tester also names what a server receives, which goes on.
    for (sub, is_silenced) in [(1, true), (0, false), (3, true), (2, false)] {
        bench.expect(&[0x28, sub, 1], &[0x68, sub]);
        assert_eq!(bench.server.is_silenced(), is_silenced, "{sub}");
    }
    assert_eq!(bench.ask_all(&[0x28, 0x83, 1]), None);
    assert!(bench.server.is_silenced());
    bench.turn();
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    assert!(!bench.server.is_silenced(), "a vehicle that moves has its messages");
    bench.stand();
    bench.expect(&[0x28, 1, 3], &[0x68, 1]);
    bench.now += 5_001;
    bench.fail(Status::Ready, Faults::NONE);
    assert!(!bench.server.is_silenced(), "the session has ended");
}

/// Downloads a file; returns the response to the last step.
pub fn download(bench: &mut Bench, file: &[u8]) -> Vec<u8> {
    bench.enter(2);
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
    assert_eq!(download(&mut bench, &file), [&[0x77, 0][..], &crc(&file).to_be_bytes()].concat(), "slot A");
    bench.expect(&[0x22, 1, 3], &[&[0x62, 1, 3, 1][..], &crc(&weights::DEFAULT.0).to_be_bytes()].concat());
    bench.expect(&[0x31, 1, 0xFF, 1], &[0x71, 1, 0xFF, 1]);
    assert!(bench.server.is_idle() && !bench.server.restart_is_due());
    bench.expect(&[0x11, 1], &[0x51, 1]);
    assert!(bench.server.restart_is_due());
    bench.server.receive(&frame(&[0x10, 20], &[]), bench.now);
    assert!(!bench.server.is_idle() && !bench.server.restart_is_due(), "a request is being received");
    let mut after = Bench::new(&flash);
    after.expect(&[0x22, 1, 3], &[&[0x62, 1, 3, 2][..], &crc(&file).to_be_bytes()].concat());
}

#[test]
fn a_single_setting_is_refused_and_the_successor_named() {
    let (_, mut bench) = bench();
    bench.enter(3);
    for id in [0x01, 0x0C, 0x1E] {
        bench.expect(&[0x22, 2, id], &[0x7F, 0x22, 0x31]);
        bench.expect(&[0x2E, 2, id, 0x42, 0xB4, 0, 0], &[0x7F, 0x2E, 0x31]);
        let refusal = bench.board.refusal().expect("a reason");
        assert_eq!(refusal, Refusal::SingleSetting);
        assert!(refusal.to_string().contains("device set"), "{refusal}");
    }
    // A configuration of another version is refused by its number, until the next request that is no reading.
    let (found, expected) = (Configuration::VERSION + 1, Configuration::VERSION);
    bench.expect(&[0x2E, 1, 0, found, 0], &[0x7F, 0x2E, 0x31]);
    let reason = postcard::to_stdvec(&Some(Refusal::Version { found, expected })).expect("short");
    bench.expect(&[0x22, 1, 0x0B], &[&[0x62, 1, 0x0B], &reason[..]].concat());
    bench.expect(&[0x3E, 0], &[0x7E, 0]);
    assert_eq!(bench.board.refusal(), None);
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
    let identifiers = identifiers().rows;
    for row in &identifiers {
        let (id, name) = (u16::from_str_radix(&row[0], 16).expect("an identifier"), &row[1]);
        let [high, low] = id.to_be_bytes();
        let response = bench.ask(&[0x22, high, low]).expect("a response");
        let positive = response.starts_with(&[0x62, high, low]);
        assert_eq!(positive, row[4].starts_with("0x22"), "{id:04X}: {response:02x?}");
        let multi = format!("  0x{id:04X}:\n    name: {name}\n");
        let single = format!("  0x{id:04X}: {{name: {name}, ");
        assert!(data.contains(&multi) || data.contains(&single), "{id:04X} {name}");
    }
    assert_eq!(data.matches("\n  0x").count(), identifiers.len());
}

#[test]
fn a_contradiction_is_read_with_its_numbers() {
    let (_, mut bench) = bench();
    let mut read = |contradiction| {
        let counters = AllCounters { contradiction, ..AllCounters::default() };
        bench.ask_with(&counters, &[0x22, 1, 0x1B]).expect("an answer")[3..].to_vec()
    };
    let seen = Contradiction { seconds: 7, gyros: [Some(500), None], lateral: Some(-100), wheels: None };
    let none = [0x7F, 0xFF];
    assert_eq!(read(seen), [&[0, 0, 0, 7, 0x01, 0xF4], &none[..], &[0xFF, 0x9C], &none, &none].concat());
    let seen =
        Contradiction { gyros: [None, Some(-2)], wheels: Some([1500, 11]), ..Contradiction::default() };
    let numbers = [&none[..], &[0xFF, 0xFE], &none, &[0x05, 0xDC, 0, 11]].concat();
    assert_eq!(read(seen), [&[0; 4], &numbers[..]].concat());
}

#[test]
fn a_self_test_names_the_parts_that_fail() {
    let (_, mut bench) = bench();
    bench.is_random = false;
    bench.expect(&[0x10, 3], &[0x50, 3, 0, 50, 0x01, 0xF4]);
    bench.expect(&[0x31, 1, 2, 4], &[0x71, 1, 2, 4, 1 << 6]);
    bench.seeds = vec![[1; 32]];
    bench.expect(&[0x31, 1, 2, 4], &[0x71, 1, 2, 4, 0]);
    bench.board.sensor(Err(SensorFault::Reset));
    bench.board.weights_damaged();
    bench.expect(&[0x31, 1, 2, 4], &[0x71, 1, 2, 4, 1 << 6 | 1 << 4 | 1 << 2]);
    bench.expect(&[0x31, 3, 2, 4], &[0x7F, 0x31, 0x12]);
}

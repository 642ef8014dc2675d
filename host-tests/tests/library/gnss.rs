//! A GNSS receiver on a line of its own: bytes by the documents, damage, and the same drive as with frames.

use gyronet::can::DataFrame;
use gyronet::coprocessor::{Clock, Config, Coprocessor, InputError};
use gyronet::heading::{
    Fix, GnssLine, GnssProtocol, GnssSettings, Heading, HeadingConfigError, HeadingError, HeadingReceiver,
    HeadingSettings, Refusal,
};
use gyronet::model::Estimate;
use gyronet::sensor::ByteSource;
use gyronet::units::Micros;
use gyronet_host_tests::gnss::{Pvt, sentence, sources, ubx};
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::winding::Winding;
use gyronet_host_tests::wire::{bytes, feed};

/// 36 km/h (0.15 m/s) to 210 deg (0.8), in Zurich, with 14 satellites.
const PVT: &str = "b5620107 5c0015cd 5b07e807 0511091a 21371900 0000b817 feff0301 ea0e285c 17052824 3d1c10fd
    0600c039 06008403 00007805 00002cde ffff78ec ffff7800 00001027 0000406f 40019600 00008038 01008700 00000000
    00000000 00000000 00004321";
const RMC: &str = "GNRMC,092633.00,A,4722.61400,N,00832.50200,E,19.438,210.00,170524,,,A,V";
const VTG: &str = "GPVTG,210.00,T,,M,19.438,N,36.000,K,D";
const UBX: GnssSettings = GnssSettings { protocol: GnssProtocol::Ubx, baud: 38_400 };

type Fixes = Vec<Result<Fix, HeadingError>>;

fn read(protocol: GnssProtocol, bytes: &[u8]) -> Fixes {
    feed(&mut GnssLine::new(protocol), bytes)
}

fn pvt(message: Pvt) -> Result<Fix, HeadingError> {
    read(GnssProtocol::Ubx, &message.bytes())[0]
}

/// What one sentence holds; `None` where it is passed over.
fn nmea(body: &str) -> Option<Result<Fix, HeadingError>> {
    read(GnssProtocol::Nmea, &sentence(body)).first().copied()
}

fn is_near(found: Option<f32>, expected: f32) -> bool {
    found.is_some_and(|found| (found - expected).abs() <= 1e-6 * expected)
}

#[test]
fn nav_pvt_by_its_bytes() {
    let frame = bytes(PVT);
    let [Ok(Fix { heading: Some(heading), latitude: Ok(latitude) })] = read(GnssProtocol::Ubx, &frame)[..]
    else {
        panic!()
    };
    assert!(is_near(heading.course, 210f32.to_radians()) && is_near(heading.speed, 10.0), "{heading:?}");
    assert!(is_near(heading.course_sigma, 0.8f32.to_radians()) && is_near(heading.speed_sigma, 0.15));
    assert!(is_near(latitude, 47.3769), "{latitude:?}");
    assert_eq!(pvt(Pvt::GOOD), read(GnssProtocol::Ubx, &frame)[0]);

    // Courses of some receivers are negative to the west.
    let west = pvt(Pvt { course: -9_000_000, ..Pvt::GOOD }).expect("a fix").heading.expect("a course");
    assert!(is_near(west.course, 270f32.to_radians()));
    assert_eq!(pvt(Pvt { more_flags: 1, ..Pvt::GOOD }).expect("a fix").latitude, Ok(None));
    for fix in [0, 5, 6] {
        assert_eq!(pvt(Pvt { fix, ..Pvt::GOOD }), Ok(Fix::NONE), "{fix}");
    }
    assert_eq!(pvt(Pvt { flags: 0xFE, ..Pvt::GOOD }), Ok(Fix::NONE));
    for fix in [1, 4] {
        assert_eq!(pvt(Pvt { fix, ..Pvt::GOOD }), Err(HeadingError::Reckoned));
    }
    // Of an older receiver.
    let old = [&ubx([1, 7], &[0; 84])[..], &frame].concat();
    assert!(matches!(read(GnssProtocol::Ubx, &old)[..], [Err(HeadingError::Length(84)), Ok(_)]));
}

#[test]
fn sentences_by_their_text() {
    let Some(Ok(Fix { heading: Some(rmc), latitude: Ok(latitude) })) = nmea(RMC) else { panic!() };
    assert_eq!(sentence(RMC)[RMC.len() + 1..], *b"*38\r\n");
    assert!(is_near(rmc.course, 210f32.to_radians()) && is_near(latitude, 47.3769), "{rmc:?} {latitude:?}");
    assert!((rmc.speed.expect("known") - 10.0).abs() < 3e-4);
    assert_eq!((rmc.course_sigma, rmc.speed_sigma), (None, None));
    let vtg = nmea(VTG).expect("no RMC").expect("a fix");
    assert_eq!(vtg, with(rmc));

    let south = nmea(&RMC.replace(",N,", ",S,")).expect("used").expect("a fix");
    assert_eq!(south.latitude, Ok(latitude.map(|north| -north)));
    // A vehicle that stands has no course.
    assert_eq!(nmea("GPRMC,092633,A,,,,,,,170524,,,A").expect("used"), Ok(with(Heading::UNKNOWN)));
    // Without a mode nobody knows what a course is made of.
    for old in ["GPRMC,092633,A,,,,,,,170524,,", "GPVTG,,T,,M,0.004,N,0.008,K", "GNRMC"] {
        assert_eq!(nmea(old), Some(Err(HeadingError::Field("mode"))), "{old}");
    }
    // No satellites, a warning, a simulator.
    for none in ["V,N", "V,A", "A,N", "A,S", "A,M"] {
        let (status, mode) = none.split_once(',').expect("two");
        let body = RMC.replace(",A,4722", &format!(",{status},4722")).replace(",,A,", &format!(",,{mode},"));
        assert_eq!(nmea(&body), Some(Ok(Fix::NONE)), "{body}");
    }
    for reckoned in [RMC.replace(",,A,", ",,E,"), VTG.replace("K,D", "K,E")] {
        assert_eq!(nmea(&reckoned), Some(Err(HeadingError::Reckoned)));
    }
    for bad in ["21x", "-1", "9999999999", "1.x", ".", "5.", ".5", "1.2.3"] {
        let refused = nmea(&RMC.replace("210.00", bad));
        assert_eq!(refused, Some(Err(HeadingError::Field("course"))), "{bad}");
    }
    assert_eq!(nmea(&RMC.replace("210.00", "210.000000000000")), nmea(RMC));
    // A bad latitude leaves the course as it is.
    for (good, bad) in [(",N,", ",,"), ("4722.61400", "4760.00000"), ("4722.61400", "47x")] {
        let latitude = Err(HeadingError::Field("latitude"));
        assert_eq!(nmea(&RMC.replace(good, bad)), Some(Ok(Fix { latitude, ..with(rmc) })), "{bad}");
    }
    assert_eq!(nmea(&VTG.replace(",T,", ",M,")), Some(Err(HeadingError::Field("course"))));
}

fn with(heading: Heading) -> Fix {
    Fix { heading: Some(heading), latitude: Ok(None) }
}

#[test]
fn other_messages_and_talkers_are_passed_over() {
    let mut line = GnssLine::new(GnssProtocol::Ubx);
    // A position, a list of satellites that is longer than all that is read, and text.
    let stream = [ubx([1, 2], &[7; 28]), ubx([1, 0x35], &[9; 300]), sentence(RMC), bytes(PVT)].concat();
    assert!(matches!(feed(&mut line, stream)[..], [Ok(_)]));
    assert_eq!(line.bad_checksums(), 0);
    let mut line = GnssLine::new(GnssProtocol::Nmea);
    let others = ["GNGGA,092633.00,4722.6", "HERMC,1,A", "PUBX,00", "IIVTG,1", "RMC", "", "GNRM"];
    assert_eq!(feed(&mut line, others.map(sentence).concat()), []);
    // RMC and VTG of a fix have one course; VTG counts once RMC has none.
    let [rmc, vtg] = [RMC, VTG].map(|body| sentence(&body.replace("GP", "GN")));
    assert_eq!(feed(&mut line, [&rmc[..], &vtg].concat().repeat(9)).len(), 9);
    assert_eq!(feed(&mut line, vtg.repeat(20)).len(), 18);
    let empty = sentence(&RMC.replace("210.00", ""));
    feed(&mut line, rmc.clone());
    assert_eq!(feed(&mut line, [&empty[..], &vtg].concat().repeat(20)).len(), 20 + 17);
    // One talker of two, until it is silent.
    assert_eq!(feed(&mut line, [&rmc[..], &sentence(VTG)].concat().repeat(60)).len(), 60);
    assert_eq!(feed(&mut line, sentence(&RMC.replace("GN", "GP")).repeat(60)).len(), 11);
}

/// Damage of one message costs that message, is an error, and never the next one.
#[test]
fn damaged_messages_are_refused_and_the_next_one_is_read() {
    for (protocol, good) in [(GnssProtocol::Ubx, bytes(PVT)), (GnssProtocol::Nmea, sentence(RMC))] {
        let expected = read(protocol, &good)[0];
        let check = |damaged: &[u8], what: &str| {
            let fixes = read(protocol, &[damaged, &good].concat());
            let (errors, last) = fixes.split_at(fixes.len() - 1);
            assert_eq!(last, [expected], "{what}");
            let is_damage =
                |error: &Result<_, _>| matches!(error, Err(HeadingError::Checksum | HeadingError::Length(_)));
            assert!(errors.iter().all(is_damage), "{what}: {errors:?}");
            errors.len()
        };
        let mut seen = 0;
        for bit in 0..8 * good.len() {
            let mut flipped = good.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            seen += usize::from(check(&flipped, &format!("bit {bit}")) > 0);
        }
        // Without its first bytes, or with a length that none has, it is no message.
        let unseen = if protocol == GnssProtocol::Ubx { 28 } else { 0 };
        assert_eq!(8 * good.len() - seen, unseen, "{protocol:?}");
        for len in 1..good.len() {
            let errors = check(&good[..len], &format!("cut after {len}"));
            assert!(errors > 0 || len < 6, "cut after {len}");
            check(&good[len..], &format!("from {len} on"));
            check(&[&good[..len], &[0xA5], &good[len..]].concat(), &format!("a byte before {len}"));
        }
    }
    let long = [&sentence(RMC)[..40], &[b'0'; 100]].concat();
    let fixes = read(GnssProtocol::Nmea, &[&long[..], &sentence(RMC)].concat());
    assert!(matches!(fixes[..], [Err(HeadingError::Length(100)), Ok(_)]), "{fixes:?}");
    // At another bit rate, or of the other protocol, only noise arrives.
    let mut noise = bytes(PVT).repeat(20);
    noise.iter_mut().for_each(|byte| *byte = byte.rotate_left(3) ^ 0x5A);
    assert!(!read(GnssProtocol::Ubx, &noise).iter().any(Result::is_ok));
    let text = read(GnssProtocol::Nmea, &[&noise[..], b"\n"].concat());
    assert!(!text.is_empty() && text.iter().all(Result::is_err));
}

#[test]
fn a_message_that_the_line_has_damaged_is_dropped() {
    for (protocol, good) in [(GnssProtocol::Ubx, bytes(PVT)), (GnssProtocol::Nmea, sentence(RMC))] {
        let mut line = GnssLine::new(protocol);
        let (begin, end) = good.split_at(30);
        assert_eq!(feed(&mut line, begin.to_vec()), []);
        line.interrupt();
        let fixes = feed(&mut line, [end, &good].concat());
        assert_eq!(fixes.iter().filter(|fix| fix.is_ok()).count(), 1, "{fixes:?}");
    }
}

/// Drives with ten courses a second, and returns the frames with the number of courses used.
fn drive(settings: HeadingSettings, clock: Clock) -> (Vec<DataFrame>, u32) {
    let (mut vehicle, mut sent, mut line) = (Winding::new(7), Sent::default(), GnssLine::new(UBX.protocol));
    let heading = Some(HeadingReceiver::new(settings, None));
    let mut coprocessor = Coprocessor::new(Config { heading, clock, ..Config::DEFAULT });
    for tick in 0..4_000 {
        let sample = vehicle.sample();
        if tick % 10 == 7 {
            let now = sample.time;
            let pvt = vehicle.pvt();
            for frame in pvt.frames() {
                assert_eq!(coprocessor.can(&frame, now), Ok(settings.line.is_none()));
            }
            for fix in feed(&mut line, pvt.bytes()).into_iter().filter(|_| settings.line.is_some()) {
                coprocessor.gnss(fix, now).expect("it is used");
            }
        }
        let _ = coprocessor.imu(sample, sample.time, &mut sent).expect("in order");
        while let Some(due) = coprocessor.window() {
            coprocessor.deliver(due.end, Estimate::NONE).expect("the window that is due");
        }
    }
    let used = coprocessor.course_state().counters.used;
    (sent.frames.iter().map(|sent| sent.frame).collect(), used)
}

#[test]
fn a_line_gives_the_same_frames_as_the_bus_by_both_clocks() {
    for clock in [Clock::Outside, Clock::Sensor] {
        let [line, bus] = sources(UBX).map(|settings| drive(settings, clock));
        assert!(line == bus, "{clock:?}: {} and {} courses", line.1, bus.1);
        assert!(line.1 > 250, "{clock:?}: {}", line.1);
    }
}

#[test]
fn what_is_not_used_is_counted() {
    let mut receiver = HeadingReceiver::new(sources(UBX)[0], None);
    let heading = Some(receiver);
    let mut coprocessor = Coprocessor::new(Config { heading, ..Config::DEFAULT });
    let mut take = |fix| coprocessor.gnss(fix, Micros(0));
    let reckoned = HeadingError::Reckoned;
    assert_eq!(take(Err(reckoned)), Err(InputError::Heading(reckoned)));
    assert_eq!(take(Ok(Fix::NONE)), Ok(()));
    let fast = pvt(Pvt { speed: 151_000, ..Pvt::GOOD });
    assert!(matches!(take(fast), Err(InputError::Heading(HeadingError::Range { what: "speed", .. }))));
    assert!(take(pvt(Pvt { latitude: 900_000_001 + 100, ..Pvt::GOOD })).is_err());
    assert!(take(Err(HeadingError::Checksum)).is_err());
    let course = coprocessor.course_state();
    assert_eq!((course.counters.refused, course.refusal), (1, Some(Refusal::Reckoned)));
    assert_eq!(coprocessor.input_counters().heading_errors, 3);
    // A latitude that is refused leaves the course as it is.
    for degrees in [47, -47] {
        let fix = pvt(Pvt { latitude: degrees * 10_000_000, ..Pvt::GOOD });
        let judged = (0..11).map(|_| receiver.judge(fix.expect("a fix"), Micros(0)).expect("a course"));
        let last = judged.map(|read| (read.heading.is_some(), read.latitude.is_ok())).collect::<Vec<_>>();
        assert_eq!((last[0], last[10]), ((true, degrees > 0), (true, true)), "{degrees}");
    }
    // A receiver is silent ten seconds after its last good message, and has a minute to start.
    let second = |seconds: u64| Micros(1_000_000 * seconds);
    let silent = |coprocessor: &mut Coprocessor, seconds| {
        coprocessor.poll(second(seconds), &mut Sent::default()).expect("in order");
        coprocessor.course_state().is_silent
    };
    assert!(!silent(&mut coprocessor, 10) && silent(&mut coprocessor, 11));
    let _ = coprocessor.gnss(Err(HeadingError::Checksum), second(11));
    assert!(silent(&mut coprocessor, 11));
    let _ = coprocessor.gnss(Err(reckoned), second(12));
    assert!(!silent(&mut coprocessor, 22) && silent(&mut coprocessor, 23));
    let mut started = Coprocessor::new(Config { heading, ..Config::DEFAULT });
    assert!(!silent(&mut started, 100) && !silent(&mut started, 160) && silent(&mut started, 161));
    // It works without satellites.
    started.gnss(Ok(Fix::NONE), second(161)).expect("a message");
    assert!(!silent(&mut started, 171) && silent(&mut started, 172));
    // Without a line in the settings there is none; a speed alone is no course, and keeps no course alive.
    let bus = sources(UBX)[1];
    for (settings, is_source) in [
        (HeadingSettings::NONE, false),
        (HeadingSettings { course: None, course_sigma: None, ..bus }, false),
        (HeadingSettings { nmea2000: true, ..HeadingSettings::NONE }, true),
        (HeadingSettings { j1939: true, ..HeadingSettings::NONE }, true),
        (bus, true),
    ] {
        let heading = Some(HeadingReceiver::new(settings, None));
        let mut coprocessor = Coprocessor::new(Config { heading, ..Config::DEFAULT });
        assert_eq!(coprocessor.gnss(Err(reckoned), second(1)), Ok(()));
        let [speed, course] = Pvt::GOOD.frames();
        coprocessor.can(&speed, second(60)).expect("in range");
        assert!(!silent(&mut coprocessor, 61));
        assert_eq!(silent(&mut coprocessor, 62), is_source, "{settings:?}");
        coprocessor.can(&course, second(62)).expect("in range");
        assert_eq!(silent(&mut coprocessor, 62), is_source && settings != bus, "{settings:?}");
    }
    assert_eq!(Coprocessor::new(Config::DEFAULT).gnss(Err(reckoned), Micros(0)), Ok(()));
}

#[test]
fn a_line_and_frames_are_refused_by_name() {
    let [line, bus] = sources(UBX);
    let check = |settings: HeadingSettings| settings.check(std::iter::empty());
    assert_eq!((check(line), check(bus)), (Ok(()), Ok(())));
    let both = [bus, HeadingSettings { nmea2000: true, ..line }, HeadingSettings { j1939: true, ..line }];
    for settings in both {
        let refused = check(HeadingSettings { line: line.line, ..settings });
        assert_eq!(refused, Err(HeadingConfigError::TwoSources));
    }
    for (baud, is_good) in [(0, false), (4_799, false), (4_800, true), (460_800, true), (460_801, false)] {
        let settings = HeadingSettings { line: Some(GnssSettings { baud, ..UBX }), ..HeadingSettings::NONE };
        assert_eq!(check(settings), if is_good { Ok(()) } else { Err(HeadingConfigError::Baud(baud)) });
    }
}

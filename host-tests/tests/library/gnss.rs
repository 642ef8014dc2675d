//! A GNSS receiver on a line of its own: bytes by the documents, damage, and the same drive as with frames.

use gyronet::can::DataFrame;
use gyronet::coprocessor::{Clock, Config, Coprocessor, InputError};
use gyronet::heading::{
    Fix, GnssLine, GnssProtocol, GnssSettings, Heading, HeadingConfigError, HeadingError, HeadingReceiver,
    HeadingSettings, Refusal,
};
use gyronet::sensor::ByteSource;
use gyronet::units::Micros;
use gyronet_host_tests::gnss::{Pvt, sentence, sources, ubx};
use gyronet_host_tests::sent::Sent;
use gyronet_host_tests::stream::constant;
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
    let [Ok(Fix { heading: Some(heading), latitude })] = read(GnssProtocol::Ubx, &frame)[..] else {
        panic!()
    };
    assert!(is_near(heading.course, 210f32.to_radians()) && is_near(heading.speed, 10.0), "{heading:?}");
    assert!(is_near(heading.course_sigma, 0.8f32.to_radians()) && is_near(heading.speed_sigma, 0.15));
    assert!(is_near(latitude, 47.3769), "{latitude:?}");
    assert_eq!(pvt(Pvt::GOOD), read(GnssProtocol::Ubx, &frame)[0]);

    // Courses of some receivers are negative to the west.
    let west = pvt(Pvt { course: -9_000_000, ..Pvt::GOOD }).expect("a fix").heading.expect("a course");
    assert!(is_near(west.course, 270f32.to_radians()));
    assert_eq!(pvt(Pvt { more_flags: 1, ..Pvt::GOOD }).expect("a fix").latitude, None);
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
    let Some(Ok(Fix { heading: Some(rmc), latitude })) = nmea(RMC) else { panic!() };
    assert_eq!(sentence(RMC)[RMC.len() + 1..], *b"*38\r\n");
    assert!(is_near(rmc.course, 210f32.to_radians()) && is_near(latitude, 47.3769), "{rmc:?} {latitude:?}");
    assert!((rmc.speed.expect("known") - 10.0).abs() < 3e-4);
    assert_eq!((rmc.course_sigma, rmc.speed_sigma), (None, None));
    let vtg = nmea(VTG).expect("no RMC").expect("a fix");
    assert_eq!(vtg, Fix { heading: Some(rmc), latitude: None });

    let south = nmea(&RMC.replace(",N,", ",S,")).expect("used").expect("a fix");
    assert_eq!(south.latitude, latitude.map(|north| -north));
    // Without a mode; without a course, which a vehicle that stands has not.
    assert_eq!(nmea("GPRMC,092633,A,,,,,,,170524,,").expect("used"), Ok(with(Heading::default())));
    assert_eq!(nmea("GPVTG,,T,,M,0.004,N,0.008,K").expect("used").expect("a fix").latitude, None);
    // No satellites, a warning, a simulator.
    for none in ["V,N", "V,A", "A,N", "A,S", "A,M"] {
        let (status, mode) = none.split_once(',').expect("two");
        let body = RMC.replace(",A,4722", &format!(",{status},4722")).replace(",,A,", &format!(",,{mode},"));
        assert_eq!(nmea(&body), Some(Ok(Fix::NONE)), "{body}");
    }
    for reckoned in [RMC.replace(",,A,", ",,E,"), VTG.replace("K,D", "K,E")] {
        assert_eq!(nmea(&reckoned), Some(Err(HeadingError::Reckoned)));
    }
    for (field, bad) in
        [("210.00", "21x"), ("210.00", "-1"), ("210.00", "9999999999"), ("210.00", "1.9999999999")]
    {
        assert_eq!(nmea(&RMC.replace(field, bad)), Some(Err(HeadingError::Field("course"))), "{bad}");
    }
    assert_eq!(nmea(&RMC.replace(",N,", ",,")), Some(Err(HeadingError::Field("latitude"))));
    assert_eq!(nmea(&VTG.replace(",T,", ",M,")), Some(Err(HeadingError::Field("course"))));
    assert_eq!(nmea("GNRMC"), Some(Ok(Fix::NONE)));
}

fn with(heading: Heading) -> Fix {
    Fix { heading: Some(heading), latitude: None }
}

#[test]
fn other_messages_and_talkers_are_passed_over() {
    let mut line = GnssLine::new(GnssProtocol::Ubx);
    // A position, a list of satellites that is longer than all that is read, and text.
    let stream = [ubx([1, 2], &[7; 28]), ubx([1, 0x35], &[9; 300]), sentence(RMC), bytes(PVT)].concat();
    assert!(matches!(feed(&mut line, stream)[..], [Ok(_)]));
    assert_eq!((line.others(), line.bad_checksums()), (1, 0));
    let mut line = GnssLine::new(GnssProtocol::Nmea);
    let others = ["GNGGA,092633.00,4722.6", "HERMC,1,A", "PUBX,00", "IIVTG,1", "RMC", "", "GNRM"];
    assert_eq!(feed(&mut line, others.map(sentence).concat()), []);
    assert_eq!(line.others(), 7);
    // RMC and VTG of a fix have one course; VTG counts once no RMC comes.
    let both = [sentence(RMC), sentence(VTG), sentence(RMC), sentence(VTG)].concat();
    assert_eq!(feed(&mut line, both).len(), 2);
    assert_eq!(feed(&mut line, sentence(VTG).repeat(80)).len(), 21);
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
        assert!(seen >= 8 * good.len() - 28, "{seen} errors");
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
            let estimate = constant(0.0)(&due).expect("an estimate");
            coprocessor.deliver(due.end, estimate).expect("the window that is due");
        }
    }
    let used = coprocessor.pipeline().course_state().counters.used;
    (sent.frames.iter().map(|sent| sent.frame).collect(), used)
}

#[test]
fn a_line_gives_the_same_frames_as_the_bus_by_both_clocks() {
    for clock in [Clock::Outside, Clock::Sensor] {
        let [line, bus] = sources(UBX).map(|settings| drive(settings, clock));
        assert!(line == bus && line.1 >= 250, "{clock:?}: {} and {} courses", line.1, bus.1);
    }
}

#[test]
fn what_is_not_used_is_counted() {
    let heading = Some(HeadingReceiver::new(sources(UBX)[0], None));
    let mut coprocessor = Coprocessor::new(Config { heading, ..Config::DEFAULT });
    let mut take = |fix| coprocessor.gnss(fix, Micros(0));
    let reckoned = HeadingError::Reckoned;
    assert_eq!(take(Err(reckoned)), Err(InputError::Heading(reckoned)));
    assert_eq!(take(Ok(Fix::NONE)), Ok(()));
    let fast = pvt(Pvt { speed: 151_000, ..Pvt::GOOD });
    assert!(matches!(take(fast), Err(InputError::Heading(HeadingError::Range { what: "speed", .. }))));
    assert!(take(pvt(Pvt { latitude: 900_000_001 + 100, ..Pvt::GOOD })).is_err());
    assert!(take(Err(HeadingError::Checksum)).is_err());
    let course = coprocessor.pipeline().course_state();
    assert_eq!((course.counters.refused, course.refusal), (1, Some(Refusal::Reckoned)));
    assert_eq!(coprocessor.input_counters().heading_errors, 3);
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
    assert!(!silent(&mut started, 60) && silent(&mut started, 61));
    // Without a line in the settings there is none.
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
    for baud in [0, 4_799, 460_801] {
        let line = Some(GnssSettings { baud, ..UBX });
        assert_eq!(
            check(HeadingSettings { line, ..HeadingSettings::NONE }),
            Err(HeadingConfigError::Baud(baud))
        );
    }
}

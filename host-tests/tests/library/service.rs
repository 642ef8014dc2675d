//! The service line against the board's own code on a mock flash: every request, every refusal,
//! noise, and the frame format byte by byte.

use gyronet::can::config::{ConfigError, Settings};
use gyronet::health::Status;
use gyronet::model::weights;
use gyronet::sample::{ImuSample, PERIOD_US, Standstill, Validity};
use gyronet::service::calibrate::{CalibrationFault, State, Task};
use gyronet::service::crash::FILE;
use gyronet::service::event::{Crash, CrashKind, EventKind, ResetCause, SensorFault};
use gyronet::service::frame::{Deframer, FrameError, MAX_FRAME, emit};
use gyronet::service::message::{AllCounters, Calibrate, FlashState, Identity, Origin, Refusal};
use gyronet::service::{Device, Reply, Request, SupportedHardware};
use gyronet::store::layout::{self, RECORD_SECTOR};
use gyronet::store::slots::{SlotError, WeightSource};
use gyronet::store::{
    Configuration, Field, FieldError, FogPart, ImuPart, Mounting, Record, Slot, StoreError,
};
use gyronet::units::{AngularRate, CentiCelsius, Micros, SpecificForce};
use gyronet_host_tests::flash::{Cut, F405, MappedRegion, Region};
use gyronet_host_tests::noise::{Noise, cases};
use gyronet_host_tests::stored::other_weights;
use proptest::prelude::*;
use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;

type Board = Device<Region<RECORD_SECTOR>, MappedRegion>;
const DRIVES: SupportedHardware =
    SupportedHardware { imus: &[ImuPart::XsensMti], fogs: &[FogPart::Dsp1760], bits_per_second: &[500_000] };
const IDENTITY: Identity = Identity {
    firmware: [0, 1, 0],
    device_id: Some(0x413),
    clock_hz: 16_000_000,
    clock_fault: None,
    can_fault: None,
    reset: ResetCause::Software,
    crash: Some(Crash {
        kind: CrashKind::HardFault,
        place: 0x0800_1234,
        link: 0,
        status: 0,
        address: 0,
        file: [0; FILE],
        count: 1,
    }),
};

fn start(flash: &Rc<RefCell<F405>>) -> Board {
    let records = Region::new(flash, layout::STORE);
    let mut board = Board::new(&DRIVES);
    board.begin(Some(records), Some(MappedRegion::new(flash)), true, IDENTITY);
    let slots = MappedRegion::new(flash);
    let blob = board.weights(Some(slots.current()), &weights::DEFAULT.0);
    assert!(blob.is_some());
    board
}

/// Without a flash controller, as in the emulator.
fn bare() -> Board {
    let mut board = Board::new(&DRIVES);
    board.begin(None, None, false, IDENTITY);
    board.weights(None, &weights::DEFAULT.0);
    board
}

/// A request over the line; every byte of it and of the answer.
fn ask(board: &mut Board, request: &Request) -> Reply {
    let frame = emit(7, request).expect("it fits");
    let answers: Vec<_> =
        frame.iter().filter_map(|byte| board.receive(*byte, &AllCounters::default())).collect();
    let [answer] = &answers[..] else { panic!("{} answers", answers.len()) };
    let mut deframer = Deframer::new();
    let mut replies = answer.iter().filter_map(|byte| deframer.receive::<Reply>(*byte));
    let (number, reply) = replies.next().expect("a frame").expect("a reply");
    assert_eq!((number, replies.next()), (7, None));
    reply
}

fn info(board: &mut Board) -> gyronet::service::message::Info {
    let Reply::Info(info) = ask(board, &Request::Info) else { panic!("no info") };
    info
}

fn set(configuration: Configuration) -> Request {
    Request::SetConfiguration { version: Configuration::VERSION, configuration }
}

fn sample(k: u64, force: [f32; 3], rate: f32) -> ImuSample {
    ImuSample {
        time: Micros(k * PERIOD_US),
        specific_force: force.map(|force| SpecificForce::from_metre_per_sec2(force).expect("in range")),
        angular_rate: [AngularRate::from_rad_per_sec(rate).expect("in range"); 3],
        temperature: Some(CentiCelsius(3_000)),
        validity: Validity::Good,
    }
}

#[test]
fn a_frame_has_its_documented_bytes() {
    // 00, COBS of (number 7, request 0, CRC-32 of 07 00), 00.
    let frame = emit(7, &Request::Info).expect("it fits");
    let crc = gyronet::model::blob::CRC.checksum(&[7, 0]).to_le_bytes();
    assert!(!crc.contains(&0));
    assert_eq!(&frame[..], [&[0, 2, 7, 5][..], &crc, &[0]].concat());
    let number = |request: &Request| emit(0, request).expect("it fits")[3];
    assert_eq!(number(&Request::Restart), 11, "the last request; number 0 is encoded away");
}

#[test]
fn configuration_is_kept_whole() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    assert_eq!(info(&mut board).configuration, Origin::BuiltIn);
    let wanted = Configuration { latitude_deg: Some(-33.9), ..Configuration::DEFAULT };
    assert_eq!(ask(&mut board, &set(wanted)), Reply::Done);
    let mut board = start(&flash);
    assert_eq!(
        ask(&mut board, &Request::GetConfiguration),
        Reply::Configuration { version: 2, origin: Origin::Stored, configuration: wanted }
    );
    assert_eq!(*board.configuration(), wanted);
    // Refused, and named, and the old one stays.
    let wild = Configuration { mounting: Mounting { pitch_deg: 91.0, ..Mounting::default() }, ..wanted };
    match ask(&mut board, &set(wild)) {
        Reply::Refused(Refusal::Store(StoreError::Field(FieldError::Range { field, value, .. }))) => {
            assert_eq!((field, value), (Field::MountingPitchDeg, 91.0));
        }
        other => panic!("{other:?}"),
    }
    let refused = |error| Reply::Refused(Refusal::Store(StoreError::Field(error)));
    let other_part = Configuration { imu: ImuPart::Adis16465, ..wanted };
    assert_eq!(ask(&mut board, &set(other_part)), refused(FieldError::PartNotInImage));
    let can = Settings { bits_per_second: 250_000, ..wanted.can };
    assert_eq!(
        ask(&mut board, &set(Configuration { can, ..wanted })),
        refused(FieldError::BitRateNotInImage(250_000))
    );
    let twice = Configuration { fog_ids: [0x1A0, 0x1A5, 0x1A6], ..wanted };
    let duplicate = FieldError::Can(ConfigError::DuplicateIdentifier(0x1A0));
    assert_eq!(ask(&mut board, &set(twice)), refused(duplicate));
    let with_fog = Configuration { fog: Some(FogPart::Dsp3000), ..wanted };
    assert_eq!(ask(&mut board, &set(with_fog)), refused(FieldError::PartNotInImage));
    let request = Request::SetConfiguration { version: 9, configuration: wanted };
    assert_eq!(ask(&mut board, &request), Reply::Refused(Refusal::Version { found: 9, expected: 2 }));
    assert_eq!(*start(&flash).configuration(), wanted);
}

#[test]
fn damaged_record_is_noted() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    assert_eq!(ask(&mut board, &set(Configuration::DEFAULT)), Reply::Done);
    flash.borrow_mut().damage(layout::STORE.start as usize + 20, 4);
    let mut board = start(&flash);
    assert_eq!(info(&mut board).flash, FlashState::Damaged);
    assert_eq!(info(&mut board).configuration, Origin::BuiltIn);
    assert!(board.stored_damaged() && board.configuration_lost());
    let Reply::Log(page) = ask(&mut board, &Request::Log { after: 0 }) else { panic!("no log") };
    assert!(page.events.iter().any(|event| event.kind == EventKind::RecordsDamaged));
    // Until it is stored again.
    assert_eq!(ask(&mut board, &set(Configuration::DEFAULT)), Reply::Done);
    let board = start(&flash);
    assert!(!board.stored_damaged() && !board.configuration_lost());
}

#[test]
fn sensor_that_does_not_answer_is_noted_once() {
    let mut board = bare();
    let absent = SensorFault::Identity(0xFF);
    for result in [Err(absent), Err(absent), Err(SensorFault::Reset), Err(absent), Ok(()), Ok(())] {
        board.sensor(result);
        assert_eq!(info(&mut board).sensor, result.err());
    }
    let Reply::Log(page) = ask(&mut board, &Request::Log { after: 2 }) else { panic!("no log") };
    let kinds: Vec<EventKind> = page.events.iter().map(|event| event.kind).collect();
    let failed = [Some(absent), Some(SensorFault::Reset), Some(absent), None, None];
    assert_eq!(kinds, failed.map(EventKind::Sensor));
}

/// The flash is mapped but has no controller, as in the emulator.
#[test]
fn what_is_stored_is_read_without_a_controller() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let wanted = Configuration { latitude_deg: Some(-33.9), ..Configuration::DEFAULT };
    assert_eq!(ask(&mut start(&flash), &set(wanted)), Reply::Done);
    let mut board = Board::new(&DRIVES);
    let records = Region::new(&flash, layout::STORE);
    board.begin(Some(records), Some(MappedRegion::new(&flash)), false, IDENTITY);
    assert_eq!(*board.configuration(), wanted);
    let about = info(&mut board);
    assert_eq!((about.flash, about.writable), (FlashState::Ready, false));
    let before = flash.borrow().operations();
    let no_flash = Reply::Refused(Refusal::Store(StoreError::NoFlash));
    assert_eq!(ask(&mut board, &set(Configuration::DEFAULT)), no_flash);
    let no_slot = Reply::Refused(Refusal::Slot(SlotError::NoFlash));
    assert_eq!(ask(&mut board, &Request::WeightsBegin { length: 64 }), no_slot);
    assert_eq!(flash.borrow().operations(), before);
}

#[test]
fn nothing_is_stored_without_flash() {
    let mut board = bare();
    let about = info(&mut board);
    assert_eq!((about.flash, about.weights), (FlashState::Absent, WeightSource::BuiltIn));
    assert_eq!(about.identity, IDENTITY);
    let no_flash = Reply::Refused(Refusal::Store(StoreError::NoFlash));
    assert_eq!(ask(&mut board, &set(Configuration::DEFAULT)), no_flash);
    let no_slot = Reply::Refused(Refusal::Slot(SlotError::NoFlash));
    assert_eq!(ask(&mut board, &Request::WeightsBegin { length: 64 }), no_slot);
    assert_eq!(ask(&mut board, &Request::WeightsVerify), no_slot);
    assert_eq!(
        ask(&mut board, &Request::WeightsActivate),
        Reply::Refused(Refusal::Slot(SlotError::NotBegun))
    );
}

/// Returns whether a configuration can be stored after so many samples.
fn storable(board: &mut Board, samples: Range<u64>, wobble: f32, wheels: Standstill) -> bool {
    for k in samples {
        let rate = 0.01 + if k % 2 == 0 { wobble } else { -wobble };
        board.observe(Some(&sample(k, [0.0, 0.0, 9.81], rate)), k as u32, Status::Ready, wheels);
    }
    match ask(board, &set(Configuration::DEFAULT)) {
        Reply::Done => true,
        Reply::Refused(Refusal::Moving) => false,
        other => panic!("{other:?}"),
    }
}

#[test]
fn flash_is_written_at_standstill_alone() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    assert!(storable(&mut board, 0..0, 0.0, Standstill::Unknown), "no rate is valid yet");
    assert!(!storable(&mut board, 0..1, 0.0, Standstill::Moving));
    assert!(storable(&mut board, 1..2, 0.5, Standstill::Still), "the wheels prove it");
    assert!(!storable(&mut board, 2..202, 0.001, Standstill::Unknown), "quiet for two seconds");
    assert!(storable(&mut board, 202..402, 0.001, Standstill::Unknown), "quiet for more than three");
    assert!(!storable(&mut board, 402..602, 0.3, Standstill::Unknown), "a gyro that moves");
    board.observe(None, 700, Status::Silent, Standstill::Unknown);
    assert!(storable(&mut board, 0..0, 0.0, Standstill::Unknown), "a bench without a sensor");
    board.observe(None, 701, Status::Silent, Standstill::Moving);
    for request in [
        Request::WeightsBegin { length: 64 },
        Request::WeightsBlock { offset: 0, bytes: heapless::Vec::new() },
        Request::WeightsActivate,
        Request::Calibrate(Calibrate::Store),
        Request::Restart,
    ] {
        assert_eq!(ask(&mut board, &request), Reply::Refused(Refusal::Moving), "{request:?}");
    }
}

/// Runs a calibration to its end.
fn calibrate(board: &mut Board, task: Task, force: [f32; 3], wobble: f32) -> State {
    assert_eq!(ask(board, &Request::Calibrate(Calibrate::Start(task))), Reply::Done);
    for k in 0..301u64 {
        let rate = 0.01 + if k % 2 == 0 { wobble } else { -wobble };
        board.observe(Some(&sample(k, force, rate)), k as u32, Status::Ready, Standstill::Still);
    }
    match ask(board, &Request::GetCalibration) {
        Reply::Calibration { state, .. } => state,
        other => panic!("{other:?}"),
    }
}

#[test]
fn calibration_is_found_and_kept() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    let store = Request::Calibrate(Calibrate::Store);
    assert_eq!(ask(&mut board, &store), Reply::Refused(Refusal::NothingFound));
    let level = [0.0, 0.0, 9.81];
    assert_eq!(
        calibrate(&mut board, Task::Static, level, 0.3),
        State::Failed(Task::Static, CalibrationFault::Moving(0))
    );
    assert_eq!(ask(&mut board, &store), Reply::Refused(Refusal::NothingFound));
    assert_eq!(calibrate(&mut board, Task::Static, level, 0.001), State::Found(Task::Static));
    assert_eq!(ask(&mut board, &store), Reply::Done);
    // Rolled by 30 deg: gravity shows on y.
    let tilted = [0.0, 9.81 * 0.5, 9.81 * 0.866_025_4];
    assert_eq!(calibrate(&mut board, Task::Mounting, tilted, 0.001), State::Found(Task::Mounting));
    assert_eq!(ask(&mut board, &store), Reply::Done);
    assert_eq!(
        calibrate(&mut board, Task::Mounting, [9.81, 0.0, 0.0], 0.001),
        State::Failed(Task::Mounting, CalibrationFault::Tilted(90.0))
    );
    let board = start(&flash);
    let calibration = board.calibration();
    let level = calibration.level.expect("it was stored");
    assert!((level.roll_deg - 30.0).abs() < 1e-3 && level.pitch_deg.abs() < 1e-3, "{level:?}");
    let bias = calibration.gyro_bias.expect("it was stored");
    assert!(bias.iter().all(|rate| (rate.rad_per_sec() - 0.01).abs() < 1e-5), "{bias:?}");
}

#[test]
fn configured_rotation_comes_first() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mounting = Mounting { roll_deg: 180.0, pitch_deg: 0.0, yaw_deg: 90.0 };
    ask(&mut start(&flash), &set(Configuration { mounting, ..Configuration::DEFAULT }));
    let mut board = start(&flash);
    // Upside down and turned: gravity shows as -z, and the small force along the sensor's -x is
    // the vehicle's -y.
    let state = calibrate(&mut board, Task::Mounting, [-0.5, 0.0, -9.8], 0.001);
    assert_eq!(state, State::Found(Task::Mounting));
    let level = board.calibration().level.expect("it was found");
    assert!((level.roll_deg + 2.9206).abs() < 1e-3 && level.pitch_deg.abs() < 1e-3, "{level:?}");
}

#[test]
fn weights_are_replaced() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let file = &weights::DEFAULT.0;
    let crc = u32::from_le_bytes(*file.last_chunk().expect("a checksum"));
    for (round, slot) in [Slot::A, Slot::B, Slot::A].into_iter().enumerate() {
        let mut board = start(&flash);
        let at = |written, checked| Reply::Weights { slot, written, checked };
        assert_eq!(ask(&mut board, &Request::WeightsBegin { length: file.len() as u32 }), at(0, None));
        for (block, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
            let bytes = heapless::Vec::from_slice(block).expect("a block");
            let request = Request::WeightsBlock { offset, bytes };
            let written = offset + block.len() as u32;
            assert_eq!(ask(&mut board, &request), at(written, None));
            // The answer was lost: the same again does no harm.
            assert_eq!(ask(&mut board, &request), at(written, None));
            if offset == 512 {
                let gap = Request::WeightsBlock { offset: 4096, bytes: heapless::Vec::new() };
                let expected = Reply::Refused(Refusal::Slot(SlotError::Offset { expected: written }));
                assert_eq!(ask(&mut board, &gap), expected);
                let early = Reply::Refused(Refusal::Slot(SlotError::Incomplete { written }));
                assert_eq!(ask(&mut board, &Request::WeightsVerify), early);
                assert_eq!(ask(&mut board, &Request::WeightsActivate), early);
            }
        }
        assert_eq!(ask(&mut board, &Request::WeightsVerify), at(file.len() as u32, Some(crc)));
        assert_eq!(ask(&mut board, &Request::WeightsActivate), Reply::Done);
        let about = info(&mut start(&flash));
        assert_eq!((about.weights, about.weights_crc), (WeightSource::Slot(slot), Some(crc)), "{round}");
    }
    // A bad file is not accepted, and what ran before runs on.
    let mut board = start(&flash);
    ask(&mut board, &Request::WeightsBegin { length: 256 });
    let bytes = heapless::Vec::from_slice(&[0x55; 256]).expect("a block");
    ask(&mut board, &Request::WeightsBlock { offset: 0, bytes });
    assert!(matches!(ask(&mut board, &Request::WeightsVerify), Reply::Refused(Refusal::Slot(_))));
    assert!(matches!(ask(&mut board, &Request::WeightsActivate), Reply::Refused(Refusal::Slot(_))));
    assert_eq!(info(&mut start(&flash)).weights, WeightSource::Slot(Slot::A));
    // Both slots damaged: the built-in weights, and both are named.
    for slot in [Slot::A, Slot::B] {
        flash.borrow_mut().damage(layout::SLOTS.start as usize + slot.offset() as usize + 70_000, 0x10);
    }
    let mut board = start(&flash);
    let about = info(&mut board);
    assert_eq!(about.weights, WeightSource::BuiltIn);
    assert!(about.refused_slots.iter().all(Option::is_some), "{:?}", about.refused_slots);
}

/// Uploads a file over the line and has it checked.
fn upload(board: &mut Board, file: &[u8]) {
    ask(board, &Request::WeightsBegin { length: file.len() as u32 });
    for (block, offset) in file.chunks(256).zip((0u32..).step_by(256)) {
        let bytes = heapless::Vec::from_slice(block).expect("a block");
        ask(board, &Request::WeightsBlock { offset, bytes });
    }
    let checked = ask(board, &Request::WeightsVerify);
    assert!(matches!(checked, Reply::Weights { checked: Some(_), .. }), "{checked:?}");
}

/// The upload itself touches the unused slot alone (`store_power_cut`); here the board changes over to it.
#[test]
fn a_power_cut_during_activation_leaves_the_old_or_the_new_weights() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    upload(&mut board, &other_weights(1));
    assert_eq!(ask(&mut board, &Request::WeightsActivate), Reply::Done);
    let before = flash.borrow().clone();
    let mut cuts = 0;
    let changed_over = loop {
        let flash = Rc::new(RefCell::new(before.clone()));
        let mut board = start(&flash);
        upload(&mut board, &other_weights(2));
        flash.borrow_mut().cut_after(cuts, Cut::ALL[cuts as usize % Cut::ALL.len()]);
        let answer = ask(&mut board, &Request::WeightsActivate);
        if !flash.borrow_mut().restore() {
            break answer;
        }
        assert!(matches!(answer, Reply::Refused(_)), "cut {cuts}: {answer:?}");
        let weights = info(&mut start(&flash)).weights;
        assert!(matches!(weights, WeightSource::Slot(_)), "cut {cuts}: the board runs on weights {weights}");
        cuts += 1;
    };
    assert_eq!(changed_over, Reply::Done);
    assert!(cuts > 3, "{cuts} operations to cut");
}

#[test]
fn the_log_is_bounded_and_reports_what_is_lost() {
    let mut board = bare();
    let page = |board: &mut Board, after| match ask(board, &Request::Log { after }) {
        Reply::Log(page) => page,
        other => panic!("{other:?}"),
    };
    let first = page(&mut board, 0);
    let kinds: Vec<EventKind> = first.events.iter().map(|event| event.kind).collect();
    let crash = IDENTITY.crash.expect("there is one");
    assert_eq!(kinds, [EventKind::Started(ResetCause::Software), EventKind::Crashed(crash)]);
    for k in 0..100 {
        let status = if k % 2 == 0 { Status::Ready } else { Status::Degraded };
        board.observe(Some(&sample(k, [0.0, 0.0, 9.8], 0.0)), k as u32, status, Standstill::Still);
    }
    let (mut after, mut events, mut lost) = (2, 0, 0);
    loop {
        let page = page(&mut board, after);
        lost += page.lost;
        events += page.events.len() as u32;
        let Some(last) = page.events.last() else { break };
        after = last.number;
    }
    assert_eq!((events, lost, after), (32, 68, 102));
}

#[test]
fn calibration_fits_its_frame() {
    let flash = Rc::new(RefCell::new(F405::default()));
    let mut board = start(&flash);
    let mut calibration = gyronet::store::Calibration::default();
    for k in 0..8 {
        calibration.add_bias([AngularRate(-(1 << 27)); 3], Some(CentiCelsius(k * 1000 - 4000)));
    }
    let reply = Reply::Calibration {
        version: 1,
        origin: Origin::Stored,
        state: State::Failed(Task::Mounting, CalibrationFault::Tilted(90.0)),
        calibration,
    };
    assert!(emit(255, &reply).is_some_and(|frame| frame.len() <= MAX_FRAME));
    assert!(matches!(ask(&mut board, &Request::Counters), Reply::Counters(_)));
}

proptest! {
    #![proptest_config(cases(300))]

    /// Noise, with requests strewn in: the noise is counted, the requests are answered.
    #[test]
    fn flooded(seed in any::<u64>()) {
        let mut board = bare();
        let mut noise = Noise::new(seed);
        let mut answers = 0;
        for _ in 0..10 {
            let length = noise.int(0, 2_000);
            for _ in 0..length {
                // Noise whose frames would have a right checksum is one in 2^32.
                prop_assert!(board.receive(noise.byte(), &AllCounters::default()).is_none());
            }
            for byte in emit(1, &Request::Info).expect("it fits") {
                answers += usize::from(board.receive(byte, &AllCounters::default()).is_some());
            }
        }
        prop_assert_eq!(answers, 10);
    }

    /// Intact frames of anything: refused or answered, never more than a frame.
    #[test]
    fn intact_frames_of_anything(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
        let mut board = bare();
        let mut content = vec![3];
        content.extend(&bytes);
        let crc = gyronet::model::blob::CRC.checksum(&content).to_le_bytes();
        content.extend(crc);
        let mut frame = vec![0; content.len() + 4];
        let len = cobs::encode(&content, &mut frame[1..]);
        frame.truncate(len + 2);
        let answers: Vec<_> = frame.iter().filter_map(|b| board.receive(*b, &AllCounters::default())).collect();
        prop_assert_eq!(answers.len(), 1);
        prop_assert!(answers[0].len() <= MAX_FRAME);
    }

    /// A frame with any bit flipped is no frame.
    #[test]
    fn flipped_bits(at in 1usize..200, bit in 0u8..8) {
        let configuration = Configuration::DEFAULT;
        let mut frame = emit(1, &set(configuration)).expect("it fits");
        let at = 1 + at % (frame.len() - 2);
        frame[at] ^= 1 << bit;
        let mut deframer = Deframer::new();
        for byte in frame.iter().chain(&[0]) {
            if let Some(Ok((_, request))) = deframer.receive::<Request>(*byte) {
                prop_assert!(false, "{request:?}");
            }
        }
    }
}

#[test]
fn a_message_that_is_too_long_is_refused() {
    let mut deframer = Deframer::new();
    let long: Vec<_> =
        [0].into_iter().chain([1; 2_000]).chain([0]).filter_map(|b| deframer.receive::<Request>(b)).collect();
    assert_eq!(long, [Err(FrameError::TooLong)]);
}

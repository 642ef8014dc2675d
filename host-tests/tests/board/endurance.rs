//! All lines busy at once: every frame is the host's, none is missing, nothing overruns, and the stack does not grow.
//!
//! | line | traffic |
//! |---|---|
//! | USART1 | MTi, 100 messages a second, a simulated drive |
//! | USART3 | DSP-1760, 1000 messages a second at 921600, from the drive's reference |
//! | USART2 | all frames as SLCAN at 921600 |
//! | CAN | the board's 900 frames a second; wheel frames at 50 Hz, and three identifiers at 50 Hz that the filters stop |
//! | USART6 | a question every 100 ms |

use crate::common::{self, IMU, MS, SAMPLE, SECOND, SERVICE, SET, SLCAN, START};
use embedded_can::Frame;
use gyronet::can::e2e::{Checker, Verdict};
use gyronet::can::fog_encoder::FogEncoder;
use gyronet::can::yaw::FOG_IDS;
use gyronet::can::{DataFrame, slcan};
use gyronet::health::InputCounters;
use gyronet::sample::ImuSample;
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::service::message::{AllCounters, LineCounters};
use gyronet::uds::isotp::Transport;
use gyronet::units::AngularRate;
use gyronet_host_tests::board::{At, Board};
use gyronet_host_tests::tester::segment;
use gyronet_host_tests::wire::{data_frame, id11, wheels};
use gyronet_host_tests::{replay, synthetic};
use gyronet_tools::client::device::requests;
use gyronet_tools::simulate::{self, Simulation};
use std::time::{Duration, Instant};

const FOG: usize = 3;
/// Seconds between two lines that say how far a run is.
const MINUTE: usize = 60;
/// Samples in a second, and messages of the fibre-optic gyro in a sample.
const SAMPLES: usize = 100;
const MESSAGES: usize = 10;
/// The gyro's resolution, rad.
const FOG_STEP: f64 = 4e-8;
const STANDING_SAMPLES: usize = 600;
/// Frames of the fibre-optic gyro in a sample.
const FOG_SET: usize = 3;
/// Time after the begin of a sample's message at which wheel frames come: the message has ended, and the next has not
/// begun.
const WHEELS_AFTER: Duration = Duration::from_millis(8);
/// Identifiers on the bus that are none of the board's business.
const OTHERS: [u16; 3] = [0x0AB, 0x2C1, 0x3D0];
/// Samples between two questions on the service line.
const QUESTION: usize = 10;
/// The questions: identity, configuration, troubles, and the counters, whose answer is the longest.
const QUESTIONS: [&[u8]; 4] =
    [&[0x22, 0x01, 0x0A], &[0x22, 0x01, 0x00], &[0x19, 0x02, 0xFF], &requests::COUNTERS];
/// A flow control that grants all of an answer, and the time from a question to it: the answer's first frame is out.
const GRANT: [u8; 8] = [0x30, 0, 0, 0, 0, 0, 0, 0];
const GRANT_AFTER: Duration = Duration::from_millis(12);
/// The end and the size of the stack's region (memory.x), the bytes that may be used of it, and what the rest is filled
/// with.
const STACK_END: u32 = 0x2000_8000;
const STACK_SIZE: u32 = 0x8000;
const STACK_BUDGET: usize = 12 << 10;
const PAINT: u8 = 0xA5;

fn line(data: &[u8; 8]) -> Vec<u8> {
    slcan::emit(&data_frame(id11(0x7E0), data)).expect("a data frame").to_vec()
}

/// A message of the gyro at this rate, rad/s.
fn fog_message(number: usize, part: usize, rate: f64) -> Vec<u8> {
    // A gyro that repeats itself counts as stuck, so no sum of a sample equals the one before.
    let noise = if number.is_multiple_of(2) { FOG_STEP / 4.0 } else { -FOG_STEP / 4.0 };
    let reading = ((rate * 0.01 / MESSAGES as f64 / FOG_STEP).round() * FOG_STEP + noise) as f32;
    let message = Message {
        rotation: [0.0, 0.0, reading],
        acceleration: [0.0; 3],
        extra: Extra::Temperature(25),
        validity: Validity::ALL,
        sequence: ((number * MESSAGES + part) % 128) as u8,
    };
    message.emit().to_vec()
}

/// Input of all lines, and the frames that the host computes from it.
struct Outside {
    drive: Simulation,
    number: usize,
    host: replay::Board,
}

impl Outside {
    fn sample(&mut self, board: &mut Board) {
        let number = self.number;
        self.number += 1;
        let sample = self.drive.next().expect("it is without end");
        let measured = ImuSample {
            specific_force: sample.specific_force.map(synthetic::force),
            angular_rate: sample.angular_rate.map(synthetic::rate),
            ..synthetic::turning(number as u64, AngularRate::ZERO)
        };
        let begin = START + SAMPLE * number as u32;
        let message = replay::message(number, &measured);
        board.send_at(IMU, &message, begin);
        self.host.push(&message);
        // At the start the last one alone, so that a message set always follows the last message of a sample.
        let first = if number == 0 { MESSAGES - 1 } else { 0 };
        for part in first..MESSAGES {
            board.send_at(FOG, &fog_message(number, part, sample.reference[2]), begin + MS * part as u32);
        }
        if number.is_multiple_of(2) {
            let wheels = wheels(if number < STANDING_SAMPLES { 0.0 } else { 20.0 });
            board.can_send_at(&wheels, begin + WHEELS_AFTER);
            self.host.can(&wheels);
            for id in OTHERS {
                let other = data_frame(id11(id), &[number as u8; 8]);
                board.can_send_at(&other, begin + WHEELS_AFTER);
            }
        }
        if number.is_multiple_of(QUESTION) {
            let question = QUESTIONS[number / QUESTION % QUESTIONS.len()];
            board.send_at(SERVICE, &line(&segment(question)[0]), begin);
            board.send_at(SERVICE, &line(&GRANT), begin + GRANT_AFTER);
        }
    }
}

struct Received {
    can: Vec<DataFrame>,
    slcan: Vec<u8>,
    service: Vec<u8>,
    transport: Transport,
    /// Check the fibre-optic gyro's messages as a receiver does.
    checkers: [Checker; FOG_SET],
    /// Frames of the inertial sensor's samples that were the host's, and frames of the fibre-optic gyro.
    own: usize,
    fog: usize,
    answers: usize,
    counters: Option<AllCounters>,
}

impl Received {
    fn new() -> Self {
        Self {
            can: Vec::new(),
            slcan: Vec::new(),
            service: Vec::new(),
            transport: Transport::IDLE,
            checkers: FogEncoder::profiles(FOG_IDS).map(|profile| Checker::new(profile, 1)),
            own: 0,
            fog: 0,
            answers: 0,
            counters: None,
        }
    }

    /// Takes what has come, and holds it against the host's frames, which are used up.
    fn take(&mut self, board: &mut Board, host: &mut replay::Board) {
        let fog_ids = FogEncoder::messages(FOG_IDS);
        let mut expected = 0;
        for (time, frame) in board.can_frames() {
            self.can.push(frame);
            if let Some(part) = fog_ids.iter().position(|message| message.id == frame.id()) {
                let verdict = self.checkers[part].check(frame.data());
                assert!(matches!(verdict, Ok(Verdict::First | Verdict::Ok)), "{verdict:?} at {time:?}");
                self.fog += 1;
                continue;
            }
            assert_eq!(Some(&frame), host.frames.get(expected), "frame {} on CAN at {time:?}", self.own);
            expected += 1;
            self.own += 1;
        }
        host.frames.drain(..expected);
        self.slcan.extend(board.sent(SLCAN));
        let text = whole_lines(&mut self.slcan);
        let lines = text.split(|byte| *byte == b'\r').filter(|line| !line.is_empty());
        let lines: Vec<DataFrame> = lines.map(|line| slcan::parse(line).expect("a frame")).collect();
        let both = lines.len().min(self.can.len());
        assert!(lines[..both] == self.can[..both], "SLCAN and CAN carry the same frames");
        assert!(lines.len() <= self.can.len() + 2 * SET, "CAN keeps up");
        self.can.drain(..both);
        let ahead: Vec<u8> =
            lines[both..].iter().flat_map(|frame| slcan::emit(frame).expect("a data frame")).collect();
        self.slcan.splice(..0, ahead);
        self.service.extend(board.sent(SERVICE));
        for line in whole_lines(&mut self.service).split(|byte| *byte == b'\r') {
            // An empty line says that a frame has been taken.
            let Ok(frame) = slcan::parse::<DataFrame>(line) else {
                assert!(line.is_empty(), "{}", line.escape_ascii());
                continue;
            };
            self.transport.receive(frame.data(), 0);
            let (answers, counters) = (&mut self.answers, &mut self.counters);
            self.transport.answer(|message, _| {
                *answers += 1;
                match message {
                    [0x62, rest @ ..] if rest.starts_with(&requests::COUNTERS[1..3]) => {
                        *counters = Some(requests::counters(rest).expect("counters"));
                    }
                    [0x59 | 0x62, ..] => {}
                    other => panic!("{other:02x?}"),
                }
            });
        }
    }

    /// Holds everything that has come so far against what `samples` must give, of which the last ones may be under way.
    fn check(&self, samples: usize, under_way: usize) {
        let fog_sets = self.fog / FOG_SET;
        assert!((SET * (samples - under_way)..=SET * samples).contains(&self.own), "{} frames", self.own);
        assert!((samples - under_way.max(2)..=samples + 1).contains(&fog_sets), "{} fog frames", self.fog);
        let questions = samples / QUESTION;
        assert!(
            (questions - under_way.min(1)..=questions).contains(&self.answers),
            "{} answers",
            self.answers
        );
        // The last question for them is one of the last four, or five where an answer is under way.
        let counters = self.counters.expect("they were asked for");
        let AllCounters { lines, pipeline, watch, fog, inputs, contradiction } = counters;
        assert_eq!((lines, inputs), (LineCounters::NONE, InputCounters::default()));
        assert_eq!(contradiction.seconds, 0);
        let taken = pipeline.samples as usize;
        assert!(samples - taken <= 4 * QUESTION + under_way, "{taken} of {samples} samples");
        assert_eq!([pipeline.missing, pipeline.misplaced, pipeline.clock_jumps, pipeline.late], [0; 4]);
        assert_eq!([watch.silences, watch.stuck, watch.wrong, watch.clock_off], [0; 4]);
        assert!(fog.samples as usize + 2 * MESSAGES > taken * MESSAGES, "{} of {taken}", fog.samples);
        // The first message does not fill the step that it begins in.
        assert!(fog.gaps <= 1, "{} gaps", fog.gaps);
        assert_eq!([fog.misplaced, fog.stuck], [0; 2]);
    }
}

fn whole_lines(bytes: &mut Vec<u8>) -> Vec<u8> {
    let end = bytes.iter().rposition(|byte| *byte == b'\r').map_or(0, |at| at + 1);
    bytes.drain(..end).collect()
}

/// Paints what the stack does not use at present.
fn paint_stack(board: &mut Board) {
    let free = board.register("sp") - (STACK_END - STACK_SIZE);
    board.patch(At::Address(STACK_END - STACK_SIZE), &vec![PAINT; free as usize]);
}

/// Bytes of the stack that have been used since it was painted.
fn stack_used(board: &mut Board) -> usize {
    let stack = board.read(At::Address(STACK_END - STACK_SIZE), STACK_SIZE as usize);
    stack.len() - stack.iter().position(|byte| *byte != PAINT).unwrap_or(stack.len())
}

fn run(seconds: usize) {
    let Some(mut board) = common::boot() else { return };
    let drive = Simulation::new(&simulate::Config::DEFAULT);
    let mut outside = Outside { drive, number: 0, host: replay::Board::default() };
    let mut received = Received::new();
    let (begun, mut early) = (Instant::now(), None);
    board.run(START);
    board.send(SLCAN, b"O\r");
    paint_stack(&mut board);
    for second in 1..=seconds {
        (0..SAMPLES).for_each(|_| outside.sample(&mut board));
        board.run(SECOND);
        received.take(&mut board, &mut outside.host);
        let events = board.events();
        let started = |kind: &str, cause: &str| second == 1 && kind == "reset" && cause == "por";
        let wrong = events.iter().find(|event| !started(&event.kind, event.text("cause")));
        assert_eq!(wrong, None, "in second {second}");
        if second == seconds.div_ceil(10) {
            early = Some(stack_used(&mut board));
        }
        if second % MINUTE == 0 || second == seconds {
            received.check(second * SAMPLES, 2);
            let (own, fog, answers) = (received.own, received.fog, received.answers);
            let stack = stack_used(&mut board);
            assert!(stack <= STACK_BUDGET, "{stack} bytes of stack");
            let took = begun.elapsed();
            println!(
                "{second} s of board time in {took:.0?}: {own} + {fog} frames, {answers} answers, {stack} bytes of stack"
            );
        }
    }
    // What is under way comes out.
    board.run(SAMPLE * 2 - MS);
    received.take(&mut board, &mut outside.host);
    assert_eq!(outside.host.frames, [], "frames that did not come");
    assert_eq!(board.counts().frames_filtered as usize, OTHERS.len() * seconds * SAMPLES / 2);
    received.check(seconds * SAMPLES, 0);
    let AllCounters { pipeline, fog, .. } = received.counters.expect("they were asked for");
    let (early, late) = (early.expect("a tenth has passed"), stack_used(&mut board));
    println!("{early} bytes of stack after a tenth, {late} at the end; {pipeline:?}; {fog:?}");
    assert!(late <= STACK_BUDGET, "{late} bytes of stack");
}

#[test]
fn all_lines_busy_for_seconds() {
    run(8);
}

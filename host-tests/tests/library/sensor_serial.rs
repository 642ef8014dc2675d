//! Parts behind a serial port: dialogues over it, samples from it, and a port that fails.

use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};
use gyronet::sensor::Source;
use gyronet::sensor::dsp1760::command::{Command, Reply};
use gyronet::sensor::dsp1760::dialogue::{self as dsp1760, DialogueError as Dsp1760DialogueError};
use gyronet::sensor::dsp1760::{Dsp1760Config, OutputRate, Rotation};
use gyronet::sensor::serial::{Serial, SerialError, configure};
use gyronet::sensor::xsens::dialogue::{ATTEMPTS, Dialogue, DialogueError, Step, mid};
use gyronet::sensor::xsens::{Mti, XsensError, xbus};
use gyronet_host_tests::wire::{feed_new, message, real_frame};
use std::collections::VecDeque;

/// A part at the other end of the line: what it is sent, and what it answers.
trait Part {
    fn take(&mut self, sent: &[u8]) -> Vec<u8>;
}

/// The board's port. A byte `None` is one that the port has lost.
struct Port<P> {
    part: P,
    waiting: VecDeque<Option<u8>>,
    /// Looks at the line so far.
    looks: u32,
}

impl<P> Port<P> {
    fn new(part: P) -> Self {
        Self { part, waiting: VecDeque::new(), looks: 0 }
    }
}

impl<P> ErrorType for Port<P> {
    type Error = ErrorKind;
}

impl<P> ReadReady for Port<P> {
    fn read_ready(&mut self) -> Result<bool, ErrorKind> {
        self.looks += 1;
        Ok(!self.waiting.is_empty())
    }
}

impl<P> Read for Port<P> {
    fn read(&mut self, to: &mut [u8]) -> Result<usize, ErrorKind> {
        let mut count = 0;
        for slot in to {
            match self.waiting.pop_front() {
                Some(Some(byte)) => *slot = byte,
                Some(None) if count == 0 => return Err(ErrorKind::Other),
                Some(None) => {
                    self.waiting.push_front(None);
                    break;
                }
                None => break,
            }
            count += 1;
        }
        assert!(count > 0, "a read that would wait for ever");
        Ok(count)
    }
}

impl<P: Part> Write for Port<P> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.waiting.extend(self.part.take(bytes).into_iter().map(Some));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

/// An MTi that loses the first messages, and sends measurements until it gets the command to stop.
struct FakeMti {
    deaf: u32,
    refuses: bool,
    heard: Vec<u8>,
}

impl Part for FakeMti {
    fn take(&mut self, sent: &[u8]) -> Vec<u8> {
        let (mid, data) = xbus::parse(sent).expect("a frame");
        self.heard.push(mid);
        let mut answer = message(100).emit().to_vec();
        if self.deaf > 0 {
            self.deaf -= 1;
        } else if self.refuses && mid == mid::SET_OUTPUT_CONFIGURATION {
            answer.extend(xbus::emit::<8>(mid::ERROR, &[4]).expect("short"));
        } else {
            answer.extend(xbus::emit::<64>(mid + 1, data).expect("short"));
        }
        answer
    }
}

#[test]
fn an_mti_is_configured_and_measures() {
    for deaf in 0..u32::from(ATTEMPTS) {
        let mut port = Port::new(FakeMti { deaf, refuses: false, heard: Vec::new() });
        configure(&mut port, &mut Dialogue::new(), &mut NoopDelay::new()).expect("it answers");
        let steps = [vec![mid::GO_TO_CONFIG; deaf as usize + 1], vec![0xC0, mid::GO_TO_MEASUREMENT]].concat();
        assert_eq!(port.part.heard, steps);
        // The same port, now for measurements: two frames, a lost byte, a damaged frame, a frame.
        port.waiting.clear();
        let bytes = [&real_frame()[..], &message(200).emit()].concat();
        port.waiting.extend(bytes.iter().map(|byte| Some(*byte)));
        port.waiting.push_back(None);
        port.waiting.extend(message(300).emit()[5..].iter().map(|byte| Some(*byte)));
        port.waiting.extend(message(400).emit().iter().map(|byte| Some(*byte)));
        let mut line = Serial::new(port, Mti::new());
        let expected: Vec<_> =
            feed_new(bytes).into_iter().map(|sample| Some(Ok(sample.expect("intact")))).collect();
        assert_eq!([line.next_sample(), line.next_sample()], expected[..]);
        assert_eq!(line.next_sample(), Some(Err(SerialError::Port(ErrorKind::Other))));
        assert_eq!(line.next_sample().map(|sample| sample.expect("intact").time.0), Some(40_000));
        assert_eq!(line.next_sample(), None);
        assert_eq!(line.part().bad_checksums(), 0);
        let (port, _) = line.destroy();
        assert!(port.waiting.is_empty());
    }
}

#[test]
fn an_mti_that_never_answers_costs_a_bounded_time() {
    let mut port = Port::new(FakeMti { deaf: u32::MAX, refuses: false, heard: Vec::new() });
    let error = configure(&mut port, &mut Dialogue::new(), &mut NoopDelay::new()).expect_err("silent");
    assert_eq!(error, SerialError::Part(DialogueError::Silent { step: Step::GoToConfig }));
    assert_eq!(error.to_string(), "MTi: no answer to GoToConfig after 3 attempts");
    // Half a second for each attempt, a look every millisecond.
    assert_eq!(port.looks, 1_500);
    let mut port = Port::new(FakeMti { deaf: 0, refuses: true, heard: Vec::new() });
    let error = configure(&mut port, &mut Dialogue::new(), &mut NoopDelay::new()).expect_err("refused");
    let step = Step::SetOutputConfiguration;
    assert_eq!(error, SerialError::Part(DialogueError::Refused { step, code: 4 }));
}

/// A part that resets itself whenever it is spoken to.
struct Restless;

impl Part for Restless {
    fn take(&mut self, _sent: &[u8]) -> Vec<u8> {
        xbus::emit::<8>(mid::WAKE_UP, &[]).expect("short").to_vec()
    }
}

#[test]
fn an_mti_that_starts_again_and_again_is_given_up() {
    let mut port = Port::new(Restless);
    let error = configure(&mut port, &mut Dialogue::new(), &mut NoopDelay::new()).expect_err("restless");
    assert_eq!(error, SerialError::Part(DialogueError::Restarts));
}

#[test]
fn a_bad_message_is_not_a_bad_port() {
    let mut port = Port::new(Restless);
    let bad = gyronet::sensor::xsens::MtData2 { acceleration: None, ..message(1) };
    port.waiting.extend(bad.emit().iter().map(|byte| Some(*byte)));
    let missing = XsensError::Missing { id: 0x4020 };
    assert_eq!(Serial::new(port, Mti::new()).next_sample(), Some(Err(SerialError::Part(missing))));
}

/// A DSP-1760 that sends messages until it is in configuration mode, and keeps its rate when
/// it is stubborn.
#[derive(Default)]
struct FakeDsp1760 {
    deaf_queries: u32,
    stubborn: bool,
    configuring: bool,
    rate: Option<OutputRate>,
    heard: Vec<Command>,
}

impl Part for FakeDsp1760 {
    fn take(&mut self, sent: &[u8]) -> Vec<u8> {
        let command = Command::parse(sent).expect("a line");
        self.heard.push(command);
        // What was on its way, a line end among it.
        let mut answer = b"\xFE\x81\xFF\x55\n\x00DR,\x00".to_vec();
        match command {
            Command::Configure(on) => self.configuring = on,
            Command::Rate(rate) if self.configuring && !self.stubborn => self.rate = Some(rate),
            Command::QueryRate if self.deaf_queries > 0 => self.deaf_queries -= 1,
            Command::QueryRate => {
                answer.extend(Reply::Rate(self.rate.unwrap_or(OutputRate::HZ_1000)).emit().bytes());
            }
            _ => {}
        }
        answer
    }
}

#[test]
fn a_dsp1760_is_configured() {
    let rate = OutputRate::new(250).expect("offered");
    let config = Dsp1760Config { rate, rotation: Rotation::Rate, ..Dsp1760Config::DEFAULT };
    for deaf_queries in 0..u32::from(dsp1760::ATTEMPTS) {
        let mut port = Port::new(FakeDsp1760 { deaf_queries, ..FakeDsp1760::default() });
        configure(&mut port, &mut dsp1760::Dialogue::new(config), &mut NoopDelay::new()).expect("it answers");
        let part = &port.part;
        assert!(!part.configuring && part.rate == Some(rate));
        let sets = part.heard.iter().filter(|command| **command == Command::Rotation(Rotation::Rate)).count();
        assert_eq!(sets, deaf_queries as usize + 1);
        assert_eq!(part.heard.last(), Some(&Command::Configure(false)));
    }
}

#[test]
fn a_dsp1760_that_does_not_obey_is_given_up() {
    let run = |part| {
        let rate = OutputRate::new(250).expect("offered");
        let config = Dsp1760Config { rate, ..Dsp1760Config::DEFAULT };
        let mut port = Port::new(part);
        let result = configure(&mut port, &mut dsp1760::Dialogue::new(config), &mut NoopDelay::new());
        (result.expect_err("it is given up"), port.looks)
    };
    let (error, looks) = run(FakeDsp1760 { stubborn: true, ..FakeDsp1760::default() });
    assert_eq!(error, SerialError::Part(Dsp1760DialogueError::Rate { got: OutputRate::HZ_1000 }));
    // Three times four pauses of 20 ms and an answer's half second.
    assert_eq!(looks, 3 * (4 * 20 + 500));
    let (error, _) = run(FakeDsp1760 { deaf_queries: u32::MAX, ..FakeDsp1760::default() });
    assert_eq!(error, SerialError::Part(Dsp1760DialogueError::Silent));
    assert_eq!(error.to_string(), "DSP-1760: no answer after 3 attempts");
}

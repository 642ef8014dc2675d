//! The two ends of the Cortex-M examples: a serial port that receives a parked car's samples, and a CAN controller that
//! counts frames and receives those of the wheels. Your HAL has the real ones.

use core::convert::Infallible;
use cortex_m_semihosting::{debug, hprintln};
use embedded_can::{Frame, StandardId};
use embedded_io::{ErrorType, Read, ReadReady};
use gyronet::Micros;
use gyronet::can::DataFrame;
use gyronet::can::bosch::{Message, SignalStatus, TX1_ID};
use gyronet::health::InputCounters;
use gyronet::sample::TestSignal;
use gyronet::sensor::xsens::MtData2;

/// The length of the run, in samples.
const SAMPLES: u32 = 400;
/// The period of the samples, us.
pub const PERIOD_US: u64 = 10_000;
/// The gyro has a bias of 0.5 deg/s.
const PARKED: TestSignal = TestSignal::turning(0.5);
/// Four wheels at 0 km/h, as a Toyota sends them.
const STANDING: [u8; 8] = [0x1A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F, 0x1A, 0x6F];

/// A serial port that has received one message of an MTi at each poll.
#[derive(Default)]
pub struct Port {
    message: heapless::Vec<u8, 72>,
    read: usize,
    number: u32,
    /// Nothing was waiting at the last poll, so the next message is.
    has_paused: bool,
}

impl ErrorType for Port {
    type Error = Infallible;
}

impl ReadReady for Port {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        if self.read < self.message.len() {
            return Ok(true);
        }
        self.has_paused = !self.has_paused;
        if self.has_paused {
            self.message = MtData2::of(&PARKED.sample(self.number), self.number as u16).emit();
            (self.read, self.number) = (0, self.number + 1);
        }
        Ok(self.has_paused)
    }
}

impl Read for Port {
    fn read(&mut self, to: &mut [u8]) -> Result<usize, Infallible> {
        let waiting = self.message.get(self.read..).unwrap_or_default();
        let count = waiting.len().min(to.len());
        to[..count].copy_from_slice(&waiting[..count]);
        self.read += count;
        Ok(count)
    }
}

/// A CAN controller that counts frames, keeps the last yaw rate, and has received a wheel frame at each poll.
#[derive(Default)]
pub struct Controller {
    frames: u32,
    last: Option<Message>,
    received: bool,
}

impl embedded_can::nb::Can for Controller {
    type Frame = DataFrame;
    type Error = Infallible;

    fn transmit(&mut self, frame: &DataFrame) -> nb::Result<Option<DataFrame>, Infallible> {
        self.frames += 1;
        if frame.id() == TX1_ID.into() {
            self.last = Message::parse(frame.data()).ok();
        }
        Ok(None)
    }

    fn receive(&mut self) -> nb::Result<DataFrame, Infallible> {
        self.received = !self.received;
        let frame = StandardId::new(0xAA).and_then(|id| DataFrame::new(id, &STANDING));
        frame.filter(|_| self.received).ok_or(nb::Error::WouldBlock)
    }
}

/// Ends the run with the last sample, which arrives at `now`. The exit status is 0 when all frames of every sample were
/// sent, the last rate is valid and nothing was refused.
pub fn exit_at_the_end(now: Micros, can: &Controller, inputs: &InputCounters) {
    if now.0 < u64::from(SAMPLES - 1) * PERIOD_US {
        return;
    }
    let complete = can.frames == 6 * SAMPLES && *inputs == InputCounters::NONE;
    let good = can.last.as_ref().filter(|tx1| complete && tx1.rate_status == SignalStatus::OK);
    if let Some(tx1) = good {
        let milli_deg = (1e3 * tx1.rate_deg_per_sec()) as i32;
        hprintln!("{} frames; corrected yaw rate {} millidegrees a second", can.frames, milli_deg);
    }
    debug::exit(if good.is_some() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
}

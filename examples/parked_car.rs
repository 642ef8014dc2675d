//! The two ends of the Cortex-M examples: a serial port that receives a parked car's samples, and a CAN controller that
//! counts frames. Your HAL has the real ones.

use core::convert::Infallible;
use cortex_m_semihosting::{debug, hprintln};
use embedded_can::Frame;
use embedded_io::{ErrorType, Read, ReadReady};
use gyronet::Micros;
use gyronet::can::DataFrame;
use gyronet::can::bosch::{SignalStatus, TX1_ID, Tx1};
use gyronet::sensor::xsens::MtData2;

/// The length of the run, in samples.
const SAMPLES: u32 = 400;
/// The period of the samples, us.
pub const PERIOD_US: u64 = 10_000;

/// A serial port that has received one message of an MTi at each poll.
#[derive(Default)]
pub struct Port {
    message: heapless::Vec<u8, 64>,
    read: usize,
    sent: u32,
}

impl ErrorType for Port {
    type Error = Infallible;
}

impl ReadReady for Port {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        if self.read < self.message.len() {
            return Ok(true);
        }
        // A bias, and one bit of noise: the monitor reports an axis without noise as stuck.
        let noise = 0.001 * (self.sent % 2) as f32;
        let message = MtData2 {
            packet_counter: Some(self.sent as u16),
            sample_time_fine: Some(100 * self.sent),
            acceleration: Some([noise, noise, 9.81 + noise]),
            rate_of_turn: Some([noise, noise, 0.01 + noise]),
            temperature: None,
            status: Some(3),
        };
        // A message of these fields has 54 bytes.
        self.message.clear();
        let _ = self.message.extend_from_slice(&message.emit());
        (self.read, self.sent) = (0, self.sent + 1);
        Ok(true)
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

/// A CAN controller that counts frames and keeps the last yaw rate.
#[derive(Default)]
pub struct Bus {
    frames: u32,
    last: Option<Tx1>,
}

impl embedded_can::nb::Can for Bus {
    type Frame = DataFrame;
    type Error = Infallible;

    fn transmit(&mut self, frame: &DataFrame) -> nb::Result<Option<DataFrame>, Infallible> {
        self.frames += 1;
        if frame.id() == TX1_ID.into() {
            self.last = Tx1::parse(frame.data()).ok();
        }
        Ok(None)
    }

    fn receive(&mut self) -> nb::Result<DataFrame, Infallible> {
        Err(nb::Error::WouldBlock)
    }
}

/// Ends the run with the last sample, which arrives at `now`. The exit status is 0 when all frames of every sample were
/// sent, the last rate is valid and `errors` is 0.
pub fn exit_at_the_end(now: Micros, bus: &Bus, errors: u32) {
    if now.0 < u64::from(SAMPLES - 1) * PERIOD_US {
        return;
    }
    let complete = bus.frames == 6 * SAMPLES && errors == 0;
    let good = bus.last.as_ref().filter(|tx1| complete && tx1.yaw_rate_status == SignalStatus::OK);
    if let Some(tx1) = good {
        let milli_deg = (1e3 * tx1.yaw_rate_deg_per_sec()) as i32;
        hprintln!("{} frames; corrected yaw rate {}e-3 deg/s", bus.frames, milli_deg);
    }
    debug::exit(if good.is_some() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
}

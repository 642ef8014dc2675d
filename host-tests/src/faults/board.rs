//! The board on the host, a millisecond at a time: bytes of the sensor and wheel lines in, bytes of the CAN line out.

use super::drive::START_US;
use super::fault::Line;
use super::input::{Delivered, Input};
use super::line::Message;
use super::networks::Networks;
use embedded_can::{Frame, Id};
use gyronet::align::clock_ratio::ClockRatioConfig;
use gyronet::bias::Latitude;
use gyronet::can::slcan::port::Port;
use gyronet::can::yaw::FOG_IDS;
use gyronet::coprocessor::{Config, Coprocessor, Sink, TimedFrame};
use gyronet::estimate::{VehicleSample, YawEstimate};
use gyronet::fog::FogConfig;
use gyronet::sample::PERIOD_US;
use gyronet::units::Micros;
use gyronet_tools::drive::wheel_frames;
use gyronet_tools::parts::Part;

/// Capacity of the queue of outgoing frames, as in the image.
const QUEUE: usize = 24;
/// The board polls this often, microseconds.
pub const TURN_US: u64 = 1_000;

#[derive(Debug, Clone)]
pub struct Board {
    pub input: Input,
    pub coprocessor: Coprocessor,
    port: Port<QUEUE>,
    /// Row of the newest sample.
    row: usize,
    pub newest: Option<VehicleSample>,
}

impl Board {
    pub fn new(part: Part, fog_expected: bool) -> Self {
        let config = Config {
            wheels: Some(wheel_frames::receiver()),
            fog_expected,
            clock_ratio: Some(ClockRatioConfig::DEFAULT),
            // The drives' increments contain no Earth's rate.
            fog: FogConfig { latitude: Latitude::from_degrees(0.0), ..FogConfig::DEFAULT },
            ..Config::DEFAULT
        };
        Self {
            input: Input::new(part),
            port: Port::new(config.can.settings().bits_per_second),
            coprocessor: Coprocessor::new(config),
            row: 0,
            newest: None,
        }
    }

    /// Runs the board until `end`, during this row of the drive, and returns the messages that it sends.
    pub fn run(
        &mut self,
        row: usize,
        (start, end): (u64, u64),
        messages: &mut std::iter::Peekable<impl Iterator<Item = Message>>,
        networks: &mut Networks,
    ) -> Vec<Message> {
        let (mut now, mut out) = (start, Vec::new());
        while now < end {
            now = (now + TURN_US).min(end);
            while let Some(message) = messages.next_if(|message| message.at <= now) {
                self.receive(&message, Micros(now), networks, &mut out);
            }
            // Frames of the inertial sensor without a sample are those of its silence.
            let mut sending = Sending { port: &mut self.port, out: &mut out, now, row, fog_row: None };
            if let Ok(Some(_)) = self.coprocessor.poll(Micros(now), &mut sending) {
                self.row = row;
            }
            networks.run(&mut self.coprocessor);
        }
        out
    }

    fn receive(&mut self, message: &Message, now: Micros, networks: &mut Networks, out: &mut Vec<Message>) {
        if message.line == Line::Wheels {
            for byte in &message.bytes {
                if let Some(frame) = self.port.receive(*byte) {
                    // The coprocessor counts refused frames and samples.
                    let _ = self.coprocessor.can(&frame, now);
                }
            }
            return;
        }
        for delivered in self.input.receive(message, now) {
            if let Delivered::Imu(Some(_)) = delivered {
                self.row = message.row;
            }
            let mut sending = Sending { port: &mut self.port, out, now: now.0, row: self.row, fog_row: None };
            match delivered {
                Delivered::Imu(Some(sample)) => {
                    if let Ok(Some(observed)) = self.coprocessor.imu(sample, now, &mut sending) {
                        self.newest = Some(observed.vehicle);
                    }
                }
                Delivered::Fog(Some(sample)) => {
                    let _ = self.coprocessor.fog(sample, now, &mut sending);
                }
                Delivered::Imu(None) => self.coprocessor.imu_error(),
                Delivered::Fog(None) => self.coprocessor.fog_error(),
            }
            networks.run(&mut self.coprocessor);
        }
    }
}

/// The way of the frames of one input: through the SLCAN port at once.
struct Sending<'a> {
    port: &'a mut Port<QUEUE>,
    out: &'a mut Vec<Message>,
    now: u64,
    /// Row of the drive that the inertial sensor's frames belong to.
    row: usize,
    /// That of the fibre-optic gyro's frames, whose ticks follow the board's clock.
    fog_row: Option<usize>,
}

impl Sink for Sending<'_> {
    fn frame(&mut self, sent: TimedFrame) {
        let is_fog = |id: Id| FOG_IDS.iter().any(|own| matches!(id, Id::Standard(id) if id.as_raw() == *own));
        let row = self.fog_row.filter(|_| is_fog(sent.frame.id())).unwrap_or(self.row);
        self.port.enqueue(sent.frame, Micros(self.now));
        while let Some(line) = self.port.outgoing() {
            let bytes = line.to_vec();
            self.port.sent(bytes.len());
            self.out.push(Message { line: Line::Out, row, at: self.now, bytes });
        }
    }

    fn fog_rate(&mut self, rate: &YawEstimate) {
        self.fog_row = Some((u64::from(rate.tick).saturating_sub(START_US / PERIOD_US + 1)) as usize);
    }
}

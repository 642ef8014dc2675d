//! This module models the board on the host, a millisecond at a time: its input is the bytes of the sensor and wheel
//! lines, its output the bytes of the CAN line.
//!
//! The model does the image's input and output around the library's [`Coprocessor`]: parsers, SLCAN port, networks.

use super::drive::START_US;
use super::fault::Line;
use super::input::{Delivered, Input};
use super::networks::Networks;
use super::wire::Message;
use crate::drive::wheel_frames;
use crate::parts::Part;
use embedded_can::{Frame, Id};
use gyronet::align::clock_ratio::ClockRatioConfig;
use gyronet::bias::Latitude;
use gyronet::can::slcan::port::Port;
use gyronet::can::yaw::FOG_IDS;
use gyronet::coprocessor::{Config, Coprocessor, Sink, TimedFrame};
use gyronet::estimate::YawEstimate;
use gyronet::fog::FogConfig;
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::PERIOD_US;
use gyronet::units::{AngularRate, Micros};

/// Capacity of the queue of outgoing frames, as in the image.
const QUEUE: usize = 24;

/// Holds the complete state of a board.
#[derive(Debug, Clone)]
pub struct Board {
    input: Input,
    coprocessor: Coprocessor,
    port: Port<QUEUE>,
    /// Row of the newest sample.
    row: usize,
}

impl Board {
    /// Creates a board before its first byte.
    #[must_use]
    pub fn new(part: Part, pipeline: PipelineConfig) -> Self {
        let wheels = Some(wheel_frames::receiver());
        let config = Config {
            pipeline,
            wheels,
            fog_expected: part == Part::Dsp1760,
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
        }
    }

    /// Returns the gyro's static bias; zero before it is known.
    #[must_use]
    pub fn gyro_bias(&self) -> [AngularRate; 3] {
        self.coprocessor.pipeline().gyro_bias().unwrap_or_default()
    }

    /// Processes a message that arrives at `now` and appends the messages that the board sends.
    pub fn receive(
        &mut self,
        message: &Message,
        now: Micros,
        networks: &mut impl Networks,
        out: &mut Vec<Message>,
    ) {
        match message.line {
            Line::Sensor | Line::Gyro => {
                for delivered in self.input.receive(message, now) {
                    let row = if let Delivered::Imu(Some(_)) = delivered { message.row } else { self.row };
                    let mut sent = Sending { port: &mut self.port, out, now, row, fog_row: None };
                    match delivered {
                        // The coprocessor counts refused samples.
                        Delivered::Imu(Some(sample)) => {
                            self.row = row;
                            let _ = self.coprocessor.imu(sample, now, &mut sent);
                        }
                        Delivered::Fog(Some(sample)) => {
                            let _ = self.coprocessor.fog(sample, now, &mut sent);
                        }
                        Delivered::Imu(None) => self.coprocessor.imu_error(),
                        Delivered::Fog(None) => self.coprocessor.fog_error(),
                    }
                    self.run(networks);
                }
            }
            Line::Wheels => {
                for byte in &message.bytes {
                    let Some(frame) = self.port.receive(*byte) else { continue };
                    let _ = self.coprocessor.can(&frame, now);
                }
            }
            Line::Out => {}
        }
    }

    /// Polls the board at `now`, during this row of the drive, without an incoming byte.
    pub fn poll(&mut self, now: Micros, row: usize, networks: &mut impl Networks, out: &mut Vec<Message>) {
        // Frames of the inertial sensor without a sample are those of its silence.
        let mut sent = Sending { port: &mut self.port, out, now, row, fog_row: None };
        if let Ok(Some(_)) = self.coprocessor.poll(now, &mut sent) {
            self.row = row;
        }
        self.run(networks);
    }

    /// Returns the sum of all counters of errors on the board.
    #[must_use]
    pub fn events(&self) -> u64 {
        let pipeline = self.coprocessor.pipeline().counters();
        let monitor = self.coprocessor.monitor_counters();
        let (fog, inputs) = (self.coprocessor.fog_counters(), self.coprocessor.input_counters());
        let all = [
            self.input.bad_frames(),
            self.port.refused(),
            self.port.dropped(),
            inputs.imu_errors,
            inputs.fog_errors,
            inputs.wheel_errors,
            monitor.silences,
            monitor.stuck,
            monitor.held,
            monitor.wrong,
            monitor.clock_off,
            pipeline.missing,
            pipeline.misplaced,
            pipeline.clock_jumps,
            pipeline.invalid,
            pipeline.moving,
            pipeline.implausible,
            pipeline.late,
            pipeline.contradicted,
            fog.misplaced,
            fog.gaps,
            fog.stuck,
            fog.late,
            fog.implausible,
            fog.broken,
        ];
        all.iter().map(|count| u64::from(*count)).sum()
    }

    /// Runs the windows that are due.
    fn run(&mut self, networks: &mut impl Networks) {
        if let Some(due) = self.coprocessor.window() {
            let estimate = networks.window(&due.features);
            self.coprocessor.deliver(due.end, estimate).expect("the window that is due");
        }
        let estimate =
            self.coprocessor.fog_window().map(|(number, window)| (number, networks.minute(&window)));
        if let Some((number, estimate)) = estimate {
            self.coprocessor.deliver_fog(number, estimate).expect("the window that is due");
        }
    }
}

/// The way of the frames of one input: through the SLCAN port at once.
struct Sending<'a> {
    port: &'a mut Port<QUEUE>,
    out: &'a mut Vec<Message>,
    now: Micros,
    /// Row of the drive that the inertial sensor's frames belong to.
    row: usize,
    /// That of the fibre-optic gyro's frames, whose ticks follow the board's clock.
    fog_row: Option<usize>,
}

impl Sink for Sending<'_> {
    fn frame(&mut self, sent: TimedFrame) {
        let is_fog = |id: Id| FOG_IDS.iter().any(|own| matches!(id, Id::Standard(id) if id.as_raw() == *own));
        let row = self.fog_row.filter(|_| is_fog(sent.frame.id())).unwrap_or(self.row);
        self.port.enqueue(sent.frame, self.now);
        while let Some(line) = self.port.outgoing() {
            let bytes = line.to_vec();
            self.port.sent(bytes.len());
            self.out.push(Message { line: Line::Out, row, at: self.now.0, bytes });
        }
    }

    fn fog_rate(&mut self, rate: &YawEstimate) {
        self.fog_row = Some((u64::from(rate.tick).saturating_sub(START_US / PERIOD_US + 1)) as usize);
    }
}

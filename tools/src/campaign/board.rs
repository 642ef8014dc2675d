//! The board on the host: bytes of its lines in, bytes of its line out, a millisecond at a time.
//!
//! What it does is the image's main loop with the library's parts: sensor, watch and pipeline,
//! network, feeds, SLCAN port, wheel frames.

use super::fault::Line;
use super::input::{Delivered, Input};
use super::part::Part;
use super::wire::Message;
use gyronet::can::config::Config;
use gyronet::can::feeds::Feeds;
use gyronet::can::slcan::port::Port;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::guard::Guard;
use gyronet::model::{Estimate, WindowNetwork};
use gyronet::pipeline::PipelineConfig;
use gyronet::sample::{ImuSample, PERIOD_US};
use gyronet::units::{AngularRate, Micros};
use gyronet::vehicle::VehicleSample;
use gyronet::window::{Features, WINDOW};
use std::collections::HashMap;
use std::sync::OnceLock;

/// Frames that may wait, as in the image.
const QUEUE: usize = 24;

/// The windows of an undamaged drive, at whatever sample they end, and what the network says of
/// each once it has been asked.
pub type Known = HashMap<[Features; WINDOW], OnceLock<Estimate>>;

/// A network that is asked once about what an undamaged drive shows it: of a run little is new.
pub struct Remembering<'a, N> {
    /// The network itself.
    pub network: &'a mut N,
    /// What it need not be asked twice.
    pub known: &'a Known,
}

impl<N: WindowNetwork> WindowNetwork for Remembering<'_, N> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        let Self { network, known } = self;
        match known.get(window) {
            Some(answer) => *answer.get_or_init(|| network.estimate(window)),
            None => network.estimate(window),
        }
    }
}

/// All state of a board.
#[derive(Debug, Clone)]
pub struct Board {
    input: Input,
    guard: Guard,
    feeds: Feeds,
    port: Port<QUEUE>,
    wheels: WheelReceiver,
    /// What parsers refused.
    refused: u32,
    /// Row that the board is told of.
    row: usize,
}

impl Board {
    /// Before the first byte.
    #[must_use]
    pub fn new(part: Part, config: PipelineConfig) -> Self {
        Self {
            input: Input::new(part),
            guard: Guard::new(config),
            feeds: Feeds::new(Config::DEFAULT),
            port: Port::new(Config::DEFAULT.settings().bits_per_second),
            wheels: WheelReceiver::new(WheelSettings::TOYOTA).expect("settings that come with the library"),
            refused: 0,
            row: 0,
        }
    }

    /// The watch and the pipeline.
    pub fn guard(&mut self) -> &mut Guard {
        &mut self.guard
    }

    /// What makes frames of samples.
    pub fn feeds(&mut self) -> &mut Feeds {
        &mut self.feeds
    }

    /// What knows of the wheels.
    pub fn wheels(&mut self) -> &mut WheelReceiver {
        &mut self.wheels
    }

    /// The gyro's static bias, zero before it is known.
    pub fn gyro_bias(&mut self) -> [AngularRate; 3] {
        self.guard.pipeline().gyro_bias().unwrap_or_default()
    }

    /// Takes what comes at `now`; what goes out is appended.
    pub fn receive(
        &mut self,
        message: &Message,
        now: Micros,
        network: &mut impl WindowNetwork,
        out: &mut Vec<Message>,
    ) {
        match message.line {
            Line::Sensor | Line::Gyro => {
                self.row = message.row;
                for delivered in self.input.receive(message, now) {
                    self.take(delivered, now, network, out);
                }
            }
            Line::Wheels => {
                for byte in &message.bytes {
                    let Some(frame) = self.port.receive(*byte) else { continue };
                    let taken = self.wheels.process(&frame, now);
                    self.refused += u32::from(matches!(taken, Some(Err(_))));
                }
            }
            Line::Out => {}
        }
    }

    /// What is due at `now` without a byte.
    pub fn poll(
        &mut self,
        now: Micros,
        row: usize,
        network: &mut impl WindowNetwork,
        out: &mut Vec<Message>,
    ) {
        for delivered in self.input.poll(now) {
            if let Delivered::Sample(sample) = delivered {
                // The grid's time says which row it is.
                let late = now.0.saturating_sub(sample.time.0) / PERIOD_US;
                self.row = row.saturating_sub(late as usize);
            }
            self.take(delivered, now, network, out);
        }
        if let Some(silent) = self.guard.poll(now) {
            self.row = row;
            self.send(&silent, now, out);
        }
    }

    /// Whatever the board counts of what went wrong.
    pub fn events(&mut self) -> u64 {
        let watch = *self.guard.counters();
        let pipeline = *self.guard.pipeline().counters();
        let all = [
            self.refused,
            self.input.bad_frames(),
            self.port.refused(),
            self.port.dropped(),
            watch.silences,
            watch.stuck,
            watch.held,
            watch.wrong,
            pipeline.missing,
            pipeline.misplaced,
            pipeline.clock_jumps,
            pipeline.clipped,
            pipeline.moving,
            pipeline.implausible,
            pipeline.late,
            pipeline.contradicted,
        ];
        all.iter().map(|count| u64::from(*count)).sum()
    }

    fn take(
        &mut self,
        delivered: Delivered,
        now: Micros,
        network: &mut impl WindowNetwork,
        out: &mut Vec<Message>,
    ) {
        match delivered {
            Delivered::Sample(sample) => self.process(sample, now, network, out),
            Delivered::Error => self.refused += 1,
        }
    }

    fn process(
        &mut self,
        sample: ImuSample,
        now: Micros,
        network: &mut impl WindowNetwork,
        out: &mut Vec<Message>,
    ) {
        if let Some(known) = self.wheels.poll(now) {
            self.guard.wheels(known);
        }
        // What has no place in time is counted and gives no frame.
        let Ok(output) = self.guard.process(sample, now) else { return };
        self.send(&output.vehicle, now, out);
        if let Some(due) = output.window {
            self.guard.pipeline().deliver(due.end, network.estimate(&due.features));
        }
    }

    fn send(&mut self, vehicle: &VehicleSample, now: Micros, out: &mut Vec<Message>) {
        for frame in &self.feeds.process(vehicle) {
            self.port.push(*frame, now);
        }
        while let Some(line) = self.port.outgoing() {
            let bytes = line.to_vec();
            self.port.sent(bytes.len());
            out.push(Message { line: Line::Out, row: self.row, at: now.0, bytes });
        }
    }
}

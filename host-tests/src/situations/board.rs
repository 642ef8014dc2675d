//! The board on the host: bytes of the sensor and wheel frames in, frames out, a millisecond at a time.

use super::icm42688::Simulated;
use super::sensor::LATITUDE;
use super::vehicle::Part;
use crate::flash::Region;
use crate::spi::{NoDelay, Select};
use gyronet::can::DataFrame;
use gyronet::can::config::{Config as CanConfig, Settings, StatusSettings, YawSettings};
use gyronet::can::status::STATUS_ID;
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::coprocessor::{Bus, Config, Coprocessor, Sink, TimedFrame};
use gyronet::model::{Blob, GyroNet, weights};
use gyronet::sample::ImuSample;
use gyronet::sensor::dsp1760::Dsp1760;
use gyronet::sensor::icm42688::Icm42688;
use gyronet::sensor::xsens::Mti;
use gyronet::sensor::{ByteSource, Source};
use gyronet::service::{Device, SupportedHardware};
use gyronet::store::{Calibration, Configuration, FogPart, ImuPart, Learned};
use gyronet::units::Micros;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

const HARDWARE: SupportedHardware =
    SupportedHardware { imus: &[ImuPart::XsensMti], fogs: &[], gnss: false, fd: false, clock_hz: 0 };
/// The board fetches at most this many packets from a FIFO at once.
const MAX_FETCHED: usize = 32;

enum Line {
    Mti(Box<Mti>),
    Fifo(Box<Icm42688<Select<Simulated>>>, Rc<RefCell<Simulated>>),
}

/// The samples that wait for the coprocessor; `None` where bytes gave none.
#[derive(Default)]
struct Waiting(VecDeque<Option<ImuSample>>);

impl Source for Waiting {
    type Sample = ImuSample;
    type Error = std::fmt::Error;

    fn next_sample(&mut self) -> Option<Result<ImuSample, Self::Error>> {
        self.0.pop_front().map(|sample| sample.ok_or(std::fmt::Error))
    }
}

#[derive(Default)]
struct Wire {
    received: VecDeque<DataFrame>,
    sent: Vec<DataFrame>,
}

impl Sink for Wire {
    fn frame(&mut self, frame: TimedFrame) {
        self.sent.push(frame.frame);
    }
}

impl Bus for Wire {
    fn receive(&mut self) -> Option<DataFrame> {
        self.received.pop_front()
    }

    fn flush(&mut self) {}

    fn lost(&self) -> u32 {
        0
    }
}

pub struct Board {
    pub coprocessor: Box<Coprocessor>,
    device: Box<Device<Region, Region>>,
    network: GyroNet<'static>,
    line: Line,
    fibre_optic: Dsp1760,
    waiting: Waiting,
    wire: Wire,
}

impl Board {
    pub fn new(part: Part, has_wheels: bool, period_ms: u16, learned: &Learned) -> Self {
        let yaw = Settings::DEFAULT.yaw.map(|yaw| YawSettings { period_ms, ..yaw });
        let status = Some(StatusSettings { id: STATUS_ID });
        let can = CanConfig::new(Settings { bosch: None, yaw, status, ..Settings::DEFAULT });
        let fog = (part == Part::Dsp1760).then_some(FogPart::Dsp1760);
        let configuration = Configuration { fog, latitude_deg: Some(LATITUDE), ..Configuration::DEFAULT };
        let config = Config {
            can: can.expect("a period of the handbook"),
            wheels: has_wheels
                .then(|| WheelReceiver::new(WheelSettings::TOYOTA).expect("the library's settings")),
            clock_is_exact: true,
            ..configuration.coprocessor(&Calibration::NONE, learned, 0)
        };
        let blob = Blob::new_checked(&weights::DEFAULT.0).expect("the library's weights");
        let line = match part {
            Part::Icm42688 => {
                let part = Rc::default();
                let driver = Icm42688::new(Select(Rc::clone(&part), 0), &mut NoDelay);
                Line::Fifo(Box::new(driver.expect("a simulated part that is well")), part)
            }
            Part::Xsens | Part::Dsp1760 => Line::Mti(Box::default()),
        };
        Self {
            coprocessor: Box::new(Coprocessor::new(config)),
            device: Box::new(Device::new(&HARDWARE)),
            network: GyroNet::new(blob),
            line,
            fibre_optic: Dsp1760::new(),
            waiting: Waiting::default(),
            wire: Wire::default(),
        }
    }

    pub fn learned(&self) -> Learned {
        *self.device.learned()
    }

    pub fn receive(&mut self, bytes: &[u8]) {
        let waiting = &mut self.waiting.0;
        match &mut self.line {
            Line::Mti(mti) => {
                for byte in bytes {
                    mti.receive(*byte);
                    waiting.extend(std::iter::from_fn(|| mti.next_sample()).map(Result::ok));
                }
            }
            Line::Fifo(driver, part) => {
                part.borrow_mut().fifo.extend(bytes);
                let samples = std::iter::from_fn(|| driver.next_sample().transpose()).take(MAX_FETCHED);
                waiting.extend(samples.map(Result::ok));
            }
        }
    }

    pub fn receive_fibre_optic(&mut self, bytes: &[u8], now: Micros) {
        for byte in bytes {
            self.fibre_optic.receive(*byte);
            while let Some(sample) = self.fibre_optic.next_sample() {
                match sample {
                    // What is refused is counted.
                    Ok(sample) => drop(self.coprocessor.fog(sample, now, &mut self.wire)),
                    Err(_) => self.coprocessor.fog_error(),
                }
            }
        }
    }

    pub fn receive_frame(&mut self, frame: DataFrame) {
        self.wire.received.push_back(frame);
    }

    pub fn step(&mut self, now: Micros) -> Vec<DataFrame> {
        let Self { coprocessor, device, network, waiting, wire, .. } = self;
        if let Some(seen) = coprocessor.step(now, waiting, wire, Some(network)).observation {
            device.observed(&seen);
            if device.take_mount_moved() {
                coprocessor.mount_moved();
            }
        }
        std::mem::take(&mut wire.sent)
    }
}

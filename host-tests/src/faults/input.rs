//! The board's end of a sensor's line: the library's parsers turn bytes into samples.

use super::fault::Line;
use super::line::Message;
use gyronet::sample::{FogSample, ImuSample};
use gyronet::sensor::adis16465::{Adis16465, BURST};
use gyronet::sensor::dsp1760::{Dsp1760, Dsp1760Config};
use gyronet::sensor::icm42688::{Icm42688, Icm42688Config};
use gyronet::sensor::xsens::Mti;
use gyronet::units::Micros;
use gyronet_tools::parts::icm42688::{Bus, NoDelay};
use gyronet_tools::parts::{Part, adis16465};

/// The board fetches at most this many packets from a FIFO at once.
const MAX_FETCHED: usize = 32;

#[derive(Debug, Clone)]
pub enum Input {
    Xsens(Box<Mti>),
    /// A DSP-1760 and the MTi beside it.
    Dsp1760(Box<(Dsp1760, Mti)>),
    Icm42688(Fifo),
    Adis16465(Bursts),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Delivered {
    /// `None` if the bytes gave no sample.
    Imu(Option<ImuSample>),
    Fog(Option<FogSample>),
}

impl Input {
    pub fn new(part: Part) -> Self {
        match part {
            Part::Xsens => Self::Xsens(Box::default()),
            Part::Dsp1760 => Self::Dsp1760(Box::new((Dsp1760::new(Dsp1760Config::DEFAULT), Mti::new()))),
            Part::Icm42688 => Self::Icm42688(Fifo::new(None)),
            Part::Adis16465 => Self::Adis16465(Bursts::new(None)),
        }
    }

    pub fn receive(&mut self, message: &Message, now: Micros) -> Vec<Delivered> {
        let mut delivered = Vec::new();
        match self {
            Self::Xsens(mti) => imu(mti, &message.bytes, &mut delivered),
            Self::Dsp1760(parts) if message.line == Line::Gyro => {
                for byte in &message.bytes {
                    parts.0.receive(*byte);
                    let samples = std::iter::from_fn(|| parts.0.next_sample());
                    delivered.extend(samples.map(|sample| Delivered::Fog(sample.ok())));
                }
            }
            Self::Dsp1760(parts) => imu(&mut parts.1, &message.bytes, &mut delivered),
            Self::Icm42688(fifo) => fifo.receive(&message.bytes, &mut delivered),
            Self::Adis16465(bursts) => delivered.push(bursts.receive(&message.bytes, now)),
        }
        delivered
    }

    /// Damaged or lost frames that the parsers have counted.
    pub fn bad_frames(&self) -> u32 {
        match self {
            Self::Xsens(mti) => mti.bad_checksums(),
            Self::Dsp1760(parts) => {
                parts.0.bad_checksums() + parts.0.counters().lost + parts.1.bad_checksums()
            }
            Self::Icm42688(_) | Self::Adis16465(_) => 0,
        }
    }
}

fn imu(mti: &mut Mti, bytes: &[u8], delivered: &mut Vec<Delivered>) {
    for byte in bytes {
        mti.receive(*byte);
        delivered.extend(std::iter::from_fn(|| mti.next_sample()).map(|sample| Delivered::Imu(sample.ok())));
    }
}

/// Reads an ICM-42688-P on its simulated bus.
#[derive(Debug)]
pub struct Fifo {
    driver: Icm42688<Bus>,
    bus: Bus,
    /// The last good packet and its time.
    last: Option<(Vec<u8>, u64)>,
    /// The board's time when the driver's clock started, microseconds.
    epoch: u64,
}

impl Fifo {
    /// Creates a driver and feeds it the last packet, because a driver's state cannot be copied.
    fn new(last: Option<(Vec<u8>, u64)>) -> Self {
        let bus = Bus::default();
        let driver = Icm42688::new(bus.clone(), Icm42688Config::default(), &mut NoDelay);
        let mut fifo =
            Self { driver: driver.expect("a simulated part that is well"), bus, last: None, epoch: 0 };
        if let Some((packet, time)) = &last {
            fifo.receive(packet, &mut Vec::new());
            let (_, began) = fifo.last.take().expect("a packet that was good before");
            fifo.epoch = time - began;
        }
        fifo.last = last;
        fifo
    }

    fn receive(&mut self, bytes: &[u8], delivered: &mut Vec<Delivered>) {
        self.bus.fill(bytes.iter().copied());
        for _ in 0..MAX_FETCHED {
            match self.driver.next_sample() {
                Ok(None) => break,
                Ok(Some(sample)) => {
                    let time = Micros(sample.time.0 + self.epoch);
                    self.last = Some((bytes.to_vec(), time.0));
                    delivered.push(Delivered::Imu(Some(ImuSample { time, ..sample })));
                }
                Err(_) => delivered.push(Delivered::Imu(None)),
            }
        }
    }
}

impl Clone for Fifo {
    fn clone(&self) -> Self {
        Self::new(self.last.clone())
    }
}

/// Reads an ADIS16465 on its simulated bus.
#[derive(Debug)]
pub struct Bursts {
    driver: Adis16465<adis16465::Bus>,
    bus: adis16465::Bus,
    last: Option<[u8; BURST]>,
}

impl Bursts {
    fn new(last: Option<[u8; BURST]>) -> Self {
        let bus = adis16465::Bus::default();
        let mut bursts = Self { driver: Adis16465::new(bus.clone(), adis16465::MODEL), bus, last: None };
        if let Some(bytes) = last {
            bursts.receive(&bytes, Micros(0));
        }
        bursts
    }

    /// Reads a burst; bits that the part does not send read as ones.
    fn receive(&mut self, bytes: &[u8], now: Micros) -> Delivered {
        let mut burst = [0xFF; BURST];
        burst.iter_mut().zip(bytes).for_each(|(to, byte)| *to = *byte);
        self.bus.answer(burst);
        self.last = Some(burst);
        Delivered::Imu(self.driver.read(now).ok())
    }
}

impl Clone for Bursts {
    fn clone(&self) -> Self {
        Self::new(self.last)
    }
}

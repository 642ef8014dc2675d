use embedded_can::nb::Can;
use embedded_io::{Read, ReadReady};
use gyronet::can::{config::Config, feeds::Feeds, queue::TransmitQueue};
use gyronet::guard::Guard;
use gyronet::model::{Blob, BlobError, GyroNet, WindowNetwork, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet::sensor::{Source, serial::Serial, xsens::Mti};
use gyronet::units::Micros;
use gyronet::vehicle::VehicleSample;

/// An Xsens MTi on any serial port in, frames on any CAN controller out.
pub struct Coprocessor<UART, CAN: Can> {
    imu: Serial<UART, Mti>,
    can: CAN,
    guard: Guard,
    network: GyroNet<'static>,
    feeds: Feeds,
    /// A controller has fewer places than a sample has frames.
    waiting: TransmitQueue<CAN::Frame, 24>,
    /// Samples that were refused.
    pub refused: u32,
}

impl<UART: Read + ReadReady, CAN: Can> Coprocessor<UART, CAN> {
    /// With the weights that come with the library.
    pub fn new(uart: UART, can: CAN) -> Result<Self, BlobError> {
        Ok(Self {
            imu: Serial::new(uart, Mti::new()),
            can,
            guard: Guard::new(PipelineConfig::DEFAULT),
            network: GyroNet::new(Blob::new_checked(&weights::DEFAULT.0)?),
            feeds: Feeds::new(Config::DEFAULT),
            waiting: TransmitQueue::new(),
            refused: 0,
        })
    }

    /// Takes what the sensor has sent; call it every few milliseconds. `now` is the board's clock.
    pub fn poll(&mut self, now: Micros) {
        while let Some(sample) = self.imu.next_sample() {
            let Ok(Ok(output)) = sample.map(|sample| self.guard.process(sample, now)) else {
                self.refused += 1;
                continue;
            };
            self.send(&output.vehicle);
            if let Some(window) = output.window {
                // Or in a task of lower priority: it is used two samples on, not before.
                self.guard.pipeline().deliver(window.end, self.network.estimate(&window.features));
            }
        }
        // A sensor that has fallen silent is told on the bus, too.
        if let Some(vehicle) = self.guard.poll(now) {
            self.send(&vehicle);
        }
        self.waiting.service(&mut self.can);
    }

    /// The controller, to receive from it.
    pub fn can(&mut self) -> &mut CAN {
        &mut self.can
    }

    /// Frames that waited so long that newer ones took their place.
    pub fn dropped(&self) -> u32 {
        self.waiting.dropped()
    }

    fn send(&mut self, vehicle: &VehicleSample) {
        self.feeds.process(vehicle).into_iter().for_each(|frame| self.waiting.push(frame));
        // What the controller takes at once goes out before the network runs.
        self.waiting.service(&mut self.can);
    }
}

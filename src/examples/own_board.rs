use embedded_can::nb::Can;
use embedded_io::{Read, ReadReady};
use gyronet::can::{config::Config, feeds::Feeds};
use gyronet::guard::Guard;
use gyronet::model::{Blob, BlobError, GyroNet, WindowNetwork, weights};
use gyronet::pipeline::PipelineConfig;
use gyronet::sensor::{Source, serial::Serial, xsens::Mti};
use gyronet::units::Micros;
use gyronet::vehicle::VehicleSample;

/// An Xsens MTi on any serial port in, frames on any CAN controller out.
pub struct Coprocessor<UART, CAN> {
    imu: Serial<UART, Mti>,
    can: CAN,
    guard: Guard,
    network: GyroNet<'static>,
    feeds: Feeds,
    /// Samples that were refused, and frames that the controller did not take.
    pub lost: [u32; 2],
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
            lost: [0; 2],
        })
    }

    /// Takes what the sensor has sent; call it every few milliseconds. `now` is the board's clock.
    pub fn poll(&mut self, now: Micros) {
        while let Some(sample) = self.imu.next_sample() {
            let Ok(Ok(output)) = sample.map(|sample| self.guard.process(sample, now)) else {
                self.lost[0] += 1;
                continue;
            };
            if let Some(window) = output.window {
                // Or in a task of lower priority: it is used two samples on, not before.
                self.guard.pipeline().deliver(window.end, self.network.estimate(&window.features));
            }
            self.send(&output.vehicle);
        }
        // A sensor that has fallen silent is told on the bus, too.
        if let Some(vehicle) = self.guard.poll(now) {
            self.send(&vehicle);
        }
    }

    /// The controller, to receive from it.
    pub fn can(&mut self) -> &mut CAN {
        &mut self.can
    }

    fn send(&mut self, vehicle: &VehicleSample) {
        for frame in self.feeds.process::<CAN::Frame>(vehicle) {
            // A controller that is full says so, or gives back the frame that had to make way.
            let taken = matches!(self.can.transmit(&frame), Ok(None));
            self.lost[1] += u32::from(!taken);
        }
    }
}

use embedded_can::nb::Can;
use embedded_io::{Read, ReadReady};
use gyronet::can::queue::TransmitQueue;
use gyronet::model::{Blob, BlobError, GyroNet, WindowNetwork, weights};
use gyronet::sensor::{Source, serial::Serial, xsens::Mti};
use gyronet::units::Micros;
use gyronet::{Config, Coprocessor};

/// An Xsens MTi on any serial port in, frames on any CAN controller out.
pub struct Board<UART, CAN: Can> {
    imu: Serial<UART, Mti>,
    pub can: CAN,
    /// A controller has fewer places than a sample has frames.
    pub waiting: TransmitQueue<CAN::Frame, 24>,
    pub coprocessor: Coprocessor,
    network: GyroNet<'static>,
}

impl<UART: Read + ReadReady, CAN: Can> Board<UART, CAN> {
    pub fn new(uart: UART, can: CAN) -> Result<Self, BlobError> {
        let network = GyroNet::new(Blob::new_checked(&weights::DEFAULT.0)?);
        let (imu, waiting) = (Serial::new(uart, Mti::new()), TransmitQueue::new());
        Ok(Self { imu, can, waiting, coprocessor: Coprocessor::new(Config::DEFAULT), network })
    }

    /// Call it every few milliseconds; `now` is your clock. What is refused is counted and reported on the bus.
    pub fn poll(&mut self, now: Micros) {
        while let Some(sample) = self.imu.next_sample() {
            match sample {
                Ok(sample) => drop(self.coprocessor.imu(sample, now)),
                Err(_) => self.coprocessor.imu_error(),
            }
            self.send();
            // Or in a task of lower priority: the estimate is used two samples later, not before.
            if let Some(window) = self.coprocessor.window() {
                let _ = self.coprocessor.deliver(window.end, self.network.estimate(&window.features));
            }
        }
        // A sensor that has fallen silent is reported too.
        let _ = self.coprocessor.poll(now);
        self.send();
    }

    fn send(&mut self) {
        while let Some(sent) = self.coprocessor.next_frame() {
            sent.frame.convert().into_iter().for_each(|frame| self.waiting.enqueue(frame));
        }
        self.waiting.service(&mut self.can);
    }
}

//! The coprocessor's firmware, first form: MTData2 bytes on USART1, SLCAN on USART2.
//!
//! It runs the library's pipeline on the reset clock (16 MHz) with its own wiring only: clock
//! tree, CAN peripheral, watchdog and priorities are not in it yet. Both lines receive by
//! interrupt into queues; the main loop does everything else in turn, and waits for nothing.
//!
//! | pin | function |
//! |---|---|
//! | PA10 | USART1 RX, 115200 8N1, Xsens MTi |
//! | PA2, PA3 | USART2 TX, RX, 921600 8N1, SLCAN |
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is a firmware image: build it with `cargo fw`");
}

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::Board;
    use gyronet::can::config::Config;
    use gyronet::can::feeds::Feeds;
    use gyronet::can::slcan::port::Port;
    use gyronet::can::wheel::{WheelReceiver, WheelSettings};
    use gyronet::health::Faults;
    use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
    use gyronet::pipeline::{Pipeline, PipelineConfig};
    use gyronet::sample::ImuSample;
    use gyronet::sensor::xsens::Mti;
    use gyronet::units::Micros;
    use panic_halt as _;

    /// Every message, for a line of 921600; on one of 115200 it is `Config::SLCAN_115200`.
    const CONFIG: Config = Config::DEFAULT;
    /// Frames that may wait for the line: what older ones say is of no use to anybody.
    const QUEUE: usize = 32;

    struct Coprocessor {
        network: Option<GyroNet<'static>>,
        pipeline: Pipeline,
        feeds: Feeds,
        port: Port<QUEUE>,
        /// Frames dropped when the last sample was sent.
        dropped: u32,
        wheels: Option<WheelReceiver>,
        /// A wheel frame has come; a vehicle that sends none is not at fault.
        wheels_heard: bool,
        /// Time stamp of the newest sample: the only clock there is.
        now: Micros,
    }

    impl Coprocessor {
        fn process(&mut self, sample: ImuSample) {
            self.now = sample.time;
            if let (true, Some(wheels)) = (self.wheels_heard, self.wheels.as_mut()) {
                self.pipeline.wheels(wheels.poll(sample.time));
            }
            // What has no place in time is counted and gives no frame.
            let Ok(output) = self.pipeline.process(sample) else { return };
            let mut vehicle = output.vehicle;
            vehicle.yaw.faults = vehicle.yaw.faults.with(self.faults());
            for frame in self.feeds.process(&vehicle) {
                self.port.push(frame, sample.time);
            }
            if let (Some(due), Some(network)) = (output.window, self.network.as_mut()) {
                self.pipeline.deliver(due.end, network.estimate(&due.features));
            }
        }

        /// What the pipeline cannot know.
        fn faults(&mut self) -> Faults {
            let dropped = self.port.dropped();
            let bus = core::mem::replace(&mut self.dropped, dropped) < dropped;
            let bus = if bus { Faults::BUS } else { Faults::NONE };
            if self.network.is_none() { bus.with(Faults::WEIGHTS) } else { bus }
        }

        fn service(&mut self, board: &mut Board) {
            let Self { port, wheels, wheels_heard, now, .. } = self;
            // A byte that the line lost is answered as a bad line, or missing in it.
            let _ = port.service(&mut board.slcan, |frame| {
                if let Some(Some(Ok(_))) = wheels.as_mut().map(|wheels| wheels.process(&frame, *now)) {
                    *wheels_heard = true;
                }
            });
        }
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let mut board = loop {
            // The peripherals are there after a reset; a second entry cannot happen.
            if let Some(board) = Board::new() {
                break board;
            }
        };
        let mut mti = Mti::new();
        let mut coprocessor = Coprocessor {
            // Without good weights the pipeline still runs: every window is late, the status
            // says degraded, and the rate is the gyro's less its static bias.
            network: Blob::new_checked(&weights::DEFAULT.0).ok().map(GyroNet::new),
            pipeline: Pipeline::new(PipelineConfig::DEFAULT),
            feeds: Feeds::new(CONFIG),
            port: Port::new(CONFIG.settings().bits_per_second),
            dropped: 0,
            wheels: WheelReceiver::new(WheelSettings::TOYOTA).ok(),
            wheels_heard: false,
            now: Micros(0),
        };
        loop {
            coprocessor.service(&mut board);
            let Some(byte) = board.imu.receive() else { continue };
            mti.push(byte);
            while let Some(sample) = mti.next_sample() {
                if let Ok(sample) = sample {
                    coprocessor.process(sample);
                }
            }
        }
    }
}

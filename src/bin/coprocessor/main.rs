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
//! | PC6, PC7 | USART6 TX, RX, 115200 8N1, service line |
//!
//! A crash leaves its reason in RAM and resets.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is a firmware image: build it with `cargo fw`");
}

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod crash;
#[cfg(target_os = "none")]
mod flash;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::Board;
    use crate::flash::{Flash, Records, Slots};
    use embedded_io::{Write, WriteReady};
    use gyronet::can::config::Config;
    use gyronet::can::feeds::Feeds;
    use gyronet::can::slcan::port::Port;
    use gyronet::can::wheel::{WheelReceiver, WheelSettings};
    use gyronet::health::{Faults, count};
    use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
    use gyronet::pipeline::Pipeline;
    use gyronet::sample::ImuSample;
    use gyronet::sensor::xsens::Mti;
    use gyronet::service::Device;
    use gyronet::service::frame::Frame;
    use gyronet::service::message::Identity;
    use gyronet::store::ImuPart;
    use gyronet::units::Micros;

    /// What the image drives.
    const PARTS: &[ImuPart] = &[ImuPart::XsensMti];
    /// Bytes of the service line that are looked at before the sensor has its turn again.
    const SERVICE_TURN: usize = 16;
    /// Frames that may wait for the line: what older ones say is of no use to anybody.
    const QUEUE: usize = 32;

    /// Its methods are not inlined: what each needs of the stack is given back when it ends.
    struct Coprocessor {
        device: &'static mut Device<Records, Slots>,
        /// An answer on its way out, and how much of it is.
        answer: Option<(Frame, usize)>,
        network: &'static mut Option<GyroNet<'static>>,
        pipeline: &'static mut Pipeline,
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
        #[inline(never)]
        fn process(&mut self, sample: ImuSample) {
            self.now = sample.time;
            if let (true, Some(wheels)) = (self.wheels_heard, self.wheels.as_mut()) {
                self.pipeline.wheels(wheels.poll(sample.time));
            }
            // What has no place in time is counted and gives no frame.
            let Ok(output) = self.pipeline.process(sample) else { return };
            self.device.observe(&sample, output.prompt.tick, output.prompt.status);
            let mut vehicle = output.vehicle;
            vehicle.yaw.faults = vehicle.yaw.faults.with(self.faults());
            for frame in &self.feeds.process(&vehicle) {
                self.port.push(*frame, sample.time);
            }
            if let (Some(due), Some(network)) = (output.window, self.network.as_mut()) {
                self.pipeline.deliver(due.end, network.estimate(&due.features));
            }
        }

        /// What the pipeline cannot know.
        fn faults(&mut self) -> Faults {
            let dropped = self.port.dropped();
            self.device.lines.unsent = dropped;
            let bus = core::mem::replace(&mut self.dropped, dropped) < dropped;
            let bus = if bus { Faults::BUS } else { Faults::NONE };
            if self.network.is_none() { bus.with(Faults::WEIGHTS) } else { bus }
        }

        #[inline(never)]
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

    impl Coprocessor {
        #[inline(never)]
        fn new(
            device: &'static mut Device<Records, Slots>,
            network: &'static mut Option<GyroNet<'static>>,
            pipeline: &'static mut Pipeline,
        ) -> Self {
            // What is stored has been checked.
            let config = Config::new(device.configuration().can).unwrap_or(Config::DEFAULT);
            Self {
                device,
                answer: None,
                network,
                pipeline,
                feeds: Feeds::new(config),
                port: Port::new(config.settings().bits_per_second),
                dropped: 0,
                wheels: WheelReceiver::new(WheelSettings::TOYOTA).ok(),
                wheels_heard: false,
                now: Micros(0),
            }
        }

        /// The service line's turn: the answer on its way, then the next question.
        #[inline(never)]
        fn answer(&mut self, board: &mut Board) {
            if let Some((frame, sent)) = self.answer.as_mut() {
                while let Some(rest) = frame.get(*sent..).filter(|rest| !rest.is_empty()) {
                    let Ok(true) = board.service.write_ready() else { return };
                    let Ok(len) = board.service.write(rest) else { return };
                    *sent += len;
                }
                self.answer = None;
                if self.device.restart_wanted() {
                    // Bounded; an answer that does not get out keeps nobody from starting anew.
                    let _ = board.service.flush();
                    cortex_m::peripheral::SCB::sys_reset();
                }
            }
            for _ in 0..SERVICE_TURN {
                let Some(byte) = board.service.receive() else { return };
                self.answer = self.device.push(byte, self.pipeline.counters()).map(|frame| (frame, 0));
                if self.answer.is_some() {
                    return;
                }
            }
        }
    }

    /// What is stored, and the weights that are good. Without any the pipeline still runs: every
    /// window is late, the status says degraded, and the rate is the gyro's less its static bias.
    #[inline(never)]
    fn device(identity: Identity, flash: Option<Flash>) -> Option<Loaded> {
        let flash = match flash {
            Some(flash) => Some(&*cortex_m::singleton!(: Flash = flash)?),
            None => None,
        };
        let device = cortex_m::singleton!(: Device<Records, Slots> = const { Device::new(PARTS) })?;
        device.begin(flash.map(Records), flash.map(Slots), identity);
        let blob = device.weights(flash.map(Flash::slots_at_start), &weights::DEFAULT.0);
        Some((device, blob))
    }

    type Loaded = (&'static mut Device<Records, Slots>, Option<Blob<'static>>);

    /// Everything that the image keeps, outside the stack; `None` when it has been made before.
    #[inline(never)]
    fn coprocessor(identity: Identity, flash: Option<Flash>) -> Option<&'static mut Coprocessor> {
        let (device, blob) = device(identity, flash)?;
        let network = cortex_m::singleton!(: Option<GyroNet<'static>> = None)?;
        if let Some(blob) = blob {
            place(network, || GyroNet::new(blob));
        }
        let config = device.configuration().pipeline(device.calibration());
        let pipeline = cortex_m::singleton!(: Option<Pipeline> = None)?;
        let pipeline = place(pipeline, || Pipeline::new(config));
        let coprocessor = cortex_m::singleton!(: Option<Coprocessor> = None)?;
        Some(place(coprocessor, || Coprocessor::new(device, network, pipeline)))
    }

    /// Makes a value where it stays; what that takes of the stack is given back.
    #[inline(never)]
    fn place<T>(slot: &mut Option<T>, make: impl FnOnce() -> T) -> &mut T {
        slot.insert(make())
    }

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let mut board = loop {
            // The peripherals are there after a reset; a second entry cannot happen.
            if let Some(board) = Board::new() {
                break board;
            }
        };
        let (identity, flash) = (board.identity, board.flash.take());
        let Some(coprocessor) = coprocessor(identity, flash) else { cortex_m::peripheral::SCB::sys_reset() };
        let mut mti = Mti::new();
        loop {
            coprocessor.service(&mut board);
            coprocessor.answer(&mut board);
            let Some(byte) = board.imu.receive() else { continue };
            mti.push(byte);
            while let Some(sample) = mti.next_sample() {
                match sample {
                    Ok(sample) => coprocessor.process(sample),
                    Err(_) => count(&mut coprocessor.device.lines.sensor_errors, 1),
                }
            }
        }
    }
}

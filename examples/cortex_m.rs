//! `own_board.rs` on a Cortex-M: put your HAL's serial port and CAN controller where the two mocks
//! are, and your timer where the clock is.
//!
//! `cargo run -p gyronet --example cortex_m --features stm32f405 --target thumbv7em-none-eabihf` runs it in
//! QEMU: four seconds of a parked car; the exit status says whether every frame went out.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is for a Cortex-M: add --features stm32f405 --target thumbv7em-none-eabihf");
}

#[cfg(target_os = "none")]
mod own_board;

#[cfg(target_os = "none")]
mod firmware {
    use crate::own_board::poll;
    use core::convert::Infallible;
    use cortex_m_semihosting::{debug, hprintln};
    use embedded_can::nb::Can;
    use embedded_io::{ErrorType, Read, ReadReady};
    use gyronet::can::DataFrame;
    use gyronet::can::bosch::{SignalStatus, TX1_ID, Tx1};
    use gyronet::model::gyronet::GyroNetState;
    use gyronet::sensor::serial::Serial;
    use gyronet::sensor::xsens::{MtData2, Mti};
    use gyronet::{Blob, Config, Coprocessor, GyroNet, Micros, TransmitQueue, weights};
    use panic_semihosting as _;
    #[expect(unused_imports, reason = "brings the interrupt vectors to the linker")]
    use stm32f4::stm32f405 as _;

    /// Samples of 10 ms.
    const SAMPLES: u32 = 400;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let passed = Blob::new_checked(&weights::DEFAULT.0).is_ok_and(run);
        debug::exit(if passed { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
        loop {
            cortex_m::asm::wfi();
        }
    }

    /// Corrects a parked car's samples. Returns whether every frame went out.
    fn run(weights: Blob<'static>) -> bool {
        // Some 10 and 27 KB: in statics, not on the stack. Both are taken once.
        let Some(coprocessor) = cortex_m::singleton!(: Coprocessor = Coprocessor::START) else {
            return false;
        };
        let Some(state) = cortex_m::singleton!(: GyroNetState = GyroNetState::ZERO) else { return false };
        coprocessor.configure(&Config::DEFAULT);
        let Ok(mut network) = GyroNet::with_state(weights, state) else { return false };
        let mut imu = Serial::new(Port::default(), Mti::new());
        let (mut queue, mut can) = (TransmitQueue::new(), Bus::default());
        for sample in 0..SAMPLES {
            // The clock of your board.
            let now = Micros(u64::from(sample) * 10_000);
            poll(coprocessor, &mut network, &mut imu, &mut queue, &mut can, now);
        }
        let Bus { frames, last } = can;
        let good = last.filter(|tx1| tx1.yaw_rate_status == SignalStatus::OK);
        if let Some(tx1) = good {
            let milli_deg = (1e3 * tx1.yaw_rate_deg_per_sec()) as i32;
            hprintln!("{} frames; corrected yaw rate {}e-3 deg/s", frames, milli_deg);
        }
        let errors = coprocessor.input_counters().imu_errors + queue.dropped();
        frames == 6 * SAMPLES && good.is_some() && errors == 0
    }

    /// A serial port with an MTi at its end: at each poll a message has come.
    #[derive(Default)]
    struct Port {
        message: heapless::Vec<u8, 64>,
        read: usize,
        sent: u32,
    }

    impl ErrorType for Port {
        type Error = Infallible;
    }

    impl ReadReady for Port {
        fn read_ready(&mut self) -> Result<bool, Infallible> {
            if self.read < self.message.len() {
                return Ok(true);
            }
            // A parked car: a bias, and a least bit that moves; an axis without noise is a stuck one.
            let noise = 0.001 * (self.sent % 2) as f32;
            let message = MtData2 {
                packet_counter: Some(self.sent as u16),
                sample_time_fine: Some(100 * self.sent),
                acceleration: Some([noise, noise, 9.81 + noise]),
                rate_of_turn: Some([noise, noise, 0.01 + noise]),
                temperature: None,
                status: Some(3),
            };
            // A message of these fields has 54 bytes.
            self.message.clear();
            let _ = self.message.extend_from_slice(&message.emit());
            (self.read, self.sent) = (0, self.sent + 1);
            Ok(true)
        }
    }

    impl Read for Port {
        fn read(&mut self, to: &mut [u8]) -> Result<usize, Infallible> {
            let waiting = self.message.get(self.read..).unwrap_or_default();
            let count = waiting.len().min(to.len());
            to[..count].copy_from_slice(&waiting[..count]);
            self.read += count;
            Ok(count)
        }
    }

    /// A CAN controller that counts, and keeps the last yaw rate.
    #[derive(Default)]
    pub struct Bus {
        frames: u32,
        last: Option<Tx1>,
    }

    impl Can for Bus {
        type Frame = DataFrame;
        type Error = Infallible;

        fn transmit(&mut self, frame: &DataFrame) -> nb::Result<Option<DataFrame>, Infallible> {
            use embedded_can::Frame;
            self.frames += 1;
            if frame.id() == TX1_ID.into() {
                self.last = Tx1::parse(frame.data()).ok();
            }
            Ok(None)
        }

        fn receive(&mut self) -> nb::Result<DataFrame, Infallible> {
            Err(nb::Error::WouldBlock)
        }
    }
}

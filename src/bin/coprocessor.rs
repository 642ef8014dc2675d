//! The coprocessor's firmware, first form: MTData2 bytes on USART1, SLCAN frames on USART2.
//!
//! It runs the library's pipeline on the reset clock (16 MHz) with its own wiring only: clock
//! tree, CAN peripheral, watchdog and priorities are not in it yet. USART1 receives by
//! interrupt into a queue; the main loop does everything else in turn.
//!
//! | pin | function |
//! |---|---|
//! | PA10 | USART1 RX, 115200 8N1, Xsens MTi |
//! | PA2 | USART2 TX, 115200 8N1, SLCAN |
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is a firmware image: build it with `cargo fw`");
}

#[cfg(target_os = "none")]
#[allow(unsafe_code, reason = "raw register values and the interrupt mask; each block says why it is sound")]
mod board {
    //! Registers of the STM32F405 (RM0090) that this image touches.

    use core::cell::RefCell;
    use cortex_m::interrupt::{Mutex, free};
    use heapless::Deque;
    use stm32f4::stm32f405::{self as pac, Interrupt, NVIC, interrupt};

    /// Reset clock over baud rate: 16 MHz / 115200, rounded (RM0090 30.3.4).
    const BRR_115200: u16 = 139;
    /// Polls before a byte that cannot be sent is given up: about 10 byte times.
    const TX_POLLS: u32 = 10_000;
    /// Bytes that may wait: four windows' worth of computing time at 100 samples a second.
    const QUEUE: usize = 2048;

    static RECEIVED: Mutex<RefCell<Deque<u8, QUEUE>>> = Mutex::new(RefCell::new(Deque::new()));
    static USART1: Mutex<RefCell<Option<pac::USART1>>> = Mutex::new(RefCell::new(None));

    /// The two serial lines.
    pub struct Board {
        slcan: pac::USART2,
        /// Bytes given up because the line did not take them.
        pub unsent: u32,
    }

    impl Board {
        /// Takes the peripherals and starts both lines; `None` when they were taken before.
        pub fn new() -> Option<Self> {
            let p = pac::Peripherals::take()?;
            p.RCC.ahb1enr().modify(|_, w| w.gpioaen().enabled());
            p.RCC.apb1enr().modify(|_, w| w.usart2en().enabled());
            p.RCC.apb2enr().modify(|_, w| w.usart1en().enabled());
            p.GPIOA.moder().modify(|_, w| w.moder2().alternate().moder10().alternate());
            p.GPIOA.afrl().modify(|_, w| w.afrl2().af7());
            p.GPIOA.afrh().modify(|_, w| w.afrh10().af7());
            // SAFETY: any 16-bit value is a valid divider; this one is the stated baud rate.
            p.USART1.brr().write(|w| unsafe { w.bits(BRR_115200) });
            // SAFETY: as above.
            p.USART2.brr().write(|w| unsafe { w.bits(BRR_115200) });
            p.USART1.cr1().write(|w| w.ue().enabled().re().enabled().rxneie().enabled());
            p.USART2.cr1().write(|w| w.ue().enabled().te().enabled());
            free(|cs| USART1.borrow(cs).replace(Some(p.USART1)));
            // SAFETY: the handler is defined below and shares nothing outside its mutexes.
            unsafe { NVIC::unmask(Interrupt::USART1) };
            Some(Self { slcan: p.USART2, unsent: 0 })
        }

        /// The next received byte.
        pub fn receive(&mut self) -> Option<u8> {
            free(|cs| {
                let byte = RECEIVED.borrow(cs).borrow_mut().pop_front()?;
                // There is room again: let the line go on.
                // SAFETY: as in `new`; the mask protects no critical section.
                unsafe { NVIC::unmask(Interrupt::USART1) };
                Some(byte)
            })
        }

        /// Sends bytes, waiting a bounded time for each; counts those it had to give up.
        pub fn send(&mut self, bytes: &[u8]) {
            for byte in bytes {
                let ready = (0..TX_POLLS).any(|_| self.slcan.sr().read().txe().bit_is_set());
                if ready {
                    // SAFETY: the data register takes any byte.
                    self.slcan.dr().write(|w| unsafe { w.bits((*byte).into()) });
                } else {
                    self.unsent = self.unsent.saturating_add(1);
                }
            }
        }
    }

    /// A byte has come. With the queue full it stays in the register and the interrupt is masked
    /// until there is room: the line is held up, or the peripheral reports an overrun, and the
    /// next frame's checksum and time stamp show the loss. (Masked in the NVIC: the emulated
    /// USART keeps its line raised whatever its own enable bit says.)
    #[interrupt]
    fn USART1() {
        free(|cs| {
            let usart = USART1.borrow(cs).borrow();
            let mut received = RECEIVED.borrow(cs).borrow_mut();
            if let Some(usart) = usart.as_ref() {
                if received.is_full() {
                    NVIC::mask(Interrupt::USART1);
                } else {
                    // Status before data: an overrun would else keep the interrupt raised.
                    let _ = usart.sr().read();
                    let byte = usart.dr().read().dr().bits() as u8;
                    let _ = received.push_back(byte);
                }
            }
        });
    }
}

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::Board;
    use gyronet::can::config::Config;
    use gyronet::can::feeds::Feeds;
    use gyronet::can::{DataFrame, slcan};
    use gyronet::model::{Blob, GyroNet, WindowNetwork, weights};
    use gyronet::pipeline::{Pipeline, PipelineConfig};
    use gyronet::sensor::xsens::Mti;
    use panic_halt as _;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let mut board = loop {
            // The peripherals are there after a reset; a second entry cannot happen.
            if let Some(board) = Board::new() {
                break board;
            }
        };
        // Without good weights the pipeline still runs: every window is late, the status says
        // degraded, and the rate is the gyro's less its static bias.
        let mut network = Blob::new_checked(&weights::DEFAULT.0).ok().map(GyroNet::new);
        let mut mti = Mti::new();
        let mut pipeline = Pipeline::new(PipelineConfig::DEFAULT);
        let mut feeds = Feeds::new(Config::SLCAN_115200);
        loop {
            let Some(byte) = board.receive() else {
                cortex_m::asm::nop();
                continue;
            };
            mti.push(byte);
            while let Some(sample) = mti.next_sample() {
                if let Ok(Ok(output)) = sample.map(|sample| pipeline.process(sample)) {
                    for frame in feeds.process::<DataFrame>(&output.vehicle) {
                        if let Some(line) = slcan::emit(&frame) {
                            board.send(&line);
                        }
                    }
                    if let (Some(due), Some(network)) = (output.window, network.as_mut()) {
                        pipeline.deliver(due.end, network.estimate(&due.features));
                    }
                }
            }
        }
    }
}

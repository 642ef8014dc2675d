//! What the clocks run at, and the board's own time from SysTick (PM0214 4.5).

use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::{SYST, syst::SystClkSource};
use gyronet::units::Micros;

/// SysTick is fed by an eighth of the processor's clock.
const SYSTICK_DIVIDER: u32 = 8;

/// Polls before a step of the clock tree is given up: above 10 ms on a reset clock of 16 MHz, 2 ms on
/// one of 64, and a crystal wants 2 ms.
const POLLS: u32 = 40_000;

/// What the clocks run at. How they are started, the part's folder knows.
#[derive(Clone, Copy)]
pub struct Clocks {
    /// Of the processor.
    pub core_hz: u32,
    /// Of USART2, USART3 and CAN.
    pub apb1_hz: u32,
    /// Of USART1, USART6 and SPI1.
    pub apb2_hz: u32,
}

impl Clocks {
    /// Whether the crystal drives them.
    pub fn exact(self) -> bool {
        self.core_hz == Self::FULL.core_hz
    }
}

/// Waits for a step of the clock tree; `None` when it does not come.
pub fn within(ready: impl Fn() -> bool) -> Option<()> {
    (0..POLLS).any(|_| ready()).then_some(())
}

static MILLISECONDS: AtomicU32 = AtomicU32::new(0);

/// Called by SysTick.
pub fn tick() {
    // The only writer.
    MILLISECONDS.store(MILLISECONDS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}

/// The board's own time. For tasks that SysTick interrupts.
pub struct BoardTime {
    ticks_per_ms: u32,
    emulated: bool,
    last: u32,
    wraps: u64,
}

impl BoardTime {
    /// Starts SysTick. `emulated`: no part has said what it is, and its clock is what SysTick's
    /// own calibration says (the emulated one runs at 168 MHz whatever RCC says).
    pub fn start(mut systick: SYST, clocks: Clocks, emulated: bool) -> Self {
        let calibrated = (SYST::get_ticks_per_10ms() + 1) / 10;
        let ticks_per_ms = match emulated && calibrated > 1 {
            true => calibrated,
            false => clocks.core_hz / SYSTICK_DIVIDER / 1_000,
        };
        systick.set_clock_source(SystClkSource::External);
        systick.set_reload(ticks_per_ms - 1);
        systick.clear_current();
        systick.enable_interrupt();
        systick.enable_counter();
        Self { ticks_per_ms, emulated, last: 0, wraps: 0 }
    }

    /// No part has said what it is: nothing outside keeps this time.
    pub fn emulated(&self) -> bool {
        self.emulated
    }

    /// Since the start.
    pub fn now(&mut self) -> Micros {
        let (mut milliseconds, mut left) = Self::read();
        // Again when the millisecond ended in between; it does not do so twice.
        if milliseconds != MILLISECONDS.load(Ordering::Relaxed) {
            (milliseconds, left) = Self::read();
        }
        if milliseconds < self.last {
            self.wraps += 1 << 32;
        }
        self.last = milliseconds;
        let part = (self.ticks_per_ms.saturating_sub(left)).saturating_mul(1_000) / self.ticks_per_ms.max(1);
        Micros((self.wraps + u64::from(milliseconds)) * 1_000 + u64::from(part.min(999)))
    }

    fn read() -> (u32, u32) {
        (MILLISECONDS.load(Ordering::Relaxed), SYST::get_current())
    }
}

/// Milliseconds since the start; they wrap.
pub fn milliseconds() -> u32 {
    MILLISECONDS.load(Ordering::Relaxed)
}

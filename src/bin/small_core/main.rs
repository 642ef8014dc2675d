//! Runs window models on an emulated core without the DSP extension: a Cortex-M0 with 16 KiB of RAM (`microbit`), or
//! a Cortex-M3 with 64 KiB (`lm3s6965evb`).
//!
//! For each model the image prints `NAME bytes=N ticks=N wrapped=BOOL` for one window (SysTick), and a line of
//! hexadecimal words for each of [`WINDOWS`] estimates, which a host can compute too.
#![no_std]
#![no_main]

#[path = "../support/numbers.rs"]
mod numbers;
#[path = "../support/random_model.rs"]
mod random_model;

use crate::numbers::Numbers;
use core::hint::black_box;
use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_semihosting::{debug, hprint, hprintln};
use gyronet::model::blob::Shape;
use gyronet::model::gyronet::GyroNetState;
use gyronet::model::{Blob, BlobError, GyroNet, WindowNetwork};
use gyronet::nn::Aligned;
use gyronet::nn::lstm::DirectionWeights;
use panic_semihosting as _;

/// Largest number of units that fits the RAM of the board.
#[cfg(not(feature = "lm3s6965evb"))]
const UNITS: usize = 16;
#[cfg(feature = "lm3s6965evb")]
const UNITS: usize = 60;

type State = GyroNetState<UNITS, { UNITS / 2 }, { DirectionWeights::recurrent_words(UNITS) }>;

const WINDOWS: u32 = 8;

/// Returns the name and the file of a random model with a linear part; the file is a static.
macro_rules! model {
    ($units:literal) => {{
        const SHAPE: Shape = Shape { units: $units, linear: true };
        static FILE: Aligned<[u8; SHAPE.file_len(0)]> = Aligned(random_model::file(SHAPE, 19));
        (concat!("units_", $units), &FILE.0)
    }};
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let passed = match cortex_m::Peripherals::take().zip(cortex_m::singleton!(: State = State::ZERO)) {
        Some((peripherals, state)) => run(peripherals.SYST, state),
        None => Ok(()),
    };
    if let Err(error) = passed {
        hprintln!("FAILED: {}", error);
    }
    debug::exit(if passed.is_ok() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

fn run(mut syst: SYST, state: &mut State) -> Result<(), BlobError> {
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(0x00FF_FFFF);
    syst.clear_current();
    syst.enable_counter();
    hprintln!("state bytes={}", size_of::<State>());
    compare(model!(0), &mut syst, state)?;
    compare(model!(8), &mut syst, state)?;
    compare(model!(16), &mut syst, state)?;
    #[cfg(feature = "lm3s6965evb")]
    compare(model!(60), &mut syst, state)?;
    Ok(())
}

fn compare((name, file): (&str, &[u8]), syst: &mut SYST, state: &mut State) -> Result<(), BlobError> {
    let mut network = GyroNet::with_state(Blob::new_checked(file)?, state)?;
    let mut numbers = Numbers::new(7);
    for n in 0..WINDOWS {
        let window = random_model::window(&mut numbers, n);
        let before = SYST::get_current();
        let estimate = black_box(network.estimate(black_box(&window)));
        let ticks = before.wrapping_sub(SYST::get_current()) & 0x00FF_FFFF;
        if n == 0 {
            hprintln!("{} bytes={} ticks={} wrapped={}", name, file.len(), ticks, syst.has_wrapped());
        }
        hprint!("{} {}", name, n);
        for rate in estimate.corrections {
            hprint!(" {:08x}", rate.0);
        }
        hprintln!(" {}", estimate.clamped_inputs);
    }
    Ok(())
}

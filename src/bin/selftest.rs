//! Self-test on the target's own instruction set: compares the kernels with the portable code bit for bit, and prints
//! hashes of both networks' outputs that a host can recompute.
//!
//! Runs in QEMU or on a board with semihosting; the exit status says whether the test passed.
#![no_std]
#![no_main]

mod support;

use crate::support::{Numbers, hashes};
use core::cell::RefCell;
use cortex_m::interrupt::Mutex;
use cortex_m_semihosting::{debug, hprintln};
use gyronet::model::fognet::FogNetState;
use gyronet::model::gyronet::LargestState;
use gyronet::model::seconds::Minute;
use gyronet::model::{Blob, FogBlob, FogNet, GyroNet, weights};
use gyronet::nn::lstm::{self, DirectionWeights, Scratch};
use panic_semihosting as _;
#[expect(unused_imports, reason = "brings the interrupt vectors to the linker")]
use stm32f4::stm32f405 as _;

random_records!(SMALL, 4, 2, 127, 1);
random_records!(GYRONET_1, 60, 6, 127, 2);
random_records!(GYRONET_2, 60, 120, 40, 3);
random_records!(FOGNET_1, 90, 10, 80, 4);
random_records!(FOGNET_2, 90, 180, 27, 5);
random_records!(EXTREME, 60, 2, 127, 6);

const ROUNDS: u32 = 40;

static FOG: Mutex<RefCell<(FogNetState, Minute)>> =
    Mutex::new(RefCell::new((FogNetState::ZERO, Minute::EMPTY)));

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut failed = 0;
    failed += compare::<4, 2>("4 units, 2 inputs", &SMALL.direction(4, 2), 16_384);
    failed += compare::<60, 30>("60 units, 6 inputs", &GYRONET_1.direction(60, 6), 2_048);
    failed += compare::<60, 30>("60 units, 120 inputs", &GYRONET_2.direction(60, 120), 1_024);
    failed += compare::<90, 46>("90 units, 10 inputs", &FOGNET_1.direction(90, 10), 1_024);
    failed += compare::<90, 46>("90 units, 180 inputs", &FOGNET_2.direction(90, 180), 1_024);
    failed += compare::<60, 30>("60 units, 2 inputs, far out", &EXTREME.direction(60, 2), 32_767);
    let fognet = cortex_m::interrupt::free(|cs| {
        let (state, minute) = &mut *FOG.borrow(cs).borrow_mut();
        let blob = FogBlob::new_checked(&weights::FOGNET.0).ok()?;
        hashes::fognet(&mut FogNet::new(blob, state), minute)
    });
    for (network, hash) in [("gyronet", gyronet_hash()), ("fognet", fognet)] {
        match hash {
            Some(hash) => hprintln!("{} hash={:08x}", network, hash),
            None => {
                hprintln!("FAILED: the weight file of {} is refused", network);
                failed += 1;
            }
        }
    }
    hprintln!("{}", if failed == 0 { "selftest passed" } else { "selftest FAILED" });
    debug::exit(if failed == 0 { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

/// Counts differences of kernel and portable code, for inputs up to +-`limit` and at the ends of the range.
fn compare<const U: usize, const W: usize>(name: &str, direction: &DirectionWeights<'_>, limit: i32) -> u32 {
    let mut numbers = Numbers::new(U as u32 + direction.inputs() as u32);
    let mut differences = 0u32;
    let mut fast = Scratch::<U, W, 2>::ZERO;
    let mut plain = Scratch::<U, W, 2>::ZERO;
    for round in 0..ROUNDS {
        // With one pair of steps the kernel reads the weights in place; with two it copies them.
        let pairs = 1 + round as usize % 2;
        let mut x = [0; 2 * 180];
        let x = &mut x[..pairs * direction.inputs()];
        for word in x.iter_mut() {
            let mut value = || match round / 2 % 4 {
                0 => numbers.within(limit),
                1 => [limit, -limit][numbers.next() as usize % 2],
                2 => [i32::from(i16::MAX), i32::from(i16::MIN)][numbers.next() as usize % 2],
                _ => 0,
            };
            *word = gyronet::nn::pack(value() as i16, value() as i16);
        }
        lstm::project(direction, x, &mut fast.projection[..pairs]);
        lstm::project_portable(direction, x, &mut plain.projection[..pairs]);
        differences += u32::from(fast.projection != plain.projection);
        for step in 0..2 {
            let first = round == 0 && step == 0;
            let (from, to) = (1 - step, step);
            let previous = fast.hidden[from];
            let previous = (!first).then_some(&previous);
            lstm::step(
                direction,
                &fast.projection[pairs - 1][step],
                previous,
                &mut fast.cell_state,
                &mut fast.hidden[to],
            );
            lstm::step_portable(
                direction,
                &fast.projection[pairs - 1][step],
                previous,
                &mut plain.cell_state,
                &mut plain.hidden[to],
            );
            differences += u32::from(fast.hidden[to] != plain.hidden[to]);
            differences += u32::from(fast.cell_state != plain.cell_state);
            plain.cell_state = fast.cell_state;
            plain.hidden = fast.hidden;
        }
    }
    hprintln!("{}: {} rounds, {} differences", name, ROUNDS, differences);
    differences
}

fn gyronet_hash() -> Option<u32> {
    // Too large for the stack.
    let state = cortex_m::singleton!(: LargestState = LargestState::ZERO)?;
    let mut network = GyroNet::with_state(Blob::new_checked(&weights::GYRONET.0).ok()?, state).ok()?;
    Some(hashes::gyronet(&mut network))
}

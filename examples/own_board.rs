//! A whole board: an MTi on a serial port, wheel speeds and the corrected rate on CAN. Replace the port and the controller
//! of `parked_car.rs` with those of your HAL, and the clock with your timer.
//!
//! `cargo run -p gyronet-images --example own_board --features stm32f405 --target thumbv7em-none-eabihf` runs it in QEMU: four
//! seconds of a parked car; the exit status reports whether every frame was sent.
#![no_std]
#![no_main]

mod parked_car;

use crate::parked_car::{Controller, PERIOD_US, Port, exit_at_the_end};
use gyronet::can::wheel::{WheelReceiver, WheelSettings};
use gyronet::coprocessor::QueuedCan;
use gyronet::sensor::{serial::Serial, xsens::Mti};
use gyronet::{Config, Coprocessor, GyroNet, Micros};
use panic_semihosting as _;
#[expect(unused_imports, reason = "links the interrupt vectors")]
use stm32f4::stm32f405 as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    let wheels = Some(WheelReceiver::new(WheelSettings::TOYOTA).expect("checked settings"));
    let mut coprocessor = Coprocessor::new(Config { wheels, ..Config::DEFAULT });
    let mut network = GyroNet::shipped().expect("it comes with the library");
    let mut imu = Serial::new(Port::default(), Mti::new());
    let mut can = QueuedCan::<_>::new(Controller::default());
    let mut now = Micros(0);
    loop {
        // Received frames, samples, windows, silence, frames to send. Errors are counted and reported on the bus.
        coprocessor.step(now, &mut imu, &mut can, Some(&mut network));
        exit_at_the_end(now, can.controller(), coprocessor.input_counters());
        // A board reads its timer here, and steps about every millisecond.
        now.0 += PERIOD_US;
    }
}

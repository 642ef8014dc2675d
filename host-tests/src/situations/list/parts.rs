//! Situations of the sensor, its line, its clock and the wheels.

use super::super::damage::Damage;
use super::super::scene::Scene;
use super::super::sensor::Fault;
use super::super::vehicle::{CAR, HATCH, TRUCK, UTV, VAN};
use super::super::wheels::WheelFault;
use super::{ALL, Situation, WHEELED};

pub static SITUATIONS: &[Situation] = &[
    Situation::new("sensor of 50 Hz", &[CAR, TRUCK], |scene| of_rate(scene, 50.0)),
    Situation::new("sensor of 83 Hz", &[CAR, TRUCK], |scene| of_rate(scene, 83.3)),
    Situation::new("sensor of 104 Hz", &[CAR, TRUCK], |scene| of_rate(scene, 104.0)),
    Situation::new("sensor of 120 Hz", &[CAR, TRUCK], |scene| of_rate(scene, 120.0)),
    Situation::new("sensor of 200 Hz", &[CAR, TRUCK], |scene| of_rate(scene, 200.0)),
    Situation::new("sensor of 400 Hz", &[CAR, TRUCK], |scene| of_rate(scene, 400.0)),
    Situation::new("sensor that samples at uneven times", &[CAR, UTV], |scene| {
        scene.sensor.jitter = 1e-3;
        of_rate(scene, 100.0);
    }),
    Situation::new("sensor whose clock is 1.5 % fast", &[CAR, HATCH], |scene| {
        scene.sensor.clock = 0.015;
        of_rate(scene, 100.0);
    }),
    Situation::new("sensor whose clock jumps", &[CAR, HATCH], |scene| {
        scene.start(1);
        scene.ride.reach(10.0, 5.0).turn(40.0, 4.0);
        scene.sensor_fault(1e3, Fault::ClockJump(0.35));
        scene.ride.turn(40.0, 4.0).stop(5.0, 5.0);
        scene.town(1);
    }),
    Situation::new("every clock and counter wraps", &[CAR, HATCH, TRUCK], |scene| {
        // 32 bits of the part's 100 us and of the board's microseconds.
        scene.sensor.epoch = 429_496.729_6 - 60.0;
        scene.epoch = 4_294.967_296 - 60.0;
        of_rate(scene, 100.0);
    }),
    Situation::new("fibre-optic gyro", &[VAN], |scene| of_rate(scene, 100.0)),
    Situation::new("fibre-optic gyro whose clock is 4 % fast", &[VAN], |scene| {
        scene.measures().clock = 0.04;
        of_rate(scene, 100.0);
    }),
    Situation::new("fibre-optic gyro set to degrees", &[VAN], |scene| {
        scene.sensor_fault(1e3, Fault::Gain(2, 180.0 / std::f64::consts::PI));
        of_rate(scene, 100.0);
        scene.least = 0.4;
    }),
    Situation::new("fibre-optic gyro stuck", &[VAN], |scene| in_a_turn(scene, 5.0, Fault::Stuck(&[0, 1, 2]))),
    Situation::new("fibre-optic gyro silent", &[VAN], |scene| in_a_turn(scene, 1.5, Fault::Silent)),
    Situation::new("fibre-optic gyro marks its axis", &[VAN], |scene| {
        in_a_turn(scene, 1.0, Fault::NoNumber(2))
    }),
    Situation::new("bits flip on the fibre-optic gyro's line", &[VAN], |scene| {
        on_the_line(scene, Damage::BitFlip(0.01));
    }),
    Situation::new("fibre-optic gyro's line stalls", &[VAN], stall),
    Situation::new("ferry that turns a fibre-optic gyro", &[VAN], |scene| {
        scene.ride.now.carried = 0.01;
        scene.ride.hold(20.0);
        scene.ride.now.carried = 0.0;
        scene.ride.hold(10.0);
        scene.town(2);
        // Until it drives off.
        scene.least = 0.6;
    }),
    Situation::new("gain of 1.008", ALL, |scene| {
        scene.measures().gain[2] = 1.008;
        of_rate(scene, 100.0);
    }),
    Situation::new("mounted 5 deg askew", ALL, |scene| {
        scene.measures().tilt = [0.087, -0.06, 0.0];
        of_rate(scene, 100.0);
    }),
    Situation::new("gyro stuck in a turn", ALL, |scene| in_a_turn(scene, 5.0, Fault::Stuck(&[0, 1, 2]))),
    Situation::new("one gyro axis stuck in a turn", ALL, |scene| in_a_turn(scene, 5.0, Fault::Stuck(&[2]))),
    Situation::new("sensor silent in a turn", ALL, |scene| in_a_turn(scene, 1.5, Fault::Silent)),
    Situation::new("no number for an axis in a turn", ALL, |scene| in_a_turn(scene, 1.0, Fault::NoNumber(2))),
    Situation::new("one implausible reading", ALL, |scene| in_a_turn(scene, 0.011, Fault::Shift(2, 7.0))),
    Situation::new("one small implausible reading", ALL, |scene| {
        in_a_turn(scene, 0.011, Fault::Shift(2, 0.8))
    }),
    Situation::new("implausible readings for a second", ALL, |scene| {
        in_a_turn(scene, 1.0, Fault::Shift(2, -3.0))
    }),
    Situation::new("gyro beyond its range", ALL, |scene| in_a_turn(scene, 0.5, Fault::Gain(2, 60.0))),
    Situation::new("bias steps after a knock", ALL, |scene| {
        scene.start(2);
        scene.ride.hold(1.0);
        scene.sensor_fault(1e3, Fault::Shift(2, 0.01));
        scene.ride.hold(4.0);
        scene.town(2);
    }),
    Situation::new("sensor moved between two drives", ALL, |scene| {
        after_a_restart(scene, Fault::Moved([0.1, -0.35, 0.0]));
    }),
    Situation::new("sensor swapped", ALL, |scene| {
        after_a_restart(scene, Fault::Shift(2, 0.02));
        // No fibre-optic gyro has such a bias.
        scene.least = if scene.fibre_optic.is_some() { 0.5 } else { 0.7 };
    }),
    Situation::new("messages every 50 ms", ALL, |scene| {
        scene.period_ms = 50;
        in_a_turn(scene, 0.13, Fault::Silent);
    }),
    Situation::new("messages every 100 ms", ALL, |scene| {
        scene.period_ms = 100;
        in_a_turn(scene, 0.09, Fault::NoNumber(2));
    }),
    Situation::new("bits flip on the line", &[CAR, TRUCK, UTV, HATCH], |scene| {
        on_the_line(scene, Damage::BitFlip(0.05))
    }),
    Situation::new("noise on the line", ALL, |scene| on_the_line(scene, Damage::Burst(0.05, 40))),
    Situation::new("messages are lost", ALL, |scene| on_the_line(scene, Damage::Drop(0.05))),
    Situation::new("messages come twice", ALL, |scene| on_the_line(scene, Damage::Twice(0.1))),
    Situation::new("messages are cut off", ALL, |scene| on_the_line(scene, Damage::Truncation(0.05))),
    Situation::new("messages overtake each other", &[CAR, UTV], |scene| {
        on_the_line(scene, Damage::Late(0.02))
    }),
    Situation::new("line stalls in a turn", &[CAR, UTV], stall),
    Situation::new("two faults, drawn", ALL, |scene| {
        scene.start(1);
        scene.ride.reach(9.0, 5.0);
        drawn(scene);
        scene.ride.turn(70.0, 6.0);
        drawn(scene);
        scene.ride.turn(-50.0, 6.0).stop(5.0, 6.0);
        scene.town(1);
        scene.least = 0.3;
    }),
    Situation::new("wheel marked as faulty", WHEELED, |scene| wheels(scene, WheelFault::Marked(1))),
    Situation::new("one wheel dead", WHEELED, |scene| wheels(scene, WheelFault::One(2, 0.0))),
    Situation::new("one tyre flat", WHEELED, |scene| wheels(scene, WheelFault::One(3, 1.04))),
    Situation::new("wheels of another size", WHEELED, |scene| wheels(scene, WheelFault::All(1.06))),
    Situation::new("wheel frames end", WHEELED, |scene| {
        wheels(scene, WheelFault::Silent);
        // A fibre-optic gyro without wheels is degraded.
        scene.least = 0.6;
    }),
    Situation::new("wheel frames frozen in motion", WHEELED, |scene| {
        scene.ride.hold(8.0);
        scene.ride.reach(10.0, 5.0).hold(2.0);
        scene.wheel_fault(1e3, WheelFault::Frozen);
        scene.ride.turn(90.0, 6.0).stop(5.0, 10.0);
        scene.town(2);
    }),
    Situation::new("wheel frames frozen at zero on a motorway", WHEELED, |scene| {
        scene.start(1);
        scene.wheel_fault(1e3, WheelFault::All(0.0));
        scene.ride.now.road = 0.1;
        scene.ride.reach(30.0, 20.0).hold(10.0).turn(5.0, 40.0).turn(-4.0, 30.0).hold(10.0);
        scene.least = 0.1;
    }),
];

fn of_rate(scene: &mut Scene, hz: f64) {
    scene.sensor.hz = hz;
    scene.start(3);
}

fn in_a_turn(scene: &mut Scene, seconds: f64, what: Fault) {
    scene.start(1);
    scene.ride.reach(10.0, 6.0).turn(30.0, 3.0);
    scene.sensor_fault(seconds, what);
    scene.ride.turn(60.0, 5.0).hold(5.0).stop(5.0, 3.0);
    scene.town(1);
}

fn after_a_restart(scene: &mut Scene, what: Fault) {
    scene.start(2);
    scene.ride.hold(5.0);
    scene.restart();
    scene.sensor_fault(1e3, what);
    scene.start(2);
}

fn on_the_line(scene: &mut Scene, what: Damage) {
    scene.start(1);
    scene.line_fault(25.0, what);
    scene.town(2);
    scene.least = 0.2;
}

fn wheels(scene: &mut Scene, what: WheelFault) {
    scene.start(1);
    scene.wheel_fault(1e3, what);
    scene.town(2);
}

fn stall(scene: &mut Scene) {
    scene.start(1);
    scene.ride.reach(10.0, 5.0).turn(30.0, 3.0);
    scene.line_fault(0.7, Damage::Stall);
    scene.ride.turn(60.0, 5.0).stop(5.0, 5.0);
    scene.town(1);
}

/// A fault of any kind, from now on for up to five seconds.
fn drawn(scene: &mut Scene) {
    let seconds = scene.random.log_between(0.01, 5.0);
    let axis = scene.random.below(6);
    let share = scene.random.log_between(0.02, 1.0);
    let size = scene.random.sign() * scene.random.log_between(0.02, 30.0);
    match scene.random.below(16) {
        0 => scene.sensor_fault(seconds, Fault::Stuck(&[0, 1, 2])),
        1 => scene.sensor_fault(seconds, Fault::Stuck(&[3, 4, 5])),
        2 => scene.sensor_fault(seconds, Fault::Stuck(&[2])),
        3 => scene.sensor_fault(0.01, Fault::Shift(axis, size)),
        4 => scene.sensor_fault(seconds, Fault::NoNumber(axis)),
        5 => scene.sensor_fault(seconds, Fault::Silent),
        6 => scene.sensor_fault(1e3, Fault::ClockJump(size)),
        7 => scene.line_fault(seconds, Damage::Drop(share)),
        8 => scene.line_fault(seconds, Damage::Twice(share)),
        9 => scene.line_fault(seconds, Damage::BitFlip(share)),
        10 => scene.line_fault(seconds, Damage::Burst(share, 64)),
        11 => scene.line_fault(seconds, Damage::Truncation(share)),
        12 => scene.line_fault(seconds, Damage::Late(share)),
        13 => scene.line_fault(seconds, Damage::Stall),
        14 => scene.wheel_fault(seconds, WheelFault::All(share)),
        _ => scene.wheel_fault(seconds, WheelFault::Silent),
    }
}

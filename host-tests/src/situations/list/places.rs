//! Where a vehicle is: carried, lifted, on slopes and decks.

use super::super::scene::Scene;
use super::super::sensor::Fault;
use super::super::vehicle::{CAR, HATCH, TRUCK};
use super::{ALL, Situation, WHEELED};

pub static SITUATIONS: &[Situation] = &[
    Situation::new("ferry that turns while the board starts", WHEELED, |scene| {
        deck(scene, 1.0, 0.01, 30.0);
        scene.ride.hold(15.0);
        scene.town(4);
    }),
    Situation::new("ferry that turns on the way", WHEELED, |scene| {
        scene.start(1);
        deck(scene, 0.3, 0.01, 40.0);
        scene.town(2);
    }),
    Situation::new("turntable of 0.2 deg/s", WHEELED, |scene| {
        scene.start(1);
        deck(scene, 0.2, 0.0, 40.0);
        scene.town(2);
    }),
    Situation::new("turntable of a showroom while the board starts", ALL, |scene| {
        deck(scene, 5.0, 0.0, 20.0);
        scene.ride.hold(10.0);
        scene.town(3);
    }),
    Situation::new("ship that swings at anchor", WHEELED, |scene| {
        for rate in [0.1, -0.1, 0.1] {
            deck(scene, rate, 0.005, 15.0);
        }
        scene.start(2);
        // Half of the time it has not driven off yet.
        scene.least = 0.48;
    }),
    Situation::new("car carrier in a town", WHEELED, |scene| {
        scene.ride.hold(8.0);
        scene.ride.now.rolling = 0.0;
        scene.town(3);
        scene.ride.now.rolling = 1.0;
        scene.start(1);
    }),
    Situation::new("shuttle train", WHEELED, |scene| {
        scene.start(1);
        (scene.ride.now.rolling, scene.ride.now.road) = (0.0, 0.05);
        scene.ride.reach(35.0, 30.0).turn(12.0, 40.0).turn(-8.0, 25.0).stop(30.0, 5.0);
        (scene.ride.now.rolling, scene.ride.now.road) = (1.0, 1.0);
        scene.town(1);
    }),
    Situation::new("lift for cars", WHEELED, |scene| {
        scene.ride.hold(8.0);
        for force in [0.8, -0.8, -0.8, 0.8] {
            scene.sensor_fault(1.5, Fault::Shift(5, force));
            scene.ride.hold(6.0);
        }
        scene.town(2);
    }),
    Situation::new("loading ramp", ALL, |scene| {
        scene.ride.hold(8.0).reach(1.0, 2.0);
        scene.ride.now.slope = 0.25;
        scene.ride.hold(2.0).hold(6.0).stop(2.0, 8.0).reach(-1.0, 2.0).hold(6.0);
        scene.ride.now.slope = 0.0;
        scene.ride.hold(2.0).stop(2.0, 5.0);
        scene.town(1);
    }),
    Situation::new("start on a steep slope", ALL, |scene| {
        scene.ride.now.slope = 0.2;
        scene.ride.hold(8.0).reach(8.0, 5.0).turn(120.0, 10.0).turn(-120.0, 10.0).stop(5.0, 5.0);
        scene.ride.now.slope = 0.0;
        scene.town(2);
    }),
    Situation::new("serpentines of 15 %", ALL, |scene| {
        scene.ride.hold(8.0).reach(8.0, 5.0);
        scene.ride.now.slope = 0.15;
        scene.ride.hold(3.0);
        for turn in [170.0, -170.0, 170.0] {
            scene.ride.turn(turn, 9.0).hold(8.0);
        }
        scene.ride.stop(5.0, 6.0);
    }),
    Situation::new("parking garage spiral", ALL, |scene| {
        scene.ride.hold(8.0).reach(4.0, 3.0);
        scene.ride.now.slope = 0.12;
        scene.ride.hold(2.0).turn(1080.0, 54.0);
        scene.ride.now.slope = 0.0;
        scene.ride.hold(2.0).stop(2.0, 6.0);
        scene.town(1);
    }),
    Situation::new("banked test track", ALL, |scene| {
        scene.ride.hold(8.0).reach(25.0, 12.0).hold(5.0);
        scene.ride.now.bank = -0.4;
        scene.ride.turn(180.0, 20.0);
        scene.ride.now.bank = 0.0;
        scene.ride.hold(10.0).stop(12.0, 5.0);
    }),
    Situation::new("car wash with a conveyor", &[CAR, HATCH, TRUCK], |scene| {
        scene.start(1);
        (scene.ride.now.engine, scene.ride.now.swell) = (0.0, 0.004);
        scene.ride.reach(0.2, 2.0).hold(25.0).turn(4.0, 5.0).stop(2.0, 3.0);
        (scene.ride.now.engine, scene.ride.now.swell) = (1.0, 0.0);
        scene.town(1);
    }),
    Situation::new("people board, the wind rocks", ALL, |scene| {
        scene.ride.now.swell = 0.006;
        scene.ride.hold(20.0);
        scene.town(1);
        scene.ride.now.swell = 0.02;
        scene.ride.hold(25.0);
        scene.ride.now.swell = 0.0;
        scene.town(1);
    }),
];

/// A deck turns by this many deg/s and rolls by this angle.
fn deck(scene: &mut Scene, rate: f64, swell: f64, seconds: f64) {
    (scene.ride.now.carried, scene.ride.now.swell) = (f64::to_radians(rate), swell);
    scene.ride.hold(seconds);
    (scene.ride.now.carried, scene.ride.now.swell) = (0.0, 0.0);
    scene.ride.hold(5.0);
}

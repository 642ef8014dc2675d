//! How a vehicle is driven, and on what.

use super::super::vehicle::{BARE, CAR, HATCH, TRUCK, UTV};
use super::super::wheels::WheelFault;
use super::{ALL, Situation, WHEELED, WITHOUT};

pub static SITUATIONS: &[Situation] = &[
    Situation::new("town", ALL, |scene| {
        scene.start(4);
    }),
    Situation::new("creeping below the wheels' threshold", &[HATCH, TRUCK], |scene| {
        scene.start(1);
        for _ in 0..3 {
            scene.ride.reach(0.25, 2.0).turn(20.0, 20.0).turn(-8.0, 10.0).stop(1.0, 2.0);
        }
        scene.town(1);
    }),
    Situation::new("creeping from the start", &[HATCH, TRUCK, BARE], |scene| {
        scene.ride.now.speed = 0.25;
        scene.ride.turn(40.0, 30.0).stop(1.0, 10.0);
        scene.town(3);
        // Nothing confirms the bias before it drives off, after 42 s of some 140.
        scene.least = 0.65;
    }),
    Situation::new("smooth motorway", WITHOUT, |scene| {
        scene.ride.now.road = 0.04;
        scene.ride.hold(8.0).reach(30.0, 20.0);
        for _ in 0..3 {
            scene.ride.hold(10.0).turn(2.5, 25.0).hold(5.0).turn(-2.0, 20.0);
        }
        scene.ride.stop(15.0, 5.0);
    }),
    Situation::new("warm-up with slow bends", &[BARE, UTV, CAR, HATCH], |scene| {
        scene.sensor.warming = [5.0, 25.0, 60.0];
        scene.ride.now.road = 0.05;
        scene.ride.hold(8.0).reach(14.0, 8.0).turn(10.0, 120.0).turn(-30.0, 10.0).stop(8.0, 5.0);
    }),
    Situation::new("night of cooling", ALL, |scene| {
        scene.sensor.warming = [45.0, -40.0, 60.0];
        scene.start(1);
        scene.ride.now.engine = 0.0;
        scene.ride.hold(60.0);
        scene.restart();
        scene.ride.hold(1.0);
        scene.ride.now.engine = 1.0;
        scene.town(2);
        // A stop of a few seconds in town may show too little to confirm the bias of the second start.
        scene.least = 0.5;
    }),
    Situation::new("long idle", ALL, |scene| {
        scene.ride.hold(100.0);
        scene.town(1);
        // Nothing confirms the bias before it drives off.
        scene.least = 0.23;
    }),
    Situation::new("engine off at each stop", WHEELED, |scene| {
        scene.ride.hold(8.0);
        for _ in 0..3 {
            scene.ride.now.engine = 1.0;
            scene.town(1);
            scene.ride.now.engine = 0.0;
            scene.ride.hold(6.0);
        }
    }),
    Situation::new("idling truck", &[TRUCK, UTV], |scene| {
        scene.ride.now.engine = 1.5;
        scene.ride.hold(15.0);
        scene.town(2);
    }),
    Situation::new("vibrating utility vehicle", &[UTV], |scene| {
        scene.ride.now.engine = 2.0;
        scene.ride.hold(20.0);
        scene.town(2);
        // For a quarter of the time it has not driven off yet.
        scene.least = 0.65;
    }),
    Situation::new("restart in motion", ALL, |scene| {
        scene.start(2);
        scene.ride.reach(12.0, 6.0);
        scene.restart();
        scene.ride.hold(5.0).turn(80.0, 6.0).hold(8.0).stop(6.0, 8.0);
        scene.town(1);
        scene.least = 0.65;
    }),
    Situation::new("reversing", ALL, |scene| {
        scene.ride.hold(8.0).reach(-2.0, 2.0).turn(60.0, 8.0).hold(2.0).stop(2.0, 4.0);
        scene.ride.reach(3.0, 2.0).turn(-60.0, 6.0).stop(2.0, 4.0);
        scene.town(1);
    }),
    Situation::new("roundabout at the start", ALL, |scene| {
        scene.ride.now.speed = 7.0;
        scene.ride.turn(360.0, 18.0).hold(6.0).stop(4.0, 8.0);
        scene.town(2);
        // Until it drives off from its first stop.
        scene.least = 0.6;
    }),
    Situation::new("towed with the front axle lifted", WHEELED, |scene| {
        scene.ride.hold(8.0);
        scene.wheel_fault(60.0, WheelFault::One(0, 0.0));
        scene.wheel_fault(60.0, WheelFault::One(1, 0.0));
        scene.ride.now.engine = 0.0;
        scene.ride.now.slope = 0.15;
        scene.ride.hold(6.0).reach(10.0, 10.0).turn(90.0, 8.0).hold(10.0).stop(8.0, 18.0);
        scene.town(1);
    }),
    Situation::new("wheels locked on ice", WHEELED, |scene| {
        scene.start(1);
        scene.ride.reach(14.0, 8.0).hold(5.0);
        scene.wheel_fault(4.0, WheelFault::All(0.0));
        (scene.ride.now.road, scene.ride.now.speed, scene.ride.now.grip) = (0.2, 4.0, 0.0);
        scene.ride.turn(12.0, 4.0);
        (scene.ride.now.road, scene.ride.now.grip) = (1.0, 1.0);
        scene.ride.reach(10.0, 5.0).turn(-60.0, 5.0).stop(5.0, 5.0);
    }),
    Situation::new("slow slide with locked wheels", WHEELED, |scene| {
        scene.start(1);
        scene.wheel_fault(30.0, WheelFault::All(0.0));
        (scene.ride.now.road, scene.ride.now.speed) = (0.1, 1.5);
        scene.ride.turn(3.0, 15.0).turn(1.0, 13.0).stop(2.0, 3.0);
        scene.ride.now.road = 1.0;
        scene.town(1);
    }),
    Situation::new("spin on ice", ALL, |scene| {
        scene.start(1);
        scene.ride.reach(14.0, 8.0);
        (scene.ride.now.grip, scene.ride.now.speed) = (0.0, 3.0);
        scene.ride.turn(540.0, 4.0).stop(3.0, 6.0);
        scene.ride.now.grip = 1.0;
        scene.town(1);
    }),
    Situation::new("wheels spin at a standstill", WHEELED, |scene| {
        scene.start(1);
        scene.wheel_fault(8.0, WheelFault::Spin(6.0));
        scene.ride.hold(10.0);
        scene.town(1);
    }),
    Situation::new("tram tracks", ALL, |scene| {
        scene.ride.hold(8.0).reach(9.0, 5.0);
        for bank in [0.03, 0.0, -0.02, 0.0, 0.03, 0.0] {
            scene.ride.now.bank = bank;
            scene.ride.hold(0.3).hold(2.0);
        }
        scene.ride.turn(8.0, 3.0).turn(-8.0, 3.0).stop(5.0, 5.0);
        scene.town(1);
    }),
    Situation::new("speed bumps", ALL, |scene| {
        scene.ride.hold(8.0);
        for turn in [0.0, 20.0, -40.0] {
            scene.ride.reach(7.0, 4.0).turn(turn, 4.0);
            for slope in [0.09, -0.09, 0.0, 0.09, -0.09, 0.0] {
                scene.ride.now.slope = slope;
                scene.ride.hold(0.25);
            }
        }
        scene.ride.stop(3.0, 5.0);
        scene.town(1);
    }),
    Situation::new("washboard road", ALL, |scene| {
        scene.ride.hold(8.0);
        scene.ride.now.road = 3.0;
        scene.town(3);
        // No vehicle turns as the shake does, again and again.
        scene.least = 0.55;
    }),
];

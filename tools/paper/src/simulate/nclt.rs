//! Writes the layout of NCLT: no headers, microseconds since 1970, x forward, y right, z down; heading
//! clockwise from north.

use super::delay::Delay;
use super::text::Rows;
use super::{Drive, Spec};
use crate::simulate::vehicles::Delays;
use gyronet_tools::drive::DT;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::io;
use std::path::Path;

/// Start time of a sequence, in 2012.
const START_US: i64 = 1_330_000_000_000_000;
/// Message rates, Hz, as measured on 2013-01-10.
const IMU_HZ: f64 = 47.1;
const WHEELS_HZ: f64 = 41.2;
/// Longest blockage of the wheels, s: gaps of up to 201 ms were measured on that day.
const WHEELS_LONGEST: f64 = 0.175;
/// The Earth's magnetic field, east, north, up, Gauss, and the noise of the magnetometer.
const FIELD: ([f64; 3], f64) = ([0.0, 0.19, -0.5], 0.003);

/// Times the messages of a part that is slower than the 10 ms ticks and averages over them.
struct Slow {
    period: f64,
    next: f64,
    ticks: u32,
}

impl Slow {
    fn new(hz: f64) -> Self {
        Self { period: 1.0 / hz, next: 1.0 / hz, ticks: 0 }
    }

    /// Returns the number of ticks that the message now due averages over; `None` if no message is due.
    fn due(&mut self, now: f64) -> Option<f64> {
        self.ticks += 1;
        if now < self.next {
            return None;
        }
        self.next += self.period;
        Some(f64::from(std::mem::take(&mut self.ticks)))
    }
}

pub(super) fn write(spec: &Spec, mut drive: Drive, folder: &Path) -> io::Result<()> {
    let vehicle = spec.layout.vehicle();
    let mut imu_rows = Rows::create(&folder.join("ms25.csv"))?;
    let mut fog_rows = Rows::create(&folder.join("kvh.csv"))?;
    let mut wheel_rows = Rows::create(&folder.join("wheels.csv"))?;
    let mut pose_rows = Rows::create(&folder.join(format!("groundtruth_{}.csv", spec.name)))?;
    let delay = |delays, stream| Delay::new(delays, spec.run, stream);
    let mut imu_delay = delay(vehicle.delays, 1);
    let mut fog_delay = delay(vehicle.delays, 2);
    let mut wheel_delay = delay(Delays { longest: WHEELS_LONGEST, ..vehicle.delays }, 3);
    let (mut imu, mut wheels) = (Slow::new(IMU_HZ), Slow::new(WHEELS_HZ));
    let (mut force_sum, mut rate_sum, mut metres) = ([0.0; 3], [0.0; 3], [0.0; 2]);
    let mut fog_heading = 0.0;
    let stamp = |seconds: f64| START_US + (seconds * 1e6).round() as i64;
    for _ in 0..drive.ticks {
        let Some(truth) = drive.world.next() else { break };
        let motion = truth.motion;
        let now = truth.seconds + DT;
        let rate = gyronet_tools::simulate::add(truth.inertial_rate, truth.shake.angular_rate);
        let [.., turned] = drive.fog.increment(rate, DT);
        drive.fog.wander(DT);
        fog_heading = (fog_heading - turned).rem_euclid(TAU);
        fog_rows.int(stamp(fog_delay.arrival(now))).double(fog_heading).end()?;

        let (force, rate) = drive.imu(&truth);
        force_sum = gyronet_tools::simulate::add(force_sum, force);
        rate_sum = gyronet_tools::simulate::add(rate_sum, rate);
        if let Some(ticks) = imu.due(now) {
            let magnetic = down(drive.magnetic(&truth, FIELD.0, FIELD.1));
            imu_rows.int(stamp(imu_delay.arrival(now))).singles(magnetic);
            imu_rows.singles(down(force_sum.map(|sum| sum / ticks)));
            imu_rows.singles(down(rate_sum.map(|sum| sum / ticks))).end()?;
            (force_sum, rate_sum) = ([0.0; 3], [0.0; 3]);
        }

        drive.odometer.step(motion.speed, motion.acceleration, motion.heading_rate, DT);
        if let Some(ticks) = wheels.due(now) {
            let before = std::mem::replace(&mut metres, drive.odometer.metres());
            wheel_rows.int(stamp(wheel_delay.arrival(now)));
            wheel_rows.singles([0, 1].map(|wheel| (metres[wheel] - before[wheel]) / (ticks * DT))).end()?;
        }

        let [east, north, up] = truth.position;
        let heading = (FRAC_PI_2 - truth.yaw + PI).rem_euclid(TAU) - PI;
        pose_rows.int(stamp(now)).doubles([north, east, -up]);
        pose_rows.doubles([motion.roll, -motion.pitch, heading]).end()?;
    }
    [imu_rows, fog_rows, wheel_rows, pose_rows].into_iter().try_for_each(Rows::finish)
}

/// Converts x forward, y left, z up to x forward, y right, z down.
fn down([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, -y, -z]
}

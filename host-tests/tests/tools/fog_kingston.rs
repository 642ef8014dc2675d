//! The corrections of a fibre-optic gyro without a network on a real drive: an hour in Kingston with a ring-laser gyro in its place, the
//! car's own speed, and the heading of a survey-grade system as reference.

use gyronet::bias::Latitude;
use gyronet::coprocessor::{Config, Coprocessor};
use gyronet::fog::FogConfig;
use gyronet::sample::FogSample;
use gyronet::units::{Angle, Micros};
use gyronet_host_tests::kingston::{HG1700, at, table};
use gyronet_host_tests::recordings;
use gyronet_host_tests::sent::Sent;
use gyronet_paper::simulate::world::EARTH_RATE;
use gyronet_tools::drive::wheel_frames;

/// The last part of the drive, which nothing has been chosen on.
const TESTED: f64 = 0.4;
/// The error of the yaw at its end, at most, rad.
const FINAL: f64 = 0.003;
/// One row of the gyro is so many steps of the board.
const STEPS: usize = 10;

/// Yaw by the board after each row of the gyro, rad.
fn yaw(gyro: &[Vec<f64>], speed: &[Vec<f64>], latitude: f64) -> Vec<f64> {
    let latitude = Latitude::from_degrees(latitude as f32);
    let mut coprocessor = Coprocessor::new(Config {
        fog: FogConfig { errors: HG1700, latitude, ..FogConfig::DEFAULT },
        wheels: Some(wheel_frames::receiver()),
        ..Config::DEFAULT
    });
    let mut yaw = vec![0.0; gyro.len()];
    let (mut turned, mut sent) = (0.0, Sent::default());
    for (row, place) in gyro.iter().zip(&mut yaw) {
        for step in 0..STEPS {
            // The unit gives one reading in 100 ms; a gyro whose increments are equal would be stuck.
            let flicker = if step % 2 == 0 { 1e-10 } else { -1e-10 };
            let time = row[0] - 0.01 * (STEPS - 1 - step) as f64 + 1.0;
            let now = Micros((time * 1e6).round() as u64);
            let heard = speed.partition_point(|speed| speed[0] + 1.0 <= time);
            if step % 2 == 0
                && let Some(heard) = heard.checked_sub(1)
            {
                let frame = wheel_frames::frame([Some(3.6 * speed[heard][1]); 4]).expect("a speed");
                coprocessor.can(&frame, now).expect("a good wheel frame");
            }
            let turn = Angle(((0.01 * row[6] + flicker) * f64::from(Angle::PER_RAD)).round() as i64);
            let increment = [None, None, Some(turn)];
            let sample = FogSample { time: now, span: 10_000, lost: 0, increment, temperature: None };
            coprocessor.fog(sample, now, &mut sent).expect("in order");
        }
        turned += sent.fog.drain(..).map(|rate| 0.01 * rate.rate.rad_per_sec()).sum::<f64>();
        sent.frames.clear();
        *place = turned;
    }
    yaw
}

#[test]
fn the_heading_of_an_hour_in_kingston() {
    let Some(folder) = recordings::found("kingston2008") else { return };
    let [gyro, speed, mut reference] =
        ["imu_10hz.csv", "obd_speed_1hz.csv", "reference_1hz.csv"].map(|name| table(&folder.join(name)));
    // Azimuth grows clockwise, and jumps at north.
    let mut turns = 0.0;
    for row in 1..reference.len() {
        let step = reference[row][9] - reference[row - 1][9] + turns;
        turns -= 360.0 * (step / 360.0).round();
        reference[row][9] += turns;
    }
    let latitude = reference[0][1];
    let yaw = yaw(&gyro, &speed, latitude);
    let (first, last) = (gyro[0][0].max(reference[0][0]), gyro.last().expect("rows")[0]);
    let from = last - TESTED * (last - first);
    let yaw: Vec<Vec<f64>> = gyro.iter().zip(yaw).map(|(row, yaw)| vec![row[0], yaw]).collect();
    let own = |time: f64| at(&yaw, 1, time);
    let truth = |time: f64| -at(&reference, 9, time).to_radians();
    let end = last.min(reference.last().expect("rows")[0]);
    let error = (own(end) - own(from)) - (truth(end) - truth(from));
    let mut turned = 0.0;
    for rows in gyro.windows(2).filter(|rows| rows[0][0] >= from && rows[1][0] <= end) {
        turned += rows[1][6] * (rows[1][0] - rows[0][0]);
    }
    let by_earth =
        turned - EARTH_RATE * latitude.to_radians().sin() * (end - from) - (truth(end) - truth(from));
    let seconds = end - from;
    println!("last {seconds:.0} s: {error:+.5} rad at the end, {by_earth:+.5} by the Earth's rate alone");
    assert!(error.abs() <= FINAL && error.abs() < by_earth.abs(), "{error} rad");
}

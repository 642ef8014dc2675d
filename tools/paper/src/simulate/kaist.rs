//! Writes the layout of KAIST Complex Urban: no headers, nanoseconds since 1970.

use super::delay::Delay;
use super::odometer::{BASE, DIAMETER};
use super::{Drive, Spec};
use gyronet_tools::drive::DT;
use std::fs::{self, File};
use std::io;
use std::path::Path;

/// Start time of a sequence, in 2018.
const START_NS: i64 = 1_524_000_000_000_000_000;
/// Encoder counts per revolution.
const RESOLUTION: f64 = 4096.0;
/// Number of increments that the fibre-optic gyro sends in 10 ms.
const INCREMENTS: u32 = 10;
/// Start position of a sequence in UTM, m.
const ORIGIN: [f64; 3] = [355_000.0, 4_025_000.0, 60.0];
/// The Earth's magnetic field, east, north, up, normalised, and the noise of the magnetometer.
const FIELD: ([f64; 3], f64) = ([0.0, 0.6, -0.8], 0.003);

pub(super) fn write(spec: &Spec, mut drive: Drive, folder: &Path) -> io::Result<()> {
    let data = folder.join("sensor_data");
    fs::create_dir_all(&data)?;
    calibration(&folder.join("calibration"))?;
    let mut imu_rows = rows(&data.join("xsens_imu.csv"))?;
    let mut fog_rows = rows(&data.join("fog.csv"))?;
    let mut encoder_rows = rows(&data.join("encoder.csv"))?;
    let mut pose_rows = rows(&folder.join("global_pose.csv"))?;
    let [mut imu_delay, mut fog_delay, mut encoder_delay] =
        [1, 2, 3].map(|stream| Delay::new(spec.run, stream));
    let stamp = |seconds: f64| START_NS + (seconds * 1e9).round() as i64;
    let mut heading = None;
    for _ in 0..drive.ticks {
        let Some(truth) = drive.world.next() else { break };
        let motion = truth.motion;
        let rate = gyronet_tools::simulate::add(truth.inertial_rate, truth.shake.angular_rate);
        let span = DT / f64::from(INCREMENTS);
        for k in 1..=INCREMENTS {
            let time = truth.seconds + f64::from(k) * span;
            let increment = drive.fog.increment(rate, span);
            fog_rows.serialize((stamp(fog_delay.arrival(time)), increment.map(single)))?;
        }
        drive.fog.wander(DT);
        drive.odometer.step(motion.speed, motion.acceleration, motion.heading_rate, DT);

        let now = truth.seconds + DT;
        let (force, rate) = drive.imu(&truth);
        // The vendor's filter is unknown, so this heading is the integral of the gyro.
        let yaw = heading.get_or_insert(truth.yaw);
        *yaw += rate[2] * DT;
        let attitude = [motion.roll, motion.pitch, *yaw];
        let magnetic = drive.magnetic(&truth, FIELD.0, FIELD.1);
        let measured = [attitude, rate, force, magnetic].map(|axes| axes.map(single));
        let quaternion = quaternion(attitude).map(single);
        imu_rows.serialize((stamp(imu_delay.arrival(now)), quaternion, measured))?;

        let counts = drive.odometer.turns().map(|turns| (turns * RESOLUTION).floor() as i64);
        encoder_rows.serialize((stamp(encoder_delay.arrival(now)), counts))?;

        let (rotation, place) = (truth.rotation(), truth.position);
        let pose = [0, 1, 2].map(|k| (rotation[k].map(double), double(ORIGIN[k] + place[k])));
        pose_rows.serialize((stamp(now), pose))?;
    }
    [imu_rows, fog_rows, encoder_rows, pose_rows].iter_mut().try_for_each(csv::Writer::flush)
}

fn rows(path: &Path) -> io::Result<csv::Writer<File>> {
    Ok(csv::WriterBuilder::new().has_headers(false).from_path(path)?)
}

/// Rounds to an f32; adding zero makes -0 a 0.
fn single(value: f64) -> f32 {
    value as f32 + 0.0
}

/// Rounds to 1e-9.
fn double(value: f64) -> f64 {
    (value * 1e9).round() / 1e9 + 0.0
}

fn calibration(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let [left, right] = DIAMETER;
    let text = format!(
        "Encoder calibrated parameter\nEncoder resolution: {RESOLUTION}\n\
         Encoder left wheel diameter: {left}\nEncoder right wheel diameter: {right}\n\
         Encoder wheel base: {BASE}\n"
    );
    fs::write(folder.join("EncoderParameter.txt"), text)
}

/// Returns the quaternion x, y, z, w of roll, pitch and yaw, turned in the order yaw, pitch, roll.
fn quaternion([roll, pitch, yaw]: [f64; 3]) -> [f64; 4] {
    let half = |angle: f64| (libm::sin(angle / 2.0), libm::cos(angle / 2.0));
    let ((sr, cr), (sp, cp), (sy, cy)) = (half(roll), half(pitch), half(yaw));
    [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]
}

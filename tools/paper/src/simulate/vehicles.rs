//! Defines the simulated vehicle and its sensors, with the source of every parameter.
//!
//! Those of the route are in `town.rs`, of the wheels in `odometer.rs`, of tyres in `world.rs`, of delays in `delay.rs`. No
//! parameter was tuned to a result. (M) marks values recalled from a data sheet that was not available; (A) marks
//! assumptions where nothing is published.
//!
//! | what | value | source |
//! |---|---|---|
//! | KAIST IMU: gyro noise, walk; accelerometer noise, walk | 1.7453e-4, 1e-5; 5.886e-3, 1e-4 (SI) | OpenVINS `config/kaist/kalibr_imu_chain.yaml` (Xsens MTi-100 series) |
//! | KAIST IMU: gyro bias at power-on | 0.5 deg/s a year, taken as 2 sigma | Xsens knowledge base, Bias repeatability of gyroscopes |
//! | KAIST IMU: accelerometer bias | 0.03 m/s^2 | MTi 100 series data sheet (M) |
//! | KAIST IMU: scale; misalignment; gyro on force | 0.001; 0.05 deg; 0.003 deg/s/g | MTi 100 series data sheet (M) |
//! | KAIST FoG: angle random walk; bias stability | 0.012 deg/sqrt(h); 0.05 deg/h | KVH DSP-1760 data sheet; the second also in the paper, section III-C |
//! | KAIST FoG: bias offset | 0.5 deg/h, taken as 2 sigma | DSP-1760 data sheet (M) |
//! | KAIST FoG: bias random walk | 0.05 deg/h in an hour: equal to the stability | (A) |
//! | KAIST FoG: scale; misalignment | 200 ppm; 0.4 mrad | DSP-1760 data sheet (M) |
//! | KAIST wheels: diameters, base, 4096 counts | 0.623022, 0.622356, 1.5285 m | a published EncoderParameter.txt |
//! | KAIST wheels: error of both diameters, of each | 0.0006, 0.00003 | spread of three published calibrations of that car |
//! | slip stiffness | 30 | slope of dry asphalt, 20 to 50: Gustafsson, Slip-based tire-road friction estimation, 1997 (M) |
//! | cornering stiffness of the rear axle, over its load | 20 /rad | Rajamani, table of a passenger car: 2 x 80,000 N/rad over 7.7 kN (M) |
//! | KAIST speed limits | 30, 50, 70 km/h | Korean towns |
//! | waiting at a junction; share of junctions | 5 to 45 s; 0.4 | signal cycles of 60 to 120 s (A) |
//! | acceleration, braking, comfort in corners | 2.0, 1.8, 2.0 m/s^2 | as [`gyronet_tools::simulate::car::Config::DEFAULT`]; calm drivers |
//! | grade, bank | 0.03, 0.015 rad | streets are drained by 1.5 to 2 % of bank; grades up to 3 % (A) |
//! | wavelengths of the bank | 223 and 71 m | (A): different from the grade's, see [`gyronet_tools::simulate::car::Config::bank_waves`] |
//! | vibration | [`gyronet_tools::simulate::vibration`] | measured on a car (WID recordings) |
//! | KAIST latitude | 36.37 deg N | Daejeon |
//! | KAIST delay of a stamp | 0.1 ms, exponential | (A): it is small in the paper's Fig. 11 |

use super::fog;
use gyronet_tools::simulate::{car, mems};

/// 1 deg/h in rad/s.
const DEG_PER_HOUR: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// 1 deg in rad; 1 deg/s in rad/s.
const DEG: f64 = std::f64::consts::PI / 180.0;
/// sqrt(1 h) in sqrt(s).
const ROOT_HOUR: f64 = 60.0;

pub const CAR: car::Config = car::Config {
    wheel_radius: 0.311,
    track: 1.5285,
    road_grade: 0.03,
    road_bank: 0.015,
    bank_waves: [223.0, 71.0],
    ..car::Config::DEFAULT
};

pub const MEMS: mems::Config = mems::Config {
    gyro_bias: 0.25 * DEG,
    accel_bias: 0.03,
    scale: 0.001,
    misalignment: 0.05 * DEG,
    gyro_per_force: 0.003 * DEG / 9.806_65,
    mount: [0.0, 0.0],
    ..mems::Config::DEFAULT
};

pub const FOG: fog::Config = fog::Config {
    angle_walk: 0.012 * DEG / ROOT_HOUR,
    device_bias: 0.25 * DEG_PER_HOUR,
    run_bias: 0.05 * DEG_PER_HOUR,
    bias_walk: 0.05 * DEG_PER_HOUR / ROOT_HOUR,
    scale: 200e-6,
    misalignment: 0.4e-3,
};

/// Latitude of the simulated world, deg.
pub const LATITUDE_DEG: f64 = 36.37;

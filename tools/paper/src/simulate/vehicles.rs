//! Defines the vehicles and sensors of the two data sets, with the source of every parameter.
//!
//! No parameter was tuned to a result. (M) marks values recalled from a data sheet that was not available; (A) marks
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
//! | vibration | [`gyronet_tools::simulate::vibration::Config::DEFAULT`] | measured on a car (WID recordings) |
//! | KAIST latitude | 36.37 deg N | Daejeon |
//! | KAIST delay of a stamp | 0.1 ms, exponential | (A): it is small in the paper's Fig. 11 |
//! | NCLT IMU: gyro noise; bias stability; initial bias | 0.03 deg/s/sqrt(Hz); 18 deg/h in an hour; 0.25 deg/s, taken as 2 sigma | MicroStrain 3DM-GX3-45 data sheet (M) |
//! | NCLT IMU: accelerometer noise, bias; scale; misalignment | 80 ug/sqrt(Hz), 0.002 g; 0.0005; 0.05 deg | the same (M) |
//! | NCLT FoG: noise; bias stability; offset | 4 deg/h/sqrt(Hz); 1 deg/h; 20 deg/h, taken as 2 sigma | KVH DSP-3000 manual 54-0215 (M) |
//! | NCLT FoG: scale | 1000 ppm | the same, table 2, linearity |
//! | NCLT wheels: errors of diameters | 0.01 both, 0.003 each | the order of UMBmark, Borenstein and Feng 1996 (M); the paper calls these wheels inaccurate |
//! | NCLT speeds | 1.0, 1.3, 1.6 m/s | a Segway among people: 5.5 km in 73 min on average (M) |
//! | NCLT rates and gaps | 47.1 Hz, gaps to 72 ms; 41.2 Hz, to 201 ms | measured on 2013-01-10 |
//! | NCLT latitude | 42.29 deg N | Ann Arbor |

use super::{fog, odometer, town, world};
use gyronet_tools::simulate::{car, mems, vibration};

/// 1 deg/h in rad/s.
const DEG_PER_HOUR: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// 1 deg in rad; 1 deg/s in rad/s.
const DEG: f64 = std::f64::consts::PI / 180.0;
/// sqrt(1 h) in sqrt(s).
const ROOT_HOUR: f64 = 60.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delays {
    /// The mean delay, s.
    pub mean: f64,
    /// Mean time between two blockages, s, and their mean length, s; an infinite time means no blockages.
    pub blockage: [f64; 2],
    /// The longest blockage, s.
    pub longest: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle {
    pub world: world::Config,
    pub town: town::Config,
    pub mems: mems::Config,
    pub fog: fog::Config,
    pub wheels: odometer::Config,
    pub delays: Delays,
}

/// The car of KAIST Complex Urban.
pub const KAIST: Vehicle = Vehicle {
    world: world::Config {
        car: car::Config {
            wheel_radius: 0.311,
            track: 1.5285,
            road_grade: 0.03,
            road_bank: 0.015,
            bank_waves: [223.0, 71.0],
            ..car::Config::DEFAULT
        },
        vibration: vibration::Config::DEFAULT,
        cornering_stiffness: 20.0,
        latitude_deg: 36.37,
    },
    town: town::Config {
        limits: [(8.33, 0.35), (13.89, 0.45), (19.44, 0.2)],
        block: [60.0, 180.0],
        bends: 0.4,
        stops: 0.4,
        wait: [5.0, 45.0],
        turns: [0.25, 0.3],
        corner: [[25.0, 35.0], [15.0, 22.0]],
        lateral: 2.0,
        before: [8.0, 15.0],
    },
    mems: mems::Config {
        gyro_bias: 0.25 * DEG,
        accel_bias: 0.03,
        scale: 0.001,
        misalignment: 0.05 * DEG,
        gyro_per_force: 0.003 * DEG / 9.806_65,
        mount: [0.0, 0.0],
        ..mems::Config::DEFAULT
    },
    fog: fog::Config {
        angle_walk: 0.012 * DEG / ROOT_HOUR,
        device_bias: 0.25 * DEG_PER_HOUR,
        run_bias: 0.05 * DEG_PER_HOUR,
        bias_walk: 0.05 * DEG_PER_HOUR / ROOT_HOUR,
        scale: 200e-6,
        misalignment: 0.4e-3,
    },
    wheels: odometer::Config {
        diameter: [0.623_022, 0.622_356],
        base: 1.5285,
        common_error: 0.0006,
        wheel_error: 0.000_03,
        slip_stiffness: 30.0,
    },
    delays: Delays { mean: 1e-4, blockage: [f64::INFINITY, 0.0], longest: 0.0 },
};

/// The Segway of NCLT. Its vibration is that of the car, because no better data are available.
pub const NCLT: Vehicle = Vehicle {
    world: world::Config {
        car: car::Config {
            wheel_radius: 0.24,
            track: 0.6,
            acceleration: 0.5,
            braking: 0.5,
            // A Segway pitches in the direction of acceleration, much more than a car.
            pitch_gradient: 0.05,
            suspension_hz: 0.8,
            road_grade: 0.03,
            road_bank: 0.015,
            bank_waves: [223.0, 71.0],
            ..car::Config::DEFAULT
        },
        vibration: vibration::Config { road_speed: 2.0, ..vibration::Config::DEFAULT },
        cornering_stiffness: 20.0,
        latitude_deg: 42.29,
    },
    town: town::Config {
        limits: [(1.0, 0.2), (1.3, 0.6), (1.6, 0.2)],
        block: [15.0, 60.0],
        bends: 0.6,
        stops: 0.15,
        wait: [2.0, 20.0],
        turns: [0.3, 0.3],
        corner: [[2.0, 4.0], [2.0, 4.0]],
        lateral: 0.6,
        before: [8.0, 15.0],
    },
    mems: mems::Config {
        gyro_noise: 0.03 * DEG,
        gyro_walk: 18.0 * DEG_PER_HOUR / ROOT_HOUR,
        accel_noise: 80e-6 * 9.806_65,
        accel_walk: 1e-4,
        gyro_bias: 0.125 * DEG,
        accel_bias: 0.002 * 9.806_65,
        scale: 0.0005,
        misalignment: 0.05 * DEG,
        gyro_per_force: 0.0,
        mount: [0.0, 0.0],
    },
    fog: fog::Config {
        // Two-sided noise density, over 1 Hz.
        angle_walk: 4.0 * DEG_PER_HOUR,
        device_bias: 10.0 * DEG_PER_HOUR,
        run_bias: 1.0 * DEG_PER_HOUR,
        bias_walk: 1.0 * DEG_PER_HOUR / ROOT_HOUR,
        scale: 1000e-6,
        misalignment: 5e-3,
    },
    wheels: odometer::Config {
        diameter: [0.48, 0.48],
        base: 0.6,
        common_error: 0.01,
        wheel_error: 0.003,
        slip_stiffness: 30.0,
    },
    delays: Delays { mean: 1e-3, blockage: [5.0, 0.02], longest: 0.05 },
};

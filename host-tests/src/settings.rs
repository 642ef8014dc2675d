//! Random settings, each value of which is valid by itself: whether they are valid together is for the board to say.

use crate::noise::Noise;
use crate::wire::{id11, id29};
use gyronet::can::config::{
    BIT_RATES, BoschSettings, DataIdMode, E2e, Settings, StatusSettings, YawSettings,
};
use gyronet::can::diagnosis::DiagnosisIds;
use gyronet::can::signal::{BitField, ByteOrder};
use gyronet::can::wheel::{WheelFrame, WheelSettings};
use gyronet::compensate::{CompensateConfig, Lag, Stride};
use gyronet::heading::{GnssProtocol, GnssSettings, HeadingSettings, HeadingSignal};
use gyronet::store::{Configuration, Field, FogGyro, FogPart, Mounting};

/// Identifiers of all kinds of frames, few enough that they meet.
const IDS: [u16; 24] = [
    0x0A0, 0x0A1, 0x0AA, 0x0AB, 0x0B0, 0x130, 0x174, 0x178, 0x17C, 0x1A0, 0x1A1, 0x1A2, 0x1A3, 0x1A4, 0x1A5,
    0x1A6, 0x200, 0x201, 0x202, 0x300, 0x301, 0x6F0, 0x700, 0x708,
];
/// Frames of 29 bits.
const LONG_IDS: [u32; 6] = [0x0CFD_C50B, 0x0CFD_C52A, 0x18FE_F31C, 0x18DA_10F1, 0x18DB_33F1, 0x18DA_F110];

/// A value between the bounds of a field, its bounds among them.
fn within(noise: &mut Noise, field: Field) -> f32 {
    let [low, high] = field.range().expect("it has a range");
    match noise.int(0, 9) {
        0 => low,
        1 => high,
        _ => (low + (high - low) * noise.int(0, 1_000) as f32 / 1_000.0).clamp(low, high),
    }
}

fn one<T: Copy>(noise: &mut Noise, of: &[T]) -> T {
    of[noise.int(0, of.len() as i64 - 1) as usize]
}

fn maybe<T>(noise: &mut Noise, some: impl FnOnce(&mut Noise) -> T) -> Option<T> {
    (noise.int(0, 2) > 0).then(|| some(noise))
}

fn three(noise: &mut Noise, usual: [u16; 3]) -> [u16; 3] {
    if noise.int(0, 1) == 0 { usual } else { [(); 3].map(|()| one(noise, &IDS)) }
}

pub fn configuration(noise: &mut Noise) -> Configuration {
    let default = Configuration::DEFAULT;
    let yaw = default.can.yaw.expect("it is sent");
    let can = Settings {
        bits_per_second: one(noise, &BIT_RATES),
        bosch: maybe(noise, |noise| BoschSettings { tx1_only: noise.int(0, 1) == 0 }),
        yaw: maybe(noise, |noise| YawSettings {
            ids: three(noise, yaw.ids),
            period_ms: 10 * noise.int(1, 100) as u16,
            e2e: E2e::P01 { mode: DataIdMode::Both, data_ids: [1, 2, 3] },
            fd: (noise.int(0, 7) == 0).then(|| one(noise, &IDS)),
        }),
        status: maybe(noise, |noise| StatusSettings { id: one(noise, &IDS) }),
    };
    let place = |noise: &mut Noise| HeadingSignal {
        id: if noise.int(0, 1) == 0 { id29(one(noise, &LONG_IDS)) } else { id11(one(noise, &IDS)) },
        field: BitField::new(0, 32, ByteOrder::Intel, false).expect("inside the frame"),
        factor: 1e-7,
        offset: -210.0,
        invalid: Some(u32::MAX),
    };
    let line = (noise.int(0, 3) == 0)
        .then(|| GnssSettings { protocol: GnssProtocol::Ubx, baud: one(noise, &[4_800, 38_400, 460_800]) });
    let frames = HeadingSettings {
        nmea2000: noise.int(0, 1) == 0,
        j1939: noise.int(0, 3) == 0,
        speed: maybe(noise, place),
        course: maybe(noise, place),
        latitude: maybe(noise, place),
        ..HeadingSettings::NONE
    };
    // A line beside frames is refused.
    let is_alone = line.is_some() && noise.int(0, 1) == 0;
    let heading = HeadingSettings { line, ..if is_alone { HeadingSettings::NONE } else { frames } };
    let diagnosis = match noise.int(0, 3) {
        0 => DiagnosisIds {
            extended: true,
            request: LONG_IDS[3],
            functional: LONG_IDS[4],
            response: LONG_IDS[5],
        },
        1 => DiagnosisIds {
            request: one(noise, &IDS).into(),
            response: one(noise, &IDS).into(),
            ..DiagnosisIds::DEFAULT
        },
        _ => DiagnosisIds::DEFAULT,
    };
    let mut static_init = default.static_init;
    for (place, field) in [
        (&mut static_init.gyro_std, Field::StaticGyroStd),
        (&mut static_init.accel_std, Field::StaticAccelStd),
        (&mut static_init.gyro_drift, Field::StaticGyroDrift),
        (&mut static_init.accel_drift, Field::StaticAccelDrift),
        (&mut static_init.gyro_bias, Field::StaticGyroBias),
    ] {
        *place = within(noise, field);
    }
    Configuration {
        fog: maybe(noise, |_| FogPart::Dsp1760),
        can,
        latitude_deg: maybe(noise, |noise| within(noise, Field::LatitudeDeg)),
        mounting: Mounting {
            roll_deg: within(noise, Field::MountingRollDeg),
            pitch_deg: within(noise, Field::MountingPitchDeg),
            yaw_deg: within(noise, Field::MountingYawDeg),
        },
        static_init,
        compensate: CompensateConfig {
            stride: Stride::new(noise.int(1, 10) as u8).expect("1 to 10"),
            lag: Lag::new(noise.int(0, 11) as u8).expect("up to 11"),
            model: noise.int(0, 1) == 0,
            ..default.compensate
        },
        fog_ids: three(noise, default.fog_ids),
        fog_gyro: FogGyro { tilt_deg: within(noise, Field::FogTiltDeg) },
        heading,
        diagnosis,
        learn: noise.int(0, 1) == 0,
        ..default
    }
}

pub fn wheels(noise: &mut Noise) -> WheelSettings {
    let id = match noise.int(0, 3) {
        0 => id29(one(noise, &LONG_IDS)),
        1 => id11(one(noise, &[0x7DF, 0x7E0, 0x7E8])),
        _ => id11(one(noise, &IDS)),
    };
    let frame = WheelSettings::TOYOTA.frames[0].map(|frame| WheelFrame { id, ..frame });
    WheelSettings { frames: [frame, None, None, None], ..WheelSettings::TOYOTA }
}

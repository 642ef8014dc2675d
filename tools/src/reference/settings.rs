//! The settings of a board: names and defaults are those of the configuration, ranges those of its check.

use super::Table;
use crate::client::device::settings::{flat, to_value};
use gyronet::store::{Configuration, Field};
use std::collections::BTreeMap;

/// The value that a setting takes: a number in the range of its check, or what the text says.
enum Takes {
    Number(&'static str, Field, &'static str),
    Other(&'static str, &'static str),
}
use Takes::{Number, Other};

const SETTINGS: &[(&str, Takes)] = &[
    ("imu", Other("", "`XsensMti`, `Icm42688`, `Bmi088` or `Asm330lhh`")),
    (
        "fog",
        Other(
            "",
            "`null` or `Dsp1760`. The board reports a configured gyro that is silent \
             from the start",
        ),
    ),
    ("can.bits_per_second", Other("bit/s", "125000, 250000, 500000 or 1000000")),
    (
        "can.bosch.tx1_only",
        Other(
            "",
            "`true` sends the first message of Bosch's set only; `can.bosch=null` sends none of the set",
        ),
    ),
    ("can.yaw.ids", Other("", "as `fog_ids`; `can.yaw=null` sends none of the three")),
    ("can.yaw.period_ms", Other("ms", "10 to 1000, multiples of 10")),
    (
        "can.yaw.fd",
        Other(
            "",
            "`null`, or the identifier of one CAN FD frame in place of the three, on the NUCLEO-H563ZI; `423` is free",
        ),
    ),
    ("can.yaw.e2e.P01.mode", Other("", "`Both`, `Alternating`, `Low`, `Nibble`")),
    ("can.yaw.e2e.P01.data_ids", Other("", "three different E2E identifiers")),
    (
        "can.status",
        Other(
            "",
            "`null`, or `{\"id\":419}` to send the slow status message once a second, with a free identifier",
        ),
    ),
    (
        "latitude_deg",
        Number(
            "deg",
            Field::LatitudeDeg,
            "north positive; `null` leaves the Earth's rate in the bias, and a fibre-optic gyro's rate is degraded",
        ),
    ),
    ("mounting.roll_deg", Number("deg", Field::MountingRollDeg, "")),
    ("mounting.pitch_deg", Number("deg", Field::MountingPitchDeg, "")),
    ("mounting.yaw_deg", Number("deg", Field::MountingYawDeg, "90: x points to the left")),
    ("static_init.gyro_std", Number("rad/s", Field::StaticGyroStd, "standard deviation at rest")),
    ("static_init.accel_std", Number("m/s^2", Field::StaticAccelStd, "standard deviation at rest")),
    ("static_init.gyro_drift", Number("rad/s", Field::StaticGyroDrift, "spread of one-second means at rest")),
    (
        "static_init.accel_drift",
        Number("m/s^2", Field::StaticAccelDrift, "spread of one-second means at rest"),
    ),
    ("static_init.gyro_bias", Number("rad/s", Field::StaticGyroBias, "largest bias")),
    ("compensate.stride", Other("samples", "1 to 10")),
    ("compensate.lag", Other("samples", "0 to 11, of 10 ms: how late the delayed rate is sent")),
    (
        "compensate.model",
        Other("", "`false`: the model's corrections are not subtracted, only bias, level and gain"),
    ),
    (
        "fog_ids",
        Other(
            "",
            "three different identifiers of up to 11 bits, outside 0x7DF to 0x7EF: rate, angle, detail",
        ),
    ),
    (
        "fog_gyro.tilt_deg",
        Number("deg", Field::FogTiltDeg, "from the gyro's axis to the vertical of the level vehicle"),
    ),
    ("heading.nmea2000", Other("", "`true`: course and latitude from PGN 129026 and 129025")),
    ("heading.j1939", Other("", "`true`: from PGN 65256 and 65267")),
    ("heading.course", Other("", "`null`, or where a frame has it, rad clockwise from north")),
    ("heading.course_sigma", Other("", "the same, rad")),
    ("heading.speed", Other("", "the same, m/s over ground")),
    ("heading.speed_sigma", Other("", "the same, m/s")),
    ("heading.latitude", Other("", "the same, deg")),
    (
        "heading.line",
        Other(
            "",
            "`null`, or a receiver on UART4 in place of frames: `{\"protocol\":\"Ubx\",\"baud\":38400}` (4800 to 460800), or `Nmea`",
        ),
    ),
    ("diagnosis.extended", Other("", "`true`: the three identifiers have 29 bits")),
    (
        "diagnosis.request",
        Other("", "identifier of diagnostic requests to this board; the three must differ"),
    ),
    ("diagnosis.functional", Other("", "identifier of requests to all ECUs")),
    ("diagnosis.response", Other("", "identifier of the board's diagnostic frames")),
    (
        "learn",
        Other("", "`true`: the board learns and uses the sensor's bias by temperature and its mounting"),
    ),
];

pub fn settings() -> Table {
    let mut table = Table::new(&["setting", "unit", "range", "default"]);
    let defaults = defaults();
    for (name, takes) in SETTINGS {
        let (unit, range) = match takes {
            Number(unit, field, text) => (unit, range(*field, text)),
            Other(unit, text) => (unit, (*text).to_owned()),
        };
        let default = defaults.get(*name).map(|default| format!("`{default}`")).unwrap_or_default();
        table.row([&format!("`{name}`"), unit, &range, &default]);
    }
    table
}

fn defaults() -> BTreeMap<String, String> {
    let defaults = to_value(&Configuration::DEFAULT).expect("a configuration is JSON");
    flat(&defaults).into_iter().collect()
}

fn range(field: Field, text: &str) -> String {
    let [low, high] = field.range().expect("a number has a range");
    let separator = if text.is_empty() { "" } else { "; " };
    format!("{low} to {high}{separator}{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_of_the_configuration_is_in_the_table_once() {
        let mut names: Vec<&str> = SETTINGS.iter().map(|(name, _)| *name).collect();
        names.sort_unstable();
        assert_eq!(names, defaults().keys().collect::<Vec<_>>());
    }

    #[test]
    fn a_number_has_the_range_of_the_field_with_its_name() {
        for (name, takes) in SETTINGS {
            if let Number(_, field, _) = takes {
                assert_eq!(field.name(), *name);
                assert!(field.range().is_some(), "{name}");
            }
        }
    }
}

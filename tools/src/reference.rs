//! Tables for the pages: settings, data identifiers, troubles and states. What the library knows of them (defaults,
//! ranges, numbers, troubles) is the library's; names and words are in the files beside `table.rs`.

mod table;

pub use table::Table;

use crate::client::device::settings::{flat, to_value};
use gyronet::health::Status;
use gyronet::store::{Configuration, Field};
use gyronet::uds::dtc::TROUBLES;
use std::collections::BTreeMap;

/// The settings whose range is that of their check.
const NUMBERS: [Field; 10] = [
    Field::LatitudeDeg,
    Field::FogTiltDeg,
    Field::MountingRollDeg,
    Field::MountingPitchDeg,
    Field::MountingYawDeg,
    Field::StaticGyroStd,
    Field::StaticAccelStd,
    Field::StaticGyroDrift,
    Field::StaticAccelDrift,
    Field::StaticGyroBias,
];

pub fn troubles() -> Table {
    let mut table = Table::parse("code | bytes | trouble | check");
    for trouble in &TROUBLES {
        let (code, bytes) = (trouble.display().to_string(), format!("{:06X}", trouble.code));
        table.rows.push([&code, &bytes, trouble.name, trouble.check].map(str::to_owned).into());
    }
    table
}

/// The data identifiers of diagnosis (ISO 14229-1 C.1), with the names of `tools/gyronet_uds.yaml`, and the services that
/// accept them; writing needs the extended session.
pub fn identifiers() -> Table {
    Table::parse(include_str!("reference/identifiers.txt"))
}

/// The states of the corrected yaw rate, and conditions that leave the state as it is, without a status of their own.
///
/// In a fault state there is no yaw rate: our own messages report "not available", Bosch's set "failed". From a fault the
/// state returns to init where no bias is known, otherwise to degraded.
pub fn states() -> Table {
    let mut table = Table::parse(include_str!("reference/states.txt"));
    let statuses =
        [Status::Init, Status::Ready, Status::Degraded, Status::Clipped, Status::Stuck, Status::Silent];
    for status in table.rows.iter_mut().map(|row| &mut row[1]) {
        let known = statuses.iter().find(|known| format!("{known:?}") == *status);
        *status = known.map(|known| (*known as u8).to_string()).unwrap_or_default();
    }
    table
}

/// The settings of a board: names and defaults are those of the configuration.
pub fn settings() -> Table {
    let mut table = Table::parse(include_str!("reference/settings.txt"));
    let defaults = defaults();
    for row in &mut table.rows {
        let default = defaults.get(&row[0]).map(|default| format!("`{default}`")).unwrap_or_default();
        if let Some([low, high]) = NUMBERS.iter().find(|of| of.name() == row[0]).and_then(|of| of.range()) {
            let separator = if row[2].is_empty() { "" } else { "; " };
            row[2] = format!("{low} to {high}{separator}{}", row[2]);
        }
        row[0] = format!("`{}`", row[0]);
        row[3] = default;
    }
    table
}

fn defaults() -> BTreeMap<String, String> {
    let defaults = to_value(&Configuration::DEFAULT).expect("a configuration is JSON");
    flat(&defaults).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_of_the_configuration_is_in_the_table_once() {
        let table = settings();
        let mut names: Vec<&str> = table.rows.iter().map(|row| row[0].trim_matches('`')).collect();
        assert!(NUMBERS.iter().all(|of| of.range().is_some() && names.contains(&of.name())));
        names.sort_unstable();
        assert_eq!(names, defaults().keys().collect::<Vec<_>>());
    }
}

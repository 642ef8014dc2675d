//! Converts the configuration to readable names and values, and back.
//!
//! A name is the path of a field, with dots. Rates are in rad/s; the board stores them as integer codes.
//! `tools/README.md` has a table of all names.

use gyronet::store::Configuration;
use gyronet::units::AngularRate;
use serde::Serialize;
use serde_json::Value;

/// Settings that have gone, with the reason or the successor. A name stands for those below it too.
const RETIRED: &str = include_str!("retired.txt");
/// Decimals, in rad/s, that distinguish any two codes.
const RATE_DECIMALS: usize = 9;

#[derive(Debug, thiserror::Error)]
pub enum SettingError {
    #[error("{0}: not NAME=VALUE")]
    NoAssignment(String),
    #[error("{0}: there is no such setting; see `device get`")]
    Name(String),
    #[error("{0}: {1}")]
    Retired(&'static str, &'static str),
    #[error("no configuration: {0}")]
    Json(#[from] serde_json::Error),
}

pub fn to_value(configuration: &Configuration) -> Result<Value, SettingError> {
    Ok(value(configuration)?)
}

fn retired() -> impl Iterator<Item = (&'static str, &'static str)> {
    RETIRED.lines().map(|line| line.split_once(" | ").expect("a name and its successor"))
}

/// Converts names and values to a configuration; ranges are not checked.
pub fn from_value(value: Value) -> Result<Configuration, SettingError> {
    let path = |name: &str| format!("/{}", name.replace('.', "/"));
    if let Some((name, instead)) = retired().find(|(name, _)| value.pointer(&path(name)).is_some()) {
        return Err(SettingError::Retired(name, instead));
    }
    Ok(serde_json::from_value(value)?)
}

pub fn assign(configuration: &mut Value, setting: &str) -> Result<(), SettingError> {
    let (name, text) = setting.split_once('=').ok_or_else(|| SettingError::NoAssignment(setting.into()))?;
    let is_below =
        |above: &str| name.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    if let Some((name, instead)) = retired().find(|(retired, _)| is_below(retired)) {
        return Err(SettingError::Retired(name, instead));
    }
    let place = name.split('.').try_fold(configuration, |value, key| match key.parse::<usize>() {
        Ok(index) => value.get_mut(index),
        Err(_) => value.get_mut(key),
    });
    // A string, such as the name of a part, needs no quotes.
    *place.ok_or_else(|| SettingError::Name(name.into()))? =
        serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.to_owned()));
    Ok(())
}

/// Converts a value to JSON by way of text, so that floats have no more digits than they need.
pub fn value(of: &impl Serialize) -> serde_json::Result<Value> {
    serde_json::from_str(&serde_json::to_string(of)?)
}

pub fn flat(value: &Value) -> Vec<(String, String)> {
    let mut lines = Vec::new();
    walk("", value, &mut lines);
    lines
}

fn walk(name: &str, value: &Value, lines: &mut Vec<(String, String)>) {
    let under = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                walk(&under(key), value, lines);
            }
        }
        Value::Array(values) if values.iter().any(|value| value.is_object()) => {
            for (index, value) in values.iter().enumerate() {
                walk(&under(&index.to_string()), value, lines);
            }
        }
        value => lines.push((name.to_owned(), value.to_string())),
    }
}

/// Returns a rate in rad/s with the fewest decimals that convert back to its code.
pub(super) fn shortest(rate: AngularRate) -> f64 {
    let exact = rate.rad_per_sec();
    let mut rounded = (1..=RATE_DECIMALS).filter_map(|decimals| format!("{exact:.decimals$}").parse().ok());
    rounded.find(|rounded| code(*rounded) == Some(rate.0)).unwrap_or(exact)
}

/// Returns the nearest code of a rate; in f64, because an f32 cannot represent every code.
fn code(rad_per_sec: f64) -> Option<i32> {
    let code = (rad_per_sec * f64::from(AngularRate::PER_RAD_PER_SEC)).round();
    (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&code).then_some(code as i32)
}

//! The configuration as readable names and values.
//!
//! Names are the fields', dots between the parts; rates are in rad/s, which the board holds as
//! whole codes. The table of them is in `tools/README.md`.

use gyronet::store::Configuration;
use gyronet::units::AngularRate;
use serde::Serialize;
use serde_json::Value;

/// Rates that a record holds as codes: names inside `compensate`.
const RATES: [&str; 3] = ["max_mean", "max_single", "max_carry"];
/// Decimals that distinguish every two codes, rad/s.
const RATE_DECIMALS: usize = 9;

/// The error of names and values that are no configuration.
#[derive(Debug, thiserror::Error)]
pub enum SettingError {
    /// Text that gives no value a name.
    #[error("{0}: not NAME=VALUE")]
    NoAssignment(String),
    /// A name that nothing has.
    #[error("{0}: there is no such setting; see `device get`")]
    Name(String),
    /// A value that is no rate, or one that no code stands for.
    #[error("compensate.{name}: {value} is not a rate in rad/s")]
    Rate {
        /// Whose.
        name: &'static str,
        /// Its value.
        value: Value,
    },
    /// A part is missing, or is something else.
    #[error("no configuration: {0}")]
    Json(#[from] serde_json::Error),
}

/// A configuration by names, rates in rad/s.
///
/// # Errors
/// [`SettingError::Json`], which no configuration gives.
pub fn to_value(configuration: &Configuration) -> Result<Value, SettingError> {
    let mut value = value(configuration)?;
    for name in RATES {
        if let Some(rate) = value.pointer_mut(&format!("/compensate/{name}"))
            && let Some(code) = rate.as_i64().and_then(|code| i32::try_from(code).ok())
        {
            *rate = shortest(AngularRate(code)).into();
        }
    }
    Ok(value)
}

/// The configuration that names and values stand for; ranges are not checked.
///
/// # Errors
/// [`SettingError::Rate`], [`SettingError::Json`].
pub fn from_value(mut value: Value) -> Result<Configuration, SettingError> {
    for name in RATES {
        // What is not there is missed below.
        let Some(rate) = value.pointer_mut(&format!("/compensate/{name}")) else { continue };
        let refused = SettingError::Rate { name, value: rate.clone() };
        *rate = rate.as_f64().and_then(code).ok_or(refused)?.into();
    }
    Ok(serde_json::from_value(value)?)
}

/// Sets one value, `name=value`; values as in JSON.
///
/// # Errors
/// [`SettingError::NoAssignment`], [`SettingError::Name`].
pub fn assign(configuration: &mut Value, setting: &str) -> Result<(), SettingError> {
    let (name, text) = setting.split_once('=').ok_or_else(|| SettingError::NoAssignment(setting.into()))?;
    let place = name.split('.').try_fold(configuration, |value, key| match key.parse::<usize>() {
        Ok(index) => value.get_mut(index),
        Err(_) => value.get_mut(key),
    });
    // Names of parts need no quotes.
    *place.ok_or_else(|| SettingError::Name(name.into()))? =
        serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.to_owned()));
    Ok(())
}

/// Converts a value by way of text, so that numbers are as short as they are written.
///
/// # Errors
/// [`serde_json::Error`], where it is nothing that JSON knows.
pub fn value(of: &impl Serialize) -> serde_json::Result<Value> {
    serde_json::from_str(&serde_json::to_string(of)?)
}

/// Returns every value with its name.
#[must_use]
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

/// Returns a rate with as few decimals as lead back to its code.
pub(super) fn shortest(rate: AngularRate) -> f64 {
    let exact = rate.rad_per_sec();
    let mut rounded = (1..=RATE_DECIMALS).filter_map(|decimals| format!("{exact:.decimals$}").parse().ok());
    rounded.find(|rounded| code(*rounded) == Some(rate.0)).unwrap_or(exact)
}

/// Nearest code, in f64: an f32 does not hold every one.
fn code(rad_per_sec: f64) -> Option<i32> {
    let code = (rad_per_sec * f64::from(AngularRate::PER_RAD_PER_SEC)).round();
    (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&code).then_some(code as i32)
}

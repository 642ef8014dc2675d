//! The configuration as names and values.

use super::{Board, done, mismatch, print_json};
use gyronet::service::{Reply, Request};
use gyronet::store::{Configuration, Record};
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

pub fn get(device: &mut Board) -> Result<Configuration> {
    let Reply::Configuration { version, configuration, .. } = device.ask(&Request::GetConfiguration)? else {
        return mismatch();
    };
    if version != Configuration::VERSION {
        return Err(
            format!("configuration layout {version}; this tool knows {}", Configuration::VERSION).into()
        );
    }
    Ok(configuration)
}

pub fn print(configuration: &Configuration, json: bool) -> Result<()> {
    if json { print_json(configuration) } else { super::print_value(configuration, false) }
}

/// Changes what the board has now, value by value, or replaces it.
pub fn set(device: &mut Board, settings: &[String], file: Option<&Path>, json: bool) -> Result<()> {
    if settings.is_empty() && file.is_none() {
        return Err("nothing to set: give NAME=VALUE, or --file".into());
    }
    let mut wanted = match file {
        Some(path) => {
            let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
            serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?
        }
        None => value(&get(device)?)?,
    };
    for setting in settings {
        let (name, text) = setting.split_once('=').ok_or_else(|| format!("{setting}: not NAME=VALUE"))?;
        let place = name.split('.').try_fold(&mut wanted, |value, key| match key.parse::<usize>() {
            Ok(index) => value.get_mut(index),
            Err(_) => value.get_mut(key),
        });
        let place = place.ok_or_else(|| format!("{name}: there is no such setting; see `device get`"))?;
        // Names of parts need no quotes.
        *place = serde_json::from_str(text).unwrap_or_else(|_| Value::String(text.to_owned()));
    }
    let configuration: Configuration =
        serde_json::from_value(wanted).map_err(|error| format!("no configuration: {error}"))?;
    configuration.check()?;
    device.ask(&Request::SetConfiguration { version: Configuration::VERSION, configuration })?;
    done(json, "stored; it holds from the next start on");
    Ok(())
}

/// By way of text: numbers then are as short as they are meant.
pub fn value(of: &impl Serialize) -> Result<Value> {
    Ok(serde_json::from_str(&serde_json::to_string(of)?)?)
}

/// Every value with its name, dots between the parts.
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

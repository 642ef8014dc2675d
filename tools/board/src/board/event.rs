//! Events that the model records with their board time, and the counts of a run.

use serde_json::Value;
use std::time::Duration;

#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    pub time: Duration,
    /// `reset`, `fault`, `lockup`, `flash_erase`, `cut` and others.
    pub kind: String,
    fields: Value,
}

impl Event {
    pub(super) fn new(entry: &Value) -> Self {
        Self {
            time: super::duration(&entry["time_us"]),
            kind: entry["kind"].as_str().unwrap_or_default().to_owned(),
            fields: entry.clone(),
        }
    }

    /// A further field: the `cause` of a `reset`. Empty if there is none.
    pub fn text(&self, name: &str) -> &str {
        self.fields[name].as_str().unwrap_or_default()
    }

    /// A further field: the `sectors` of a `flash_erase`.
    pub fn numbers(&self, name: &str) -> Vec<u64> {
        self.fields[name].as_array().into_iter().flatten().filter_map(Value::as_u64).collect()
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        self.fields[name].as_f64()
    }
}

/// The counts of a board since its first power-on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counts {
    pub instructions: u64,
    pub time: Duration,
    /// Board time during which the core slept.
    pub asleep: Duration,
    /// Frames of other nodes that the controller's filters have stopped.
    pub frames_filtered: u64,
    /// Accesses to the flash that [`super::Board::cut_after`] still waits for.
    pub accesses_left: usize,
}

impl Counts {
    pub(super) fn new(answer: &Value) -> Self {
        Self {
            instructions: answer["instructions"].as_u64().expect("the model counts"),
            time: super::duration(&answer["time_us"]),
            asleep: super::duration(&answer["asleep_us"]),
            frames_filtered: answer["can_filtered"].as_u64().expect("the model counts"),
            accesses_left: answer["accesses_left"].as_u64().expect("the model counts") as usize,
        }
    }
}

//! A table that prints as Markdown or as JSON.

use serde_json::{Map, Value};
use std::fmt;

/// Rows of text under column names; displayed as Markdown.
pub struct Table {
    columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Reads the names of the columns in the first line, and a row in each other one, which may lack its last cells.
    pub(super) fn parse(text: &str) -> Self {
        let mut lines = text.lines().map(|line| line.split('|').map(|cell| cell.trim().to_owned()).collect());
        let columns: Vec<String> = lines.next().unwrap_or_default();
        let mut rows: Vec<Vec<String>> = lines.collect();
        rows.iter_mut().for_each(|row| row.resize(columns.len(), String::new()));
        Self { columns, rows }
    }

    pub fn json(&self) -> Value {
        let object = |row: &Vec<String>| {
            let cells = self.columns.iter().cloned().zip(row.iter().map(|cell| cell.clone().into()));
            cells.collect::<Map<_, _>>()
        };
        self.rows.iter().map(object).map(Value::Object).collect()
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| {} |", self.columns.join(" | "))?;
        writeln!(f, "|{}", "---|".repeat(self.columns.len()))?;
        self.rows.iter().try_for_each(|row| writeln!(f, "| {} |", row.join(" | ")))
    }
}

//! Logs imported with all rows at hand.

use gyronet_tools::import::drive::{Logs, Request, Row};
use gyronet_tools::import::error::ImportError;

/// Holds a drive that was made.
#[derive(Debug)]
pub struct Imported {
    pub rows: Vec<Row>,
    /// What a user is told.
    pub report: Vec<String>,
    /// Records that could not be used.
    pub dropped: u64,
}

/// Reads logs and makes one drive of them.
pub fn import(request: &Request) -> Result<Imported, ImportError> {
    let logs = Logs::read(request)?;
    let drive = logs.drive(request)?;
    let rows: Vec<Row> = drive.rows().collect();
    assert_eq!(rows.len(), drive.seen.rows);
    Ok(Imported { rows, report: drive.report, dropped: logs.dropped })
}

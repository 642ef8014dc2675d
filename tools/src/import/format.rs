//! Detects the format of a file by its first bytes, and says how to convert formats that cannot be read.

use super::can::Bus;
use super::error::ImportError;
use super::input::Input;
use super::log::Log;
use super::{blf, candump, mcap, ros_bag, table, ulog};
use crate::drive::vehicle::Columns;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Formats that are known but cannot be read: their first bytes, and how to convert them.
const REFUSED: [(&[u8], &str); 3] = [
    (
        b"SQLite format 3\0",
        "a ROS 2 bag in SQLite, which cannot be read; convert it: \
         pip install rosbags && rosbags-convert --src FOLDER --dst CONVERTED --dst-storage mcap",
    ),
    (
        b"MDF     ",
        "an MDF file; convert it: pip install asammdf && python3 -c \"from asammdf import MDF; \
         MDF('FILE').to_dataframe(raster=0.01).to_csv('FILE.csv', index_label='t_s')\"",
    ),
    (b"PK\x03\x04", "a ZIP archive; unpack it first"),
];

/// Reads a file. `bus` decodes CAN frames, `columns` names the columns of a text table.
pub fn read_file(path: &Path, bus: Option<&Bus>, columns: &Columns) -> Result<Log, ImportError> {
    read_into(path, bus, columns, Log::default())
}

/// Reads a file into a log whose wanted channels are set.
pub fn read_into(path: &Path, bus: Option<&Bus>, columns: &Columns, log: Log) -> Result<Log, ImportError> {
    let name = path.display().to_string();
    let io = |source| ImportError::Io { path: name.clone(), source };
    if path.is_dir() {
        return Err(ImportError::Format {
            path: name,
            reason: "is a folder; give the files in it".to_owned(),
        });
    }
    let file = File::open(path).map_err(io)?;
    read(&name, &mut BufReader::with_capacity(1 << 16, file), bus, columns, log)
}

/// Reads bytes as the contents of a file of that name.
pub fn read_bytes(
    name: &str,
    mut bytes: &[u8],
    bus: Option<&Bus>,
    columns: &Columns,
) -> Result<Log, ImportError> {
    read(name, &mut bytes, bus, columns, Log::default())
}

fn read(
    name: &str,
    input: &mut Input<'_>,
    bus: Option<&Bus>,
    columns: &Columns,
    mut log: Log,
) -> Result<Log, ImportError> {
    let io = |source: std::io::Error| ImportError::Io { path: name.to_owned(), source };
    let refuse = |reason: &str| ImportError::Format { path: name.to_owned(), reason: reason.to_owned() };
    // The first read fills the buffer with more than the magic bytes.
    let head = input.fill_buf().map_err(io)?;
    if head.is_empty() {
        return Err(refuse("is empty"));
    }
    if let Some((_, reason)) = REFUSED.iter().find(|(magic, _)| head.starts_with(magic)) {
        return Err(refuse(reason));
    }
    if head.starts_with(mcap::MAGIC) {
        mcap::read(input, &mut log);
    } else if head.starts_with(ros_bag::MAGIC) {
        input.consume(ros_bag::MAGIC.len());
        ros_bag::read(input, &mut log).map_err(io)?;
    } else if head.starts_with(b"#ROSBAG") {
        return Err(refuse("not a bag of version 2.0; convert it: rosbag fix OLD.bag NEW.bag"));
    } else if head.starts_with(ulog::MAGIC) {
        ulog::read(input, &mut log).map_err(io)?;
    } else if head.starts_with(blf::MAGIC) {
        blf::read(input, bus, &mut log).map_err(io)?;
    } else if let Some(dialect) = candump::dialect(head) {
        candump::read(dialect, input, bus, &mut log).map_err(io)?;
    } else {
        table::read(input, columns, &mut log).map_err(|error| refuse(&error.to_string()))?;
    }
    if let Some(error) = log.failed.take() {
        let source = std::io::Error::new(error.kind(), format!("temporary file: {error}"));
        return Err(io(source));
    }
    Ok(log)
}

//! Logs of other tools, recognised by their first bytes.

use super::error::{DataError, DataFault, named};
use super::word;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;

const FORMATS: [(&[u8], &str); 17] = [
    (b"\x89MCAP", "an MCAP file"),
    (b"#ROSBAG", "a ROS 1 bag"),
    (b"SQLite format 3", "a ROS 2 bag in SQLite"),
    (b"ULog", "a PX4 ULog"),
    (b"LOGG", "a Vector BLF log"),
    (b"MDF ", "an MDF log"),
    (b"UnFinMF ", "an MDF log"),
    (b"date ", "a Vector ASC log"),
    (b"Date ", "a Vector ASC log"),
    (b";", "a PEAK TRC log"),
    (b"//", "an Xsens text log"),
    (b"\x1f\x8b", "a gzip file"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard file"),
    (b"(", "a candump log"),
    (b" (", "a candump log"),
    (b"BZh", "a bzip2 file"),
    (b"PK\x03\x04", "a ZIP archive"),
];

/// Opens a drive for reading; a log or a folder is refused with the command that imports it.
pub fn open(path: &Path) -> Result<File, DataError> {
    let failed = named(path);
    let mut file = File::open(path).map_err(&failed)?;
    let kind = file.metadata().map_err(&failed)?.file_type();
    if kind.is_dir() {
        return Err(refused(path, "a folder"));
    }
    // A pipe cannot be read twice.
    if kind.is_file() {
        let mut first = Vec::new();
        file.by_ref().take(32).read_to_end(&mut first).map_err(&failed)?;
        file.rewind().map_err(&failed)?;
        if let Some((_, format)) = FORMATS.iter().find(|(begins, _)| first.starts_with(begins)) {
            return Err(refused(path, format));
        }
    }
    Ok(file)
}

fn refused(path: &Path, format: &'static str) -> DataError {
    let command = format!("cargo gyronet import {} --out {}", word(path), word(&path.with_extension("csv")));
    DataError::of(path.display(), DataFault::Foreign { format, command })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_is_named_with_the_command_that_imports_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.log");
        for (begins, format) in FORMATS {
            std::fs::write(&path, [begins, &[0xFF; 40]].concat()).unwrap();
            let error = open(&path).unwrap_err().to_string();
            let out = folder.path().join("drive.csv");
            let expected = format!(
                "{0}: {format}, not a drive; import it first: cargo gyronet import {0} --out {1}",
                path.display(),
                out.display()
            );
            assert_eq!(error, expected);
        }
        assert!(open(folder.path()).unwrap_err().to_string().contains(": a folder, not a drive; import it"));
        std::fs::write(&path, "t_s,acc_x\n").unwrap();
        let mut text = String::new();
        open(&path).unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "t_s,acc_x\n");
        assert!(matches!(open(&folder.path().join("none")).unwrap_err().fault, DataFault::Io(_)));
    }
}

//! Reads a weight file (`.blob`) from disk into memory with the alignment that the library needs.

use crate::drive::error::{DataError, read};
use gyronet::model::{Blob, BlobError, FogBlob};
use std::path::Path;

/// The bytes of a weight file, which the library checks when they are used.
#[derive(Debug, Clone)]
pub struct WeightFile {
    path: String,
    /// The bytes of the file, in words for alignment; the last word may be padded.
    words: Vec<u32>,
    len: usize,
}

impl WeightFile {
    pub fn read(path: &Path) -> Result<Self, DataError> {
        Ok(Self::new(&path.display().to_string(), &read(path)?))
    }

    /// Takes the bytes of a weight file; `path` is its name in errors.
    pub fn new(path: &str, bytes: &[u8]) -> Self {
        let mut words = vec![0u32; bytes.len().div_ceil(4)];
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        Self { path: path.to_owned(), words, len: bytes.len() }
    }

    pub fn blob(&self) -> Result<Blob<'_>, DataError> {
        Blob::new_checked(self.bytes()).map_err(|source| self.refused(source))
    }

    pub fn fog_blob(&self) -> Result<FogBlob<'_>, DataError> {
        FogBlob::new_checked(self.bytes()).map_err(|source| self.refused(source))
    }

    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.len]
    }

    fn refused(&self, source: BlobError) -> DataError {
        DataError::because(&self.path, format!("{source}; `gyronet quantize` makes weight files"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::model::weights::GYRONET;

    fn refused(edit: impl Fn(&mut Vec<u8>)) -> String {
        let mut bytes = GYRONET.0.to_vec();
        edit(&mut bytes);
        WeightFile::new("w.blob", &bytes).blob().unwrap_err().to_string()
    }

    #[test]
    fn what_is_wrong_is_said_with_the_name() {
        for (message, start) in [
            (refused(|bytes| bytes[0] = b'X'), "w.blob: weight file: it begins with [58, 59"),
            (refused(|bytes| bytes[4] = 9), "w.blob: weight file: format version 9"),
            (refused(|bytes| bytes.truncate(70_001)), "w.blob: weight file: 70001 bytes"),
            (refused(Vec::clear), "w.blob: weight file: "),
            (refused(|bytes| bytes[90_000] ^= 1), "w.blob: weight file: checksum"),
            (
                WeightFile::read(Path::new("no/such.blob")).unwrap_err().to_string(),
                "no/such.blob: No such file",
            ),
        ] {
            assert!(message.starts_with(start), "{message}");
        }
    }
}

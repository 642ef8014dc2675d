//! Reads a weight file (`.blob`) from disk into memory with the alignment that the library needs.

use gyronet::model::{Blob, BlobError, FogBlob};
use std::path::Path;

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WeightFileError {
    #[error("{path}: {source}")]
    Io { path: String, source: std::io::Error },
    #[error("{path}: {source}; `gyronet quantize` makes weight files")]
    Blob { path: String, source: BlobError },
}

/// A weight file that has passed all of the library's checks.
#[derive(Debug, Clone)]
pub struct WeightFile {
    path: String,
    /// The bytes of the file, in words for alignment; the last word may be padded.
    words: Vec<u32>,
    len: usize,
}

impl WeightFile {
    pub fn read(path: &Path) -> Result<Self, WeightFileError> {
        Self::parse(&path.display().to_string(), &bytes(path)?)
    }

    pub fn read_fognet(path: &Path) -> Result<Self, WeightFileError> {
        Self::parse_fognet(&path.display().to_string(), &bytes(path)?)
    }

    /// Checks the bytes of a weight file of GyroNet; `path` is its name in errors.
    pub fn parse(path: &str, bytes: &[u8]) -> Result<Self, WeightFileError> {
        let file = Self::copy(path, bytes);
        file.blob()?;
        Ok(file)
    }

    /// Checks the bytes of a weight file of FoGNet; `path` is its name in errors.
    pub fn parse_fognet(path: &str, bytes: &[u8]) -> Result<Self, WeightFileError> {
        let file = Self::copy(path, bytes);
        file.fog_blob()?;
        Ok(file)
    }

    pub fn blob(&self) -> Result<Blob<'_>, WeightFileError> {
        Blob::new_checked(self.bytes()).map_err(|source| self.refused(source))
    }

    pub fn fog_blob(&self) -> Result<FogBlob<'_>, WeightFileError> {
        FogBlob::new_checked(self.bytes()).map_err(|source| self.refused(source))
    }

    fn copy(path: &str, bytes: &[u8]) -> Self {
        let mut words = vec![0u32; bytes.len().div_ceil(4)];
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        Self { path: path.to_owned(), words, len: bytes.len() }
    }

    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.len]
    }

    fn refused(&self, source: BlobError) -> WeightFileError {
        WeightFileError::Blob { path: self.path.clone(), source }
    }
}

fn bytes(path: &Path) -> Result<Vec<u8>, WeightFileError> {
    std::fs::read(path).map_err(|source| WeightFileError::Io { path: path.display().to_string(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::model::weights::GYRONET;

    fn refused(edit: impl Fn(&mut Vec<u8>)) -> String {
        let mut bytes = GYRONET.0.to_vec();
        edit(&mut bytes);
        WeightFile::parse("w.blob", &bytes).unwrap_err().to_string()
    }

    #[test]
    fn the_default_weights_pass() {
        let file = WeightFile::parse("w.blob", &GYRONET.0).unwrap();
        assert_eq!(file.blob().unwrap().crc, Blob::new_checked(&GYRONET.0).unwrap().crc);
    }

    #[test]
    fn what_is_wrong_is_said_with_the_name() {
        for (message, start) in [
            (refused(|bytes| bytes[0] = b'X'), "w.blob: weight file: it begins with [58, 59"),
            (refused(|bytes| bytes[4] = 9), "w.blob: weight file: format version 9"),
            (refused(|bytes| bytes.truncate(70_001)), "w.blob: weight file: 70001 bytes"),
            (refused(Vec::clear), "w.blob: weight file: "),
            (refused(|bytes| bytes[90_000] ^= 1), "w.blob: weight file: checksum"),
        ] {
            assert!(message.starts_with(start), "{message}");
        }
    }

    #[test]
    fn an_unreadable_file_is_named() {
        let error = WeightFile::read(Path::new("no/such.blob")).unwrap_err();
        assert!(error.to_string().starts_with("no/such.blob: "), "{error}");
    }
}

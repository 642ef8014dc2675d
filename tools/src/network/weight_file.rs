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

    #[test]
    fn what_is_wrong_is_said_with_the_name() {
        let cut = WeightFile::new("w.blob", &GYRONET.0[..70_001]).blob().unwrap_err().to_string();
        assert!(cut.starts_with("w.blob: weight file: 70001 bytes"), "{cut}");
        let none = WeightFile::read(Path::new("no/such.blob")).unwrap_err().to_string();
        assert!(none.starts_with("no/such.blob: No such file"), "{none}");
    }
}

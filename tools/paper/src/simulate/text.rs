//! Writes rows of numbers fast, because a sequence has one and a half million rows.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

pub(super) struct Rows {
    file: BufWriter<File>,
    line: Vec<u8>,
}

impl Rows {
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self { file: BufWriter::with_capacity(1 << 16, File::create(path)?), line: Vec::new() })
    }

    pub fn int(&mut self, value: i64) -> &mut Self {
        self.field(itoa::Buffer::new().format(value).as_bytes())
    }

    /// Writes the shortest digits that read back as the same f32.
    pub fn single(&mut self, value: f64) -> &mut Self {
        // Adding zero makes -0 a 0.
        self.field(ryu::Buffer::new().format(value as f32 + 0.0).as_bytes())
    }

    pub fn singles(&mut self, values: impl IntoIterator<Item = f64>) -> &mut Self {
        for value in values {
            self.single(value);
        }
        self
    }

    /// Writes a value rounded to 1e-9.
    pub fn double(&mut self, value: f64) -> &mut Self {
        self.field(ryu::Buffer::new().format((value * 1e9).round() / 1e9 + 0.0).as_bytes())
    }

    pub fn doubles(&mut self, values: impl IntoIterator<Item = f64>) -> &mut Self {
        for value in values {
            self.double(value);
        }
        self
    }

    pub fn end(&mut self) -> io::Result<()> {
        self.line.push(b'\n');
        self.file.write_all(&self.line)?;
        self.line.clear();
        Ok(())
    }

    pub fn finish(mut self) -> io::Result<()> {
        self.file.flush()
    }

    fn field(&mut self, text: &[u8]) -> &mut Self {
        if !self.line.is_empty() {
            self.line.push(b',');
        }
        self.line.extend_from_slice(text);
        self
    }
}

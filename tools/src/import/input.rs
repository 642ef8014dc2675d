//! The bytes that every format is read from.

use std::io::{BufRead, Read};

/// Formats read from this.
pub type Input<'a> = dyn BufRead + 'a;

/// Reads `len` bytes, or as many as there are.
pub fn read_up_to(input: &mut Input<'_>, len: usize) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input.take(len as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads a line without its end (fields of spaces stay), of at most `most` bytes; what is beyond them is the next line.
pub fn read_line(input: &mut Input<'_>, most: u64) -> std::io::Result<Option<String>> {
    let mut bytes = Vec::new();
    if input.take(most).read_until(b'\n', &mut bytes)? == 0 {
        return Ok(None);
    }
    Ok(Some(String::from_utf8_lossy(&bytes).trim_end_matches(['\r', '\n']).to_owned()))
}

//! Buffered input, from which every format is read.

use std::io::{BufRead, Read};

/// The reader that the formats read from.
pub type Input<'a> = dyn BufRead + 'a;

/// Reads `len` bytes, or fewer at the end of the input.
pub fn read_up_to(input: &mut Input<'_>, len: usize) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input.take(len as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads a line of at most `most` bytes, without its line ending; the rest of a longer line is read as the next line.
/// White space at the end is kept, since it can be an empty field.
pub fn read_line(input: &mut Input<'_>, most: u64) -> std::io::Result<Option<String>> {
    let mut bytes = Vec::new();
    if input.take(most).read_until(b'\n', &mut bytes)? == 0 {
        return Ok(None);
    }
    Ok(Some(String::from_utf8_lossy(&bytes).trim_end_matches(['\r', '\n']).to_owned()))
}

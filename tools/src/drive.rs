//! Recorded drives. [`recording`] reads the rows of a file, [`stream`] whole drives, [`vehicle`] the
//! vehicle file beside one, and [`wheel_frames`] turns wheel speeds into CAN frames. [`replay`] runs the drive through
//! the board. [`track`] is its path. [`candump`] writes the frames that were sent, [`export`] tables and
//! paths.

pub mod candump;
pub mod error;
pub mod export;
pub(crate) mod foreign;
pub mod recording;
pub mod replay;
pub mod stream;
pub mod track;
pub mod vehicle;
pub mod wheel_frames;

use gyronet::sample::RATE_HZ;
use std::path::Path;

/// Sample period of the grid, s.
pub const DT: f64 = 1.0 / RATE_HZ as f64;

/// Returns a path as a word of a command in a shell.
pub fn word(path: &Path) -> String {
    let path = path.display().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+=:@%,".contains(letter);
    if path.chars().all(is_plain) { path } else { format!("'{}'", path.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_one_word_of_a_shell() {
        for path in ["drive 1.csv", "it's", "a$b", "plain/drive_1.csv"] {
            let echo = format!("printf %s {}", word(Path::new(path)));
            let said = std::process::Command::new("sh").args(["-c", &echo]).output().unwrap();
            assert_eq!(String::from_utf8_lossy(&said.stdout), path);
        }
    }
}

//! Keys that authorise writes to a board, and the signatures of what is written ([`gyronet::uds::signature`]).
//!
//! The private key stays in its file on this computer; the board stores the public key.

use crate::drive::error::{DataError, named, read_text};
use ed25519_dalek::{Signer, SigningKey};
use gyronet::uds::signature::{self, SEED, SERIAL, SIGNATURE, Statement, TRAILER};
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// First line of a private key file, and of a public one.
const PRIVATE: &str = "gyronet private key 1";
const PUBLIC: &str = "gyronet public key 1";

#[derive(Clone)]
pub struct PrivateKey(SigningKey);

impl PrivateKey {
    pub fn generate() -> Result<Self, DataError> {
        let mut secret = [0; 32];
        getrandom::fill(&mut secret)
            .map_err(|error| DataError::because("the system's random numbers", error))?;
        Ok(Self(SigningKey::from_bytes(&secret)))
    }

    pub fn read(path: &Path) -> Result<Self, DataError> {
        Ok(Self(SigningKey::from_bytes(&read(path, PRIVATE)?)))
    }

    /// Writes `NAME.key`, which only its owner can read, and `NAME.pub`. Neither file may exist.
    pub fn write(&self, name: &Path) -> Result<[PathBuf; 2], DataError> {
        let paths = ["key", "pub"].map(|end| {
            let mut path = name.as_os_str().to_owned();
            path.push(".");
            path.push(end);
            PathBuf::from(path)
        });
        let [private, public] = &paths;
        if let Some(path) = paths.iter().find(|path| path.exists()) {
            let reason = "it exists, and a key is never overwritten: give another name";
            return Err(DataError::because(path.display(), reason));
        }
        create(private, PRIVATE, &self.0.to_bytes())?;
        create(public, PUBLIC, &self.public())?;
        Ok(paths)
    }

    pub fn public(&self) -> [u8; 32] {
        self.0.verifying_key().to_bytes()
    }

    /// Returns the trailer that makes the board with this serial number, or any board, accept `content`.
    pub fn trailer(
        &self,
        target: u16,
        serial: Option<[u8; SERIAL]>,
        counter: u32,
        content: &[u8],
    ) -> [u8; TRAILER] {
        let statement = Statement { target, serial: serial.unwrap_or_default(), counter };
        let message = signature::message(&statement, &signature::digest(content));
        let mut trailer = [0; TRAILER];
        trailer[0] = u8::from(serial.is_none());
        trailer[1..5].copy_from_slice(&counter.to_be_bytes());
        trailer[5..].copy_from_slice(&self.0.sign(&message).to_bytes());
        trailer
    }

    pub fn answer(&self, serial: &[u8; SERIAL], seed: &[u8; SEED]) -> [u8; SIGNATURE] {
        self.0.sign(&signature::challenge(serial, seed)).to_bytes()
    }
}

pub fn read_public(path: &Path) -> Result<[u8; 32], DataError> {
    read(path, PUBLIC)
}

pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}

/// Parses 2 `N` hexadecimal digits as `N` bytes; `None` for any other text.
pub fn unhex<const N: usize>(text: &str) -> Option<[u8; N]> {
    let digits: Option<Vec<u8>> =
        text.trim().chars().map(|c| c.to_digit(16).map(|digit| digit as u8)).collect();
    let bytes: Vec<u8> =
        digits?.chunks(2).map(|pair| pair.iter().fold(0, |byte, digit| byte << 4 | digit)).collect();
    if text.trim().len() == 2 * N { bytes.try_into().ok() } else { None }
}

fn read(path: &Path, what: &'static str) -> Result<[u8; 32], DataError> {
    let key = read_text(path)?.strip_prefix(what).and_then(unhex);
    key.ok_or_else(|| DataError::because(path.display(), format!("not a {what}")))
}

fn create(path: &Path, what: &str, key: &[u8; 32]) -> Result<(), DataError> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    if what == PRIVATE {
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    }
    let written = options.open(path).and_then(|mut file| writeln!(file, "{what}\n{}", hex(key)));
    written.map_err(named(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_written_once_and_read_again() {
        let folder = tempfile::tempdir().expect("there is room");
        let name = folder.path().join("fleet");
        let key = PrivateKey::generate().expect("random numbers");
        let [private, public] = key.write(&name).expect("it is new");
        assert_eq!(PrivateKey::read(&private).expect("as written").public(), key.public());
        assert_eq!(read_public(&public).expect("as written"), key.public());
        assert!(key.write(&name).unwrap_err().to_string().contains("it exists"), "none is overwritten");
        let Err(error) = PrivateKey::read(&public) else { panic!("a public key is no private one") };
        assert!(error.to_string().ends_with("fleet.pub: not a gyronet private key 1"), "{error}");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::metadata(&private).expect("it is there").permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }
        assert_ne!(PrivateKey::generate().expect("random numbers").public(), key.public());
    }
}

//! What a test may want beyond Rust: it gets it, or it is skipped aloud, or it fails.
//!
//! `GYRONET_REQUIRE=qemu,data` makes tests that want these fail where they are missing; without
//! it they print `SKIPPED name: why` and pass. The line goes straight to the process's standard
//! error, which the test harness does not capture: a plain `cargo test` shows it.

use std::io::Write;
use std::process::Command;

/// Names what must be there, separated by commas.
pub const VARIABLE: &str = "GYRONET_REQUIRE";

/// Something that is not on every machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// qemu-system-arm and the target's standard library.
    Qemu,
    /// The recordings ([`crate::recordings`]).
    Data,
    /// A Python with the packages that a test names.
    Python,
}

impl Need {
    const ALL: [(&'static str, Self); 3] =
        [("qemu", Self::Qemu), ("data", Self::Data), ("python", Self::Python)];
}

/// What the environment insists on.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Required(Vec<Need>);

impl Required {
    /// Reads the list.
    ///
    /// # Errors
    /// The word that is no [`Need`]: a misspelt one would require nothing.
    pub fn parse(list: &str) -> Result<Self, String> {
        let words = list.split(',').map(str::trim).filter(|word| !word.is_empty());
        let need = |word: &str| {
            let known = Need::ALL.iter().find(|(name, _)| *name == word);
            known.map(|(_, need)| *need).ok_or_else(|| format!("{VARIABLE}: unknown word {word:?}"))
        };
        words.map(need).collect::<Result<_, _>>().map(Self)
    }

    fn from_env() -> Self {
        Self::parse(&std::env::var(VARIABLE).unwrap_or_default()).unwrap_or_else(|error| panic!("{error}"))
    }

    /// What was found, or `None` with a line on `out` that says which test is skipped and why.
    ///
    /// # Panics
    /// When it was not found and is required.
    pub fn wants<T>(
        &self,
        test: &str,
        need: Need,
        found: Result<T, String>,
        out: &mut impl Write,
    ) -> Option<T> {
        match found {
            Ok(found) => Some(found),
            Err(why) if self.0.contains(&need) => panic!("{test}: {VARIABLE} asks for {need:?}, but {why}"),
            Err(why) => {
                say(test, &why, out);
                None
            }
        }
    }
}

/// Says that a test is skipped on this machine, whatever is required.
pub fn skipped(test: &str, why: &str) {
    say(test, why, &mut std::io::stderr());
}

fn say(test: &str, why: &str, out: &mut impl Write) {
    // Nothing is left to report to when standard error is closed.
    let _ = out.write_all(format!("SKIPPED {test}: {why}\n").as_bytes());
}

/// [`Required::wants`] with the environment's list and standard error.
///
/// # Panics
/// When it was not found and is required, or the list has an unknown word.
pub fn wants<T>(test: &str, need: Need, found: Result<T, String>) -> Option<T> {
    Required::from_env().wants(test, need, found, &mut std::io::stderr())
}

/// The Python with these packages: `GYRONET_PYTHON`, or `python3`.
///
/// # Panics
/// As [`wants`].
#[must_use]
pub fn python(test: &str, packages: &[&str]) -> Option<String> {
    let python = std::env::var("GYRONET_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let packages = packages.join(", ");
    let check = Command::new(&python).args(["-c", &format!("import {packages}")]).output();
    let there = check.is_ok_and(|output| output.status.success());
    let found = there.then(|| python.clone()).ok_or_else(|| format!("{python} has not all of {packages}"));
    wants(test, Need::Python, found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists() {
        assert_eq!(Required::parse(""), Ok(Required(vec![])));
        assert_eq!(Required::parse("qemu, data,"), Ok(Required(vec![Need::Qemu, Need::Data])));
        assert_eq!(Required::parse("python"), Ok(Required(vec![Need::Python])));
        assert_eq!(Required::parse("qemu,dta"), Err("GYRONET_REQUIRE: unknown word \"dta\"".into()));
    }

    #[test]
    fn found_is_handed_on() {
        let mut out = Vec::new();
        assert_eq!(Required::default().wants("t", Need::Data, Ok(7), &mut out), Some(7));
        assert_eq!(out, b"");
    }

    #[test]
    fn not_found_is_said() {
        let (mut out, required) = (Vec::new(), Required::parse("qemu,python").unwrap());
        assert_eq!(required.wants("t", Need::Data, Err::<(), _>("no folder".into()), &mut out), None);
        assert_eq!(out, b"SKIPPED t: no folder\n");
    }

    #[test]
    #[should_panic(expected = "t: GYRONET_REQUIRE asks for Data, but no folder")]
    fn not_found_but_required() {
        let required = Required::parse("data").unwrap();
        required.wants("t", Need::Data, Err::<(), _>("no folder".into()), &mut Vec::new());
    }
}

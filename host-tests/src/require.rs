//! What a test needs beyond Rust: it gets that, or is reported as skipped, or fails.
//!
//! `GYRONET_REQUIRE=qemu,data` makes tests that need these fail where they are missing; without it they print
//! `SKIPPED name: why` and pass. The line goes straight to the process's standard error, which the test harness does
//! not capture: a plain `cargo test` shows it.

use std::io::Write;
use std::process::Command;

const VARIABLE: &str = "GYRONET_REQUIRE";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// The program qemu-system-arm and the target's standard library.
    Qemu,
    /// The recordings ([`crate::recordings`]).
    Data,
    /// A Python with the packages that a test names.
    Python,
    /// The C compiler arm-none-eabi-gcc.
    Gcc,
}

impl Need {
    const ALL: [(&'static str, Self); 4] =
        [("qemu", Self::Qemu), ("data", Self::Data), ("python", Self::Python), ("gcc", Self::Gcc)];
}

#[derive(Debug, PartialEq, Eq)]
struct Required(Vec<Need>);

impl Required {
    fn parse(list: &str) -> Result<Self, String> {
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

    /// What was found, or `None` with a line on `out` that names the skipped test and the reason.
    fn wants<T>(&self, test: &str, need: Need, found: Result<T, String>, out: &mut impl Write) -> Option<T> {
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

/// Reports that this test is skipped on this machine, whatever is required.
pub fn skipped(why: &str) {
    say(&running(), why, &mut std::io::stderr());
}

/// The name of the test that runs: the test harness gives its thread this name.
fn running() -> String {
    std::thread::current().name().unwrap_or("a test").to_owned()
}

fn say(test: &str, why: &str, out: &mut impl Write) {
    // Nothing is left to report to when standard error is closed.
    let _ = out.write_all(format!("SKIPPED {test}: {why}\n").as_bytes());
}

/// What was found, or `None` with a report on standard error that this test is skipped.
pub fn wants<T>(need: Need, found: Result<T, String>) -> Option<T> {
    Required::from_env().wants(&running(), need, found, &mut std::io::stderr())
}

/// A program that says its version.
pub fn program(need: Need, name: &str) -> Option<()> {
    let version = Command::new(name).arg("--version").output();
    wants(need, version.map(drop).map_err(|error| format!("{name}: {error}")))
}

/// QEMU, which runs the images of the kernels.
pub fn qemu() -> Option<()> {
    program(Need::Qemu, "qemu-system-arm")
}

/// The Python with these packages: `GYRONET_PYTHON`, or `python3`.
pub fn python(packages: &[&str]) -> Option<String> {
    wants(Need::Python, python_with(packages))
}

pub fn python_with(packages: &[&str]) -> Result<String, String> {
    let python = std::env::var("GYRONET_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let packages = packages.join(", ");
    let check = Command::new(&python).args(["-c", &format!("import {packages}")]).output();
    let there = check.is_ok_and(|output| output.status.success());
    there.then(|| python.clone()).ok_or_else(|| format!("{python} has not all of {packages}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_names_requirements_and_nothing_else() {
        assert_eq!(Required::parse(""), Ok(Required(vec![])));
        assert_eq!(Required::parse("qemu, data,"), Ok(Required(vec![Need::Qemu, Need::Data])));
        assert_eq!(Required::parse("python"), Ok(Required(vec![Need::Python])));
        assert_eq!(Required::parse("qemu,dta"), Err("GYRONET_REQUIRE: unknown word \"dta\"".into()));
    }

    #[test]
    fn what_was_found_is_returned_and_a_skipped_test_is_reported() {
        let (mut out, required) = (Vec::new(), Required::parse("qemu,python").unwrap());
        assert_eq!(required.wants("t", Need::Data, Ok(7), &mut out), Some(7));
        assert_eq!(required.wants("t", Need::Data, Err::<(), _>("no folder".into()), &mut out), None);
        assert_eq!(out, b"SKIPPED t: no folder\n");
    }

    #[test]
    #[should_panic(expected = "t: GYRONET_REQUIRE asks for Data, but no folder")]
    fn a_missing_requirement_fails_where_it_must_be_met() {
        let required = Required::parse("data").unwrap();
        required.wants("t", Need::Data, Err::<(), _>("no folder".into()), &mut Vec::new());
    }
}

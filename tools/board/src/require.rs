//! Requirements of a test beyond Rust. A test without them is reported as skipped, or fails.
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

fn parse(list: &str) -> Result<Vec<Need>, String> {
    let words = list.split(',').map(str::trim).filter(|word| !word.is_empty());
    let need = |word: &str| {
        let known = Need::ALL.iter().find(|(name, _)| *name == word);
        known.map(|(_, need)| *need).ok_or_else(|| format!("{VARIABLE}: unknown word {word:?}"))
    };
    words.map(need).collect()
}

/// The report of a test that lacks this, which must not be required.
fn lacking(required: &[Need], test: &str, need: Need, why: &str) -> String {
    assert!(!required.contains(&need), "{test}: {VARIABLE} asks for {need:?}, but {why}");
    report(test, why)
}

fn report(test: &str, why: &str) -> String {
    format!("SKIPPED {test}: {why}\n")
}

fn say(report: &str) {
    // Nothing is left to report to when standard error is closed.
    let _ = std::io::stderr().write_all(report.as_bytes());
}

/// The name of the test that runs: the test harness gives its thread this name.
fn running() -> String {
    std::thread::current().name().unwrap_or("a test").to_owned()
}

/// Reports that this test is skipped on this machine, whatever is required.
pub fn skipped(why: &str) {
    say(&report(&running(), why));
}

/// Returns the requirement, or `None` with a report on standard error that this test is skipped.
pub fn wants<T>(need: Need, found: Result<T, String>) -> Option<T> {
    let required = parse(&std::env::var(VARIABLE).unwrap_or_default());
    let required = required.unwrap_or_else(|error| panic!("{error}"));
    found.map_err(|why| say(&lacking(&required, &running(), need, &why))).ok()
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
        assert_eq!(parse(""), Ok(vec![]));
        assert_eq!(parse("qemu, data,"), Ok(vec![Need::Qemu, Need::Data]));
        assert_eq!(parse("python"), Ok(vec![Need::Python]));
        assert_eq!(parse("qemu,dta"), Err("GYRONET_REQUIRE: unknown word \"dta\"".into()));
    }

    #[test]
    #[should_panic(expected = "t: GYRONET_REQUIRE asks for Data, but no folder")]
    fn a_missing_requirement_fails_where_it_must_be_met() {
        lacking(&[Need::Data], "t", Need::Data, "no folder");
    }
}

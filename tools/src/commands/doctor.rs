//! `gyronet doctor` checks a recording.

use super::{Common, print_json, remark};
use gyronet_tools::doctor::{Doctor, Finding, Verdict};
use gyronet_tools::drive::vehicle::Vehicle;
use std::io::Write;
use std::path::PathBuf;

/// Check whether a recording is good enough to evaluate, calibrate and train on.
///
/// The input is a drive. The command prints its findings: sample rate and gaps, saturation, noise (random walk and bias
/// instability), standstills, mounting by gravity, forward direction by wheels and accelerometer, wheels against gyro,
/// and the reference. It also says what can and cannot be judged on the recording.
///
/// The exit status is 1 if a finding must be fixed before the recording is used.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet doctor drive.csv
  gyronet doctor drive.csv --json")]
pub struct Args {
    /// Recorded drive.
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let doctor = Doctor::examine(&args.file)?;
    if let Some(vehicle) = Vehicle::of_drive(&args.file)?.path {
        remark(common, format_args!("{}: vehicle file {}", args.file.display(), vehicle.display()))?;
    }
    let mut out = std::io::stdout().lock();
    if common.json {
        let findings = doctor.findings.iter().map(|Finding { what, verdict, text }| {
            serde_json::json!({ "subject": what, "verdict": verdict.word(), "text": text })
        });
        let json = serde_json::json!({
            "name": doctor.name,
            "seconds": doctor.seconds,
            "findings": findings.collect::<Vec<_>>(),
        });
        print_json(&mut out, &json)?;
    } else {
        writeln!(out, "{}: {:.0} s", doctor.name, doctor.seconds)?;
        for Finding { what, verdict, text } in &doctor.findings {
            writeln!(out, "{:<4} {what}: {text}", verdict.word())?;
        }
    }
    let bad = doctor.findings.iter().filter(|finding| finding.verdict == Verdict::Bad).count();
    let plural = if bad == 1 { "" } else { "s" };
    if bad > 0 { Err(format!("{bad} finding{plural} must be fixed first").into()) } else { Ok(()) }
}

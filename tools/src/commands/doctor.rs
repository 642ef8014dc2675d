//! `gyronet doctor` checks a recording and writes a page about it.

use super::calibrate::cut;
use super::weights::Sent;
use super::{Common, WriteError, print_json, read_drive};
use gyronet_tools::calibrate::{Share, calibrate};
use gyronet_tools::doctor::{Doctor, Finding, Verdict, page};
use gyronet_tools::drive::stream::Drive;
use gyronet_tools::evaluate::methods::Method;
use std::error::Error;
use std::io::Write;
use std::path::PathBuf;

/// Check whether a recording is good enough to evaluate, calibrate and train on.
///
/// The input is a drive. The command prints its findings and writes them to an HTML page with plots: sample rate and
/// gaps, saturation, noise (random walk and bias instability), standstills, mounting by gravity, forward direction by
/// wheels and accelerometer, wheels against gyro, and the reference. It also says what can and cannot be judged on
/// the recording, and what calibration and training could gain.
///
/// The exit status is 1 if a finding must be fixed before the recording is used.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet doctor drive.csv
  gyronet doctor drive.csv --out report.html --json")]
pub struct Args {
    /// Recorded drive.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Write the page to this file [default: the recording's name with .doctor.html].
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
    #[command(flatten)]
    sent: Sent,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let doctor = Doctor::examine(&args.file)?;
    let gains = gains(args, common);
    let path = args.out.clone().unwrap_or_else(|| args.file.with_extension("doctor.html"));
    std::fs::write(&path, page(&doctor, &gains)).map_err(WriteError::to(&path))?;
    let mut out = std::io::stdout().lock();
    if common.json {
        let findings = doctor.findings.iter().map(|Finding { what, verdict, text }| {
            serde_json::json!({ "subject": what, "verdict": verdict.word(), "text": text })
        });
        let gains = gains.iter().map(|(by, text)| serde_json::json!({ "by": by, "text": text }));
        let json = serde_json::json!({
            "name": doctor.name,
            "seconds": doctor.seconds,
            "findings": findings.collect::<Vec<_>>(),
            "gains": gains.collect::<Vec<_>>(),
            "page": path,
        });
        print_json(&mut out, &json)?;
    } else {
        writeln!(out, "{}: {:.0} s", doctor.name, doctor.seconds)?;
        for Finding { what, verdict, text } in &doctor.findings {
            writeln!(out, "{:<4} {what}: {text}", verdict.word())?;
        }
        for (by, text) in &gains {
            writeln!(out, "gain {by}: {text}")?;
        }
        writeln!(out, "page: {}", path.display())?;
    }
    let bad = doctor.findings.iter().filter(|finding| finding.verdict == Verdict::Bad).count();
    if bad > 0 { Err(format!("{bad} findings must be fixed first").into()) } else { Ok(()) }
}

/// Returns what calibration and training would gain on this drive, or why that is unknown.
fn gains(args: &Args, common: Common) -> Vec<(&'static str, String)> {
    let refused = |error: &dyn std::fmt::Display| {
        let reason = error.to_string();
        let reason = reason.strip_prefix(&format!("{}: ", args.file.display())).unwrap_or(&reason);
        format!("Unknown: {reason}.")
    };
    let drive = match read_drive(&args.file, common) {
        Ok(drive) => drive,
        Err(error) => return vec![("calibration and training", refused(&error))],
    };
    let calibration = unit(args, &drive, common).unwrap_or_else(|error| refused(&error));
    let training = trained(args, &drive).unwrap_or_else(|error| refused(&error));
    vec![("gyronet calibrate", calibration), ("training", training)]
}

/// Returns the shares of a unit's calibration, fitted to this drive alone.
fn unit(args: &Args, drive: &Drive<'_>, common: Common) -> Result<String, Box<dyn Error>> {
    let weights = args.sent.open()?;
    let blob = weights.blob()?;
    let unit = calibrate(&[cut(drive, blob, common)?], blob.crc)?;
    let shares = unit.shares.iter().map(|Share { name, value, sigma, refused }| match refused {
        None if value.abs() > 2.0 * sigma => {
            format!("{name} {value:+.4} (sigma {sigma:.4}): significant")
        }
        None => format!("{name} {value:+.4} (sigma {sigma:.4}): not significant"),
        Some(reason) => format!("{name}: {reason}"),
    });
    Ok(format!(
        "Shares of the roll rate, the pitch rate and the yaw rate itself (gain) in the yaw rate's error: {}.",
        shares.collect::<Vec<_>>().join("; ")
    ))
}

/// Returns the error of the sent rates with the weights in use, relative to static initialisation. Training must
/// lower this ratio.
fn trained(args: &Args, drive: &Drive<'_>) -> Result<String, Box<dyn Error>> {
    let errors = args.sent.errors(drive, None, |_| {}).map_err(|error| -> Box<dyn Error> { error })?;
    let figure = |method: Method| {
        let error = errors.methods[method].error;
        error.mean_1s_rad.or(error.rms_rad)
    };
    let named = if errors.methods[Method::STATIC].error.mean_1s_rad.is_some() {
        "Mean heading error after 1 s"
    } else {
        "RMS heading error over the drive"
    };
    let (Some(still), Some(updated), Some(sent), Some(linear)) = (
        figure(Method::STATIC),
        figure(Method::STATIC_ZERO_RATE),
        figure(Method::NAVIGATION),
        figure(Method::LINEAR),
    ) else {
        return Err("the drive has no figure that compares methods".into());
    };
    Ok(format!(
        "{named}: {still:.6} rad with static initialisation alone; {:.2} of that with zero-rate updates, {:.2} as sent with \
         the weights in use, {:.2} with the library's linear window. Training must lower these ratios. One drive does not \
         show by how much: that takes several drives of one vehicle, one of them held out.",
        updated / still,
        sent / still,
        linear / still
    ))
}

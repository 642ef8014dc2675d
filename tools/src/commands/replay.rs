//! `gyronet replay` runs a recording through the integer pipeline and writes its CAN log.

use super::weights::Weights;
use super::{Common, WriteError, print_json, progress, read_drive};
use gyronet::model::GyroNet;
use gyronet::pipeline::PipelineConfig;
use gyronet_tools::drive::recording::Recording;
use gyronet_tools::drive::replay::Replay;
use gyronet_tools::drive::wheel_frames::{Speeds, WheelFrames};
use gyronet_tools::drive::{export, foxglove};
use gyronet_tools::parts::compare::{Bound, Difference, STAND_INS};
use gyronet_tools::parts::{Part, Via};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Write the CAN messages that a board would send on a recorded drive.
///
/// The command runs the drive through the pipeline that is flashed. The log has the format of `candump -L` and the
/// recording's time stamps; can-utils' canplayer and python-can can play it. It is written to standard output, unless
/// --out names a file or --mcap, --csv or --tum is given. The summary is written to standard error; with --json it is
/// written to standard output if the log is not.
///
/// With --via the samples are first encoded as the part would send them, and parsed by the board's parser. The
/// summary then has the difference in corrected yaw from the direct replay, and the bound that follows from the
/// part's rounding. The exit status is 1 if the difference exceeds the bound.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet replay drive.csv --out can.log
  gyronet replay drive.csv | head
  gyronet replay drive.csv --out can.log --mcap drive.mcap    # and drive.layout.json, for Foxglove
  gyronet replay drive.csv --out can.log --csv rates.csv --tum path.tum
  gyronet replay drive.csv --via icm42688 --out can.log")]
pub struct Args {
    /// Recorded drive.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Write the log to this file [default: standard output].
    #[arg(long, value_name = "FILE.log")]
    out: Option<PathBuf>,
    /// Write inputs, rates, heading, states and frames to this file for Foxglove, and a layout beside it.
    #[arg(long, value_name = "FILE.mcap", conflicts_with = "via")]
    mcap: Option<PathBuf>,
    /// Write the rates, the yaw and its expected error to this table, one line per sample.
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Write the path computed from the wheels and the navigation yaw to this file, in the TUM format that evo reads.
    #[arg(long, value_name = "FILE.tum")]
    tum: Option<PathBuf>,
    /// Weight file [default: the library's default model].
    #[arg(long, value_name = "BLOB")]
    weights: Option<PathBuf>,
    /// Encode the samples as the bytes of this part, and parse them again.
    #[arg(long, value_name = "PART")]
    via: Option<Part>,
}

/// Runs the subcommand.
pub fn run(args: &Args, common: Common) -> super::Result {
    let weights = Weights::open(args.weights.as_deref())?;
    let mut network = GyroNet::new(weights.blob()?);
    let recording = read_drive(&args.file, common)?;
    let replays = if args.via.is_some() { 2 + STAND_INS as usize } else { 1 };
    let bar = progress::bar(common, replays * recording.rows.len(), recording.name());
    let replayed = replay(&recording, args.via, &mut network, || bar.inc(1));
    bar.finish_and_clear();
    let (drive, detour) = replayed?;
    let writes_elsewhere = [&args.mcap, &args.csv, &args.tum].into_iter().any(Option::is_some);
    let frames = match &args.out {
        None if writes_elsewhere => drive.frames().count() as u64,
        Some(path) => super::write_log(&drive, path)?,
        None => drive.log(BufWriter::new(io::stdout().lock()))?,
    };
    if let Some(path) = &args.mcap {
        write_mcap(&recording, &drive, path)?;
    }
    if let Some(path) = &args.csv {
        let error = WriteError::to(path);
        export::csv(&recording, &drive, BufWriter::new(File::create(path).map_err(&error)?))
            .map_err(&error)?;
    }
    if let Some(path) = &args.tum {
        let speeds = Speeds::new(&recording)
            .ok_or_else(|| format!("{}: --tum needs wheels, since a path needs a speed", recording.path))?;
        let error = WriteError::to(path);
        export::tum(&drive, &speeds, BufWriter::new(File::create(path).map_err(&error)?)).map_err(&error)?;
    }
    if common.json {
        let summary = serde_json::json!({
            "recording": recording.path,
            "seconds": recording.seconds(),
            "frames": frames,
            "status": drive.status_counts().map(|(status, count)| (format!("{status:?}").to_lowercase(), count)).into_iter().collect::<BTreeMap<_, _>>(),
            "events": events(&drive).into_iter().collect::<BTreeMap<_, _>>(),
            "via": detour.as_ref().map(Detour::json),
        });
        if args.out.is_some() || writes_elsewhere {
            print_json(&mut io::stdout().lock(), &summary)?;
        } else {
            print_json(&mut io::stderr().lock(), &summary)?;
        }
    } else if !common.quiet {
        let mut err = io::stderr().lock();
        writeln!(err, "{}: {frames} frames in {:.2} s", recording.path, recording.seconds())?;
        let statuses =
            drive.status_counts().map(|(status, count)| format!("{status:?} {count}").to_lowercase());
        writeln!(err, "status: {}", statuses.join(", "))?;
        let events: Vec<String> =
            events(&drive).iter().map(|(name, count)| format!("{name} {count}")).collect();
        writeln!(err, "events: {}", events.join(", "))?;
        if let Some(detour) = &detour {
            write!(err, "{detour}")?;
        }
    }
    match detour {
        Some(detour) if !detour.bound.holds(&detour.difference) => {
            Err(format!("the {} changes the yaw by more than its rounding explains", detour.part).into())
        }
        _ => Ok(()),
    }
}

/// Replays the drive, through a part's bytes if one is named, and compares that with the direct replay.
fn replay(
    recording: &Recording,
    part: Option<Part>,
    network: &mut GyroNet<'_>,
    mut tick: impl FnMut(),
) -> Result<(Replay, Option<Detour>), Box<dyn std::error::Error>> {
    let config = PipelineConfig::DEFAULT;
    let direct = Replay::run(recording, &config, WheelFrames::new(recording), network, &mut tick)?;
    let Some(part) = part else { return Ok((direct, None)) };
    let via = part.send(recording)?;
    let drive = Replay::run(&via.recording, &config, WheelFrames::new(recording), network, &mut tick)?;
    let bound = Bound::new(via.quantisation, recording, &direct, network, &mut tick)?;
    let difference = Difference::of_rates(&direct, &drive);
    Ok((drive, Some(Detour { part, via, difference, bound })))
}

/// A replay through a part's bytes, its difference from the direct replay, and the bound of that difference.
struct Detour {
    part: Part,
    via: Via,
    difference: Difference,
    bound: Bound,
}

impl Detour {
    fn json(&self) -> serde_json::Value {
        let Self { part, via, difference, bound } = self;
        serde_json::json!({
            "part": part.to_string(),
            "samples": via.recording.rows.len(),
            "bytes": via.bytes,
            "rate_step_rad_per_s": via.quantisation.rate,
            "force_step_m_per_s2": via.quantisation.force,
            "yaw_largest_rad": difference.yaw_largest,
            "yaw_final_rad": difference.yaw_final,
            "yaw_bound_rad": bound.yaw(),
            "rate_rms_rad_per_s": difference.rate_rms,
            "rate_rms_bound_rad_per_s": bound.rate_rms,
            "rows": difference.rows,
            "unpaired": difference.unpaired,
        })
    }
}

impl std::fmt::Display for Detour {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { part, via, difference, bound } = self;
        let rows = via.recording.rows.len();
        writeln!(f, "via {part}: {rows} samples in {} bytes", via.bytes)?;
        let step = |value: f64, unit: &str| {
            if value > 0.0 { format!("{value:.3e} {unit}") } else { "none".to_owned() }
        };
        let (rate, force) = (via.quantisation.rate, via.quantisation.force);
        writeln!(f, "rounding: rate {}, acceleration {}", step(rate, "rad/s"), step(force, "m/s^2"))?;
        writeln!(
            f,
            "yaw against the direct replay: at most {:.3e} rad, at the end {:.3e} rad; bound {:.3e} rad = \
             rounding {:.1e} + static bias {:.1e} + network {:.1e}",
            difference.yaw_largest,
            difference.yaw_final,
            bound.yaw(),
            bound.rounding,
            bound.bias,
            bound.network,
        )?;
        writeln!(
            f,
            "yaw rate: rms {:.3e} rad/s; bound {:.3e} rad/s; {} rows compared, {} not in both",
            difference.rate_rms, bound.rate_rms, difference.rows, difference.unpaired
        )
    }
}

/// Writes a drive and its layout for Foxglove.
fn write_mcap(recording: &Recording, drive: &Replay, path: &Path) -> super::Result {
    let error = WriteError::to(path);
    let file = BufWriter::new(File::create(path).map_err(&error)?);
    foxglove::write(recording, drive, file).map_err(|cause| error(io::Error::other(cause)))?;
    let layout = path.with_extension("layout.json");
    Ok(std::fs::write(&layout, foxglove::LAYOUT).map_err(WriteError::to(&layout))?)
}

/// Returns all counters that are not zero.
fn events(drive: &Replay) -> Vec<(&'static str, u32)> {
    let c = &drive.counters;
    let all = [
        ("samples", c.samples),
        ("windows", c.windows),
        ("missing", c.missing),
        ("misplaced", c.misplaced),
        ("clock jumps", c.clock_jumps),
        ("invalid", c.invalid),
        ("moving", c.moving),
        ("clamped inputs", c.clamped_inputs),
        ("implausible", c.implausible),
        ("late", c.late),
        ("mounting found to be another unit's", c.foreign_mountings),
        ("out of range", drive.out_of_range),
    ];
    all.into_iter().filter(|(_, count)| *count > 0).collect()
}

//! Time and memory of `gyronet evaluate` and `gyronet replay` on long drives: 15 minutes, an hour and a day.
//!
//! `cargo bench --profile tool -p gyronet-tools --bench long_drive`, with the lengths in seconds after `--`
//! (`-- 900 3600`) for others. The drives repeat ten minutes of a simulated one, with time stamps that go on and one
//! standstill at the start, in a folder that is removed afterwards; a day takes 1 GB of it.
//!
//! The peak of the resident memory is that of the kernel (VmHWM in /proc), the processor's time that of all threads.

use gyronet_tools::bundled::DEMO_SECONDS;
use gyronet_tools::simulate::{Config, csv};
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// 15 minutes, an hour, a day.
const LENGTHS_S: [u64; 3] = [900, 3_600, 86_400];
/// Ticks of the processor's time in /proc, 1/s.
const TICKS: f64 = 100.0;

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<u64> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let lengths = if given.is_empty() { LENGTHS_S.to_vec() } else { given };
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR"))?;
    let (drive, log) = (folder.path().join("drive.csv"), folder.path().join("can.log"));
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{:<10}{:>12}{:>12}{:>14}{:>12}",
        "command", "drive, s", "wall, s", "processor, s", "peak, MB"
    )?;
    for seconds in lengths {
        write_drive(&drive, seconds)?;
        for name in ["evaluate", "replay"] {
            let mut command = Command::new(env!("CARGO_BIN_EXE_gyronet"));
            command.args([name, "--quiet", "--json"]).arg(&drive);
            if name == "replay" {
                // A day's log is 2 GB.
                command.arg("--out").arg(if seconds > 4_000 { Path::new("/dev/null") } else { &log });
            }
            let Cost { wall, processor, peak_kb } = run(&mut command)?;
            writeln!(
                out,
                "{name:<10}{seconds:>12}{:>12.1}{processor:>14.1}{:>12.1}",
                wall.as_secs_f64(),
                peak_kb as f64 / 1_000.0
            )?;
        }
    }
    Ok(())
}

/// Writes a drive of this length.
fn write_drive(path: &Path, seconds: u64) -> Result<(), Box<dyn Error>> {
    let mut text = Vec::new();
    csv::write(&Config { seconds: DEMO_SECONDS, ..Config::DEFAULT }, &mut text)?;
    let text = String::from_utf8(text)?;
    let (header, rows) = text.split_once('\n').ok_or("no header")?;
    let rest: Vec<&str> = rows.lines().filter_map(|row| Some(row.split_once(',')?.1)).collect();
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "{header}")?;
    for k in 0..seconds * 100 {
        writeln!(file, "{}.{:02},{}", k / 100, k % 100, rest[k as usize % rest.len()])?;
    }
    Ok(file.flush()?)
}

/// The time and memory that a command took.
struct Cost {
    wall: Duration,
    processor: f64,
    peak_kb: u64,
}

fn run(command: &mut Command) -> Result<Cost, Box<dyn Error>> {
    let began = Instant::now();
    let mut child = command.stdout(Stdio::null()).spawn()?;
    let (mut processor, mut peak_kb) = (0.0, 0);
    loop {
        let ended = child.try_wait()?;
        // The newest values before the end: both only grow.
        peak_kb = peak(child.id()).unwrap_or(peak_kb);
        processor = ticks(child.id()).map_or(processor, |ticks| ticks / TICKS);
        if let Some(status) = ended {
            let wall = began.elapsed();
            return if status.success() {
                Ok(Cost { wall, processor, peak_kb })
            } else {
                Err("it failed".into())
            };
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The peak of a process's resident memory, KB.
fn peak(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The processor's time of a process, user and system.
fn ticks(process: u32) -> Option<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name in brackets may hold spaces.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<f64>().ok();
    Some(next()? + next()?)
}

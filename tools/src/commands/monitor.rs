//! `gyronet monitor` shows the CAN messages as a receiver sees them.

use super::Common;
use console::Term;
use gyronet::can::config::Config;
use gyronet_tools::client::monitor::Monitor;
use gyronet_tools::client::monitor::source::{Lines, Source};
use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two redraws on a terminal, and between two lines elsewhere.
const REDRAW: Duration = Duration::from_millis(100);
const LINE: Duration = Duration::from_secs(1);
/// Timeout of --once.
const ONCE: Duration = Duration::from_secs(10);

/// Show the CAN messages of a board as a receiver sees them.
///
/// The input is an SLCAN line or a candump log. The command checks the messages as an ECU would. It shows yaw rate,
/// yaw, source, quality, faults, and the numbers of lost, repeated and damaged messages. On a terminal it draws a
/// live view; elsewhere, and with --json, it prints one line each second. A log is read to its end and then
/// summarised. Ctrl-C ends with the summary and exit status 0. The exit status is 1 if a log has no CAN frame, or if
/// --once finds no messages.
///
/// The messages of a fibre-optic gyro are a second block, and `fog` in JSON. Identifiers and E2E protection are those of the default configuration. Times are the input's own time stamps if it
/// has any; otherwise they count from the start.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet monitor /dev/ttyUSB0
  gyronet monitor localhost:3000 --for 60 --json
  gyronet monitor can.log --json")]
pub struct Args {
    /// Serial port with SLCAN (/dev/ttyUSB0, COM3), TCP socket with SLCAN (host:port), or a
    /// candump log.
    #[arg(value_name = "PORT|HOST:PORT|FILE")]
    source: String,
    /// Baud rate of a serial port.
    #[arg(long, value_name = "BIT/S", default_value_t = 921_600)]
    baud: u32,
    /// Show the first complete set of messages and end; fail if none arrives within 10 s.
    #[arg(long)]
    once: bool,
    /// End after this many seconds.
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds, conflicts_with = "once")]
    duration: Option<Duration>,
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|error| format!("{error}"))?;
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}

#[derive(Debug, thiserror::Error)]
enum MonitorError {
    #[error("{0}: no complete set of messages (rate, angle, detail)")]
    Nothing(String),
    #[error("{0}: no CAN frame in it; a candump log has lines such as (1.000000) can0 174#0080004B008000D1")]
    NoLog(String),
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let config = Config::DEFAULT;
    let mut source = Source::open(&args.source, args.baud, config.settings().bits_per_second)?;
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))?;

    let mut monitor = Monitor::new(&config);
    let mut view = View::new(source.is_log() || common.quiet, common.json);
    let start = Instant::now();
    let limit = if args.once { Some(ONCE) } else { args.duration };
    let mut sets = 0_u64;
    while !interrupted.load(Ordering::Relaxed) && limit.is_none_or(|limit| start.elapsed() < limit) {
        let Lines::Some(lines) = source.read()? else { break };
        let elapsed = start.elapsed().as_secs_f64();
        for line in &lines {
            if monitor.take_line(line, elapsed).is_some() {
                sets += 1;
                if args.once {
                    break;
                }
            }
        }
        if args.once && sets > 0 {
            break;
        }
        view.show(&monitor, monitor.stamp().unwrap_or(elapsed))?;
    }
    let counts = monitor.counts;
    if source.is_log() && counts.frames + counts.foreign == 0 {
        return Err(MonitorError::NoLog(args.source.clone()).into());
    }
    if args.once && sets == 0 {
        return Err(MonitorError::Nothing(args.source.clone()).into());
    }
    // A log is read faster than it was recorded, so use its own time stamps.
    let time = monitor.stamp().unwrap_or_else(|| start.elapsed().as_secs_f64());
    view.finish(&monitor, time)?;
    Ok(())
}

/// The display while frames arrive, and the summary at the end.
struct View {
    term: Option<Term>,
    silent: bool,
    json: bool,
    drawn: usize,
    last: Instant,
}

impl View {
    /// Creates the display. A silent one prints only the summary: a log is read too fast to watch.
    fn new(silent: bool, json: bool) -> Self {
        let term = Term::stdout();
        let live = term.is_term() && !json;
        Self { term: live.then_some(term), silent, json, drawn: 0, last: Instant::now() }
    }

    fn show(&mut self, monitor: &Monitor, time: f64) -> io::Result<()> {
        let period = if self.term.is_some() { REDRAW } else { LINE };
        if self.silent || self.last.elapsed() < period {
            return Ok(());
        }
        self.last = Instant::now();
        match &self.term {
            Some(term) => {
                // One write avoids flicker. Lines are cut to the terminal's width, because wrapped lines would make
                // the line count wrong.
                let width = usize::from(term.size().1);
                let picture = monitor.to_string();
                let lines: Vec<String> = picture.lines().map(|l| l.chars().take(width).collect()).collect();
                term.clear_last_lines(self.drawn)?;
                self.drawn = lines.len();
                term.write_line(&lines.join("\n"))
            }
            None if self.json => writeln!(io::stdout().lock(), "{}", monitor.json(time)),
            None => writeln!(io::stdout().lock(), "{}", monitor.line(time)),
        }
    }

    fn finish(self, monitor: &Monitor, time: f64) -> io::Result<()> {
        if self.json {
            return writeln!(io::stdout().lock(), "{}", monitor.json(time));
        }
        if let Some(term) = &self.term {
            term.clear_last_lines(self.drawn)?;
        }
        write!(io::stdout().lock(), "{monitor}")
    }
}

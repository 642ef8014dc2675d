//! What every task and interrupt of the flashed image costs, counted while it runs in the
//! emulator: one sample after the other goes in, with wheel speeds, questions on the service
//! line and a host's commands beside it.

use crate::simulate::{Config, Sample, Simulation};
use crate::target_bench::{BenchError, MACHINE, field};
use gyronet::sensor::dsp1760::message::{Extra, Message, Validity};
use gyronet::sensor::xsens::MtData2;
use gyronet::service::frame::{Deframer, emit};
use gyronet::service::message::AllCounters;
use gyronet::service::{Reply, Request};
use object::{Object, ObjectSection, ObjectSymbol};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Samples: static initialisation, and forty windows.
const SAMPLES: usize = 500;
/// How long the emulator may take to connect and the image to answer.
const START: Duration = Duration::from_secs(60);
/// How long a sample may take, and how often it is asked whether it was processed.
const TURN: Duration = Duration::from_secs(10);
const ASK: Duration = Duration::from_millis(20);
/// Windows of the network that must have run, or nothing is known of it.
const WINDOWS: usize = 20;
/// 8 ns for an instruction: the board's clock and its instructions stay in step as they do at
/// about 125 million instructions a second.
const ICOUNT: &str = "shift=3";
/// The function that a turn of the output task runs for each sample.
const WATCHED: &str = "output::Output::process";
/// Messages of the fibre-optic gyro in a sample.
const GYRO_MESSAGES: usize = 10;
/// The line that it comes on, where the image has it.
const GYRO_LINE: &str = "USART3";
/// Where an image says which vector has which priority.
const PRIORITIES: &str = ".priorities";
/// Exception numbers of the handlers (RM0090, table 62), and the data register that a serial line's
/// handler reads and writes (RM0090, table 1 and 30.6.2).
const VECTORS: [(u8, &str, u32); 8] = [
    (15, "SysTick", 0),
    (16 + 20, "CAN1_RX0", 0),
    (16 + 37, "USART1", 0x4001_1004),
    (16 + 38, "USART2", 0x4000_4404),
    (16 + 39, GYRO_LINE, 0x4000_4804),
    (16 + 52, "UART4", 0),
    (16 + 53, "UART5", 0),
    (16 + 71, "USART6", 0x4001_1404),
];
/// Kinds of activations of a handler: by how many bytes it has moved, or samples processed; the last
/// one is as many or more.
pub const KINDS: usize = 5;

/// Everything that was counted of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tasks {
    /// Its handlers.
    pub handlers: Vec<Handler>,
    /// Modelled cycles for which all interrupts were off, at worst.
    pub all_off: u64,
    /// Modelled cycles for which idle kept the output task out, at worst.
    pub some_off: u64,
}

/// One interrupt handler of the image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Handler {
    /// As the vector table names it.
    pub name: String,
    /// The larger the more urgent.
    pub priority: u8,
    /// Of each kind, the worst.
    pub activations: [Option<Activation>; KINDS],
    /// Modelled cycles of the cheapest activation.
    pub least: u64,
    /// Halfwords of its code, what it calls left out.
    pub code: u64,
}

/// The worst of the activations of a handler, preemption left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Activation {
    /// How many there were.
    pub runs: u64,
    /// Instructions of the longest one.
    pub instructions: u64,
    /// Modelled cycles of the most expensive one.
    pub cycles: u64,
}

impl std::fmt::Display for Handler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "task/{} priority={}", self.name, self.priority)?;
        if self.least == 0 {
            write!(f, " runs=0")?;
        }
        for (kind, activation) in self.activations.iter().enumerate() {
            if let Some(Activation { runs, instructions, cycles }) = activation {
                let more = if kind == KINDS - 1 { "+" } else { "" };
                write!(f, " [{kind}{more}: runs={runs} instructions={instructions} cycles={cycles}]")?;
            }
        }
        if self.least > 0 {
            write!(f, " least={}", self.least)?;
        }
        Ok(())
    }
}

impl std::fmt::Display for Tasks {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.handlers.iter().try_for_each(|handler| writeln!(f, "{handler}"))?;
        write!(
            f,
            "interrupts off: cycles={}; output kept out by idle: cycles={}",
            self.all_off, self.some_off
        )
    }
}

/// Where functions of an image lie.
struct Symbols {
    handlers: Vec<(Handler, String)>,
    watched: u32,
}

impl Symbols {
    fn read(image: &Path) -> Result<Self, BenchError> {
        let bad = |what: String| BenchError::Line(format!("{}: {what}", image.display()));
        let bytes = std::fs::read(image).map_err(|error| bad(error.to_string()))?;
        let elf = object::File::parse(&*bytes).map_err(|error| bad(error.to_string()))?;
        let symbol = |name: &str| elf.symbols().find(|symbol| symbol.name().is_ok_and(|n| n == name));
        let section = elf.section_by_name(PRIORITIES).ok_or_else(|| bad("no priorities".to_owned()))?;
        let priorities = section.data().map_err(|error| bad(error.to_string()))?;
        let mut handlers = Vec::new();
        for [vector, priority] in priorities.as_chunks::<2>().0 {
            let known = VECTORS.iter().find(|(number, ..)| number == vector);
            let (_, name, data) = known.ok_or_else(|| bad(format!("vector {vector} has no name here")))?;
            let symbol = symbol(name).ok_or_else(|| bad(format!("no handler {name}")))?;
            let (start, len) = (symbol.address() as u32 & !1, symbol.size() as u32);
            // What `#[interrupt]` marks is a function of its own, where it is not inlined.
            let marked = format!("__cortex_m_rt_{name}");
            let is_body = |symbol: &object::Symbol<'_, '_>| symbol.name().is_ok_and(|n| n.contains(&marked));
            let body: u64 = elf.symbols().filter(is_body).map(|symbol| symbol.size()).sum();
            let handler = Handler {
                name: (*name).to_owned(),
                priority: *priority,
                activations: [None; KINDS],
                least: 0,
                code: (u64::from(len) + body) / 2,
            };
            handlers.push((handler, format!(",handler={name}:{start:x}:{:x}:{data:x}", start + len)));
        }
        let named = |name: &str| rustc_demangle(name).contains(WATCHED);
        let watched = elf.symbols().find(|symbol| symbol.name().is_ok_and(named));
        let watched = watched.ok_or_else(|| bad(format!("no {WATCHED}")))?.address() as u32 & !1;
        Ok(Self { handlers, watched })
    }
}

/// The path in a mangled name, as far as it is needed here: v0 and legacy both hold its parts as
/// length and text.
fn rustc_demangle(mangled: &str) -> String {
    let mut parts = Vec::new();
    let mut rest = mangled;
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        rest = &rest[at..];
        let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
        let (len, behind) = rest.split_at(end);
        let Some(part) = len.parse().ok().and_then(|len: usize| behind.get(..len)) else { break };
        parts.push(part);
        rest = &behind[part.len()..];
    }
    parts.join("::")
}

/// Runs the image with the plugin; all of its handlers.
///
/// # Errors
/// [`BenchError`], also when the image does not answer.
pub fn measure(image: &Path, plugin: &Path) -> Result<Tasks, BenchError> {
    let Symbols { handlers, watched } = Symbols::read(image)?;
    let mut options = format!("{},watch={watched:x}", plugin.display());
    handlers.iter().for_each(|(_, option)| options += option);
    let (mut all_off, mut some_off) = (0, 0);
    let mut found: Vec<Handler> = handlers.into_iter().map(|(handler, _)| handler).collect();
    let has_gyro = found.iter().any(|handler| handler.name == GYRO_LINE);
    let printed = Emulator::start(image, &options, has_gyro)?.drive()?;
    for line in printed.lines() {
        let (what, rest) = line.split_once(' ').unwrap_or_default();
        let number = |key| field(line, key).ok_or_else(|| BenchError::Line(line.to_owned()));
        if what == "LOCKED" {
            (all_off, some_off) = (number("all=")?, number("some=")?);
        }
        let name = rest.split(' ').next().unwrap_or_default();
        let Some(handler) = found.iter_mut().find(|handler| handler.name == name) else { continue };
        if what == "HANDLER" {
            handler.least = number("least=")?;
        } else if let Some(activation) = handler.activations.get_mut(number("seen=")? as usize) {
            let (runs, instructions, cycles) = (number("runs=")?, number("insns=")?, number("cycles=")?);
            *activation = Some(Activation { runs, instructions, cycles });
        }
    }
    Ok(Tasks { handlers: found, all_off, some_off })
}

/// Samples and windows, once it has answered.
#[derive(Default)]
struct Seen {
    answers: AtomicUsize,
    samples: AtomicUsize,
    windows: AtomicUsize,
}

struct Emulator {
    process: std::process::Child,
    imu: TcpStream,
    slcan: TcpStream,
    gyro: Option<TcpStream>,
    service: TcpStream,
    /// What the image has said last of its pipeline.
    seen: Arc<Seen>,
}

impl Emulator {
    fn start(image: &Path, plugin: &str, has_gyro: bool) -> Result<Self, BenchError> {
        let program = "qemu-system-arm";
        let start = |source| BenchError::Start { program: program.to_owned(), source };
        let [imu, slcan, gyro, service] = [(); 4].map(|()| TcpListener::bind("127.0.0.1:0").map_err(start));
        let (imu, slcan, gyro, service) = (imu?, slcan?, gyro?, service?);
        let address =
            |line: &TcpListener| line.local_addr().map(|address| format!("tcp:{address},nodelay=on"));
        let [first, second, third, sixth] =
            [&imu, &slcan, &gyro, &service].map(|line| address(line).map_err(start));
        let third = if has_gyro { third? } else { "null".to_owned() };
        let mut qemu = Command::new(program);
        qemu.args(["-machine", MACHINE, "-display", "none", "-monitor", "stdio", "-icount", ICOUNT]);
        qemu.args(["-serial", &first?, "-serial", &second?, "-serial", &third]);
        qemu.args(["-serial", "null", "-serial", "null"]);
        qemu.args(["-serial", &sixth?, "-plugin", plugin, "-kernel"]).arg(image);
        let piped = qemu.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut process = piped.spawn().map_err(start)?;
        let mut accept = |line: TcpListener| {
            line.set_nonblocking(true)?;
            let until = Instant::now() + START;
            loop {
                match line.accept() {
                    Ok((stream, _)) => return stream.set_nonblocking(false).map(|()| stream),
                    Err(error) if Instant::now() > until || process.try_wait()?.is_some() => {
                        return Err(error);
                    }
                    Err(_) => thread::sleep(Duration::from_millis(5)),
                }
            }
        };
        let gyro = if has_gyro { accept(gyro).map(Some) } else { Ok(None) };
        let connected = (accept(imu), accept(slcan), gyro, accept(service));
        let (Ok(imu), Ok(slcan), Ok(gyro), Ok(service)) = connected else {
            let _ = process.kill();
            let output = process.wait_with_output().map_err(start)?;
            let output = String::from_utf8_lossy(&output.stderr).into_owned();
            return Err(BenchError::Failed { program: program.to_owned(), output });
        };
        for line in [&imu, &slcan].into_iter().chain(&gyro) {
            read(line, |_| {}).map_err(start)?;
        }
        let seen = Arc::new(Seen::default());
        let (told, mut deframer) = (Arc::clone(&seen), Deframer::new());
        read(&service, move |byte| {
            let Some(Ok((_, reply))) = deframer.push::<Reply>(byte) else { return };
            told.answers.fetch_add(1, Ordering::Relaxed);
            if let Reply::Counters(AllCounters { pipeline, .. }) = reply {
                told.samples.store(pipeline.samples as usize, Ordering::Relaxed);
                told.windows.store(pipeline.windows as usize, Ordering::Relaxed);
            }
        })
        .map_err(start)?;
        Ok(Self { process, imu, slcan, gyro, service, seen })
    }

    /// Sends everything and ends; what the plugin has printed.
    fn drive(mut self) -> Result<String, BenchError> {
        let driven = self.talk();
        // Asked to, the emulator ends in order, and the plugin prints; else it is ended.
        let asked = self.process.stdin.take().is_some_and(|mut monitor| monitor.write_all(b"quit\n").is_ok());
        if !asked {
            let _ = self.process.kill();
        }
        let failed = |output| BenchError::Failed { program: "the emulated image".to_owned(), output };
        let output = self.process.wait_with_output().map_err(|error| failed(error.to_string()))?;
        driven.map_err(|error| failed(error.to_string()))?;
        Ok(String::from_utf8_lossy(&output.stderr).into_owned())
    }

    fn talk(&mut self) -> std::io::Result<()> {
        let failed = |what: String| Err(std::io::Error::other(what));
        let others = [Request::Info, Request::GetConfiguration, Request::Log { after: 0 }];
        let [info, configuration, log] = others.map(|request| emit(1, &request).unwrap_or_default());
        let counters = emit(1, &Request::Counters).unwrap_or_default();
        let until = Instant::now() + START;
        while self.seen.answers.load(Ordering::Relaxed) == 0 {
            if Instant::now() > until {
                return failed("no answer on the service line".to_owned());
            }
            self.service.write_all(&info)?;
            thread::sleep(Duration::from_millis(200));
        }
        for (k, sample) in Simulation::new(&Config::DEFAULT).take(SAMPLES).enumerate() {
            // Standing, as Toyota's frame has it, and now and then what a host asks.
            self.slcan.write_all(b"t0AA81A6F1A6F1A6F1A6F\r")?;
            if k % 50 == 0 {
                self.slcan.write_all(b"V\rN\rF\r")?;
            }
            if let Some(gyro) = &mut self.gyro {
                for number in GYRO_MESSAGES * k..GYRO_MESSAGES * (k + 1) {
                    gyro.write_all(&increment(number, &sample).emit())?;
                }
            }
            self.imu.write_all(&message(k, &sample).emit())?;
            self.service.write_all([&info, &configuration, &log][k % 3])?;
            // One by one, however slow the host is.
            let until = Instant::now() + TURN;
            while self.seen.samples.load(Ordering::Relaxed) <= k {
                if Instant::now() > until {
                    return failed(format!("sample {k} of {SAMPLES} was not processed"));
                }
                let again = Instant::now() + ASK;
                self.service.write_all(&counters)?;
                while self.seen.samples.load(Ordering::Relaxed) <= k && Instant::now() < again {
                    thread::sleep(Duration::from_micros(200));
                }
            }
        }
        let windows = self.seen.windows.load(Ordering::Relaxed);
        if windows < WINDOWS { failed(format!("only {windows} windows were used")) } else { Ok(()) }
    }
}

fn message(k: usize, sample: &Sample) -> MtData2 {
    MtData2 {
        packet_counter: Some(k as u16),
        sample_time_fine: Some(100 * k as u32),
        acceleration: Some(sample.specific_force.map(|force| force as f32)),
        rate_of_turn: Some(sample.angular_rate.map(|rate| rate as f32)),
        temperature: Some(25.0),
        status: Some(3),
    }
}

fn increment(number: usize, sample: &Sample) -> Message {
    Message {
        rotation: sample.reference.map(|rate| (rate * 1e-3) as f32),
        acceleration: [0.0, 0.0, 1.0],
        extra: Extra::Temperature(25),
        validity: Validity::GYRO,
        sequence: (number % 128) as u8,
    }
}

/// Reads a line to its end in a thread.
fn read(line: &TcpStream, mut take: impl FnMut(u8) + Send + 'static) -> std::io::Result<()> {
    let mut line = line.try_clone()?;
    thread::spawn(move || {
        let mut bytes = [0; 4096];
        while let Ok(len @ 1..) = line.read(&mut bytes) {
            bytes[..len].iter().for_each(|byte| take(*byte));
        }
    });
    Ok(())
}

//! The product on the virtual board, in a vehicle that drives: its lines are sockets, so that the commands of a real
//! board can be tried without one.
//!
//! An MTi sends the samples of a drive on USART1, and the vehicle's bus has its wheel speeds and courses. The drive begins
//! again at its end. The bus is a socket, too: an SLCAN adapter on it.

use crate::board::{self, Board, Seen};
use crate::{require, wire};
use clap::Parser;
use gyronet::can::DataFrame;
use gyronet::can::slcan::port::Port;
use gyronet::sample::ImuSample;
use gyronet::sensor::xsens::MtData2;
use gyronet::units::Micros;
use gyronet_tools::bundled;
use gyronet_tools::drive::DT;
use gyronet_tools::drive::candump::Log;
use gyronet_tools::drive::error::named;
use gyronet_tools::drive::recording::Row;
use gyronet_tools::drive::stream::Recording;
use gyronet_tools::drive::wheel_frames::WheelFrames;
use std::error::Error;
use std::fs::File;
use std::io::{self, ErrorKind, LineWriter, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

const NAME: &str = "cargo board";
/// Board time from one look at the sockets to the next: a tester waits 50 ms for a response, and a long request takes several
/// looks. A sample of the sensor comes every tenth.
const TURN: Duration = Duration::from_millis(1);
const TURNS: u32 = 10;
const IMU: usize = 1;
const SLCAN: usize = 2;
const SERVICE: usize = 6;
const BITS_PER_SECOND: u32 = 500_000;
/// Frames that wait for the adapter's client at most.
const WAITING: usize = 64;
/// Board time in which a coprocessor has sent a frame.
const SENDS: Duration = Duration::from_secs(5);
/// Rows at the start of a drive in which the vehicle stands.
const PARKED: usize = 350;
/// Board time from one report of the speed to the next.
const REPORT: Duration = Duration::from_secs(30);

/// Run the firmware on a model of the board (modelled, not silicon), with its lines as sockets.
#[derive(Parser)]
#[command(after_help = "\
Examples, in another terminal:
  gyronet device --port localhost:4006 info
  gyronet device --port localhost:4005 update target/netduino-plus-2.update
  cantools monitor -i slcan -c socket://localhost:4005 -b 500000 tools/gyronet.dbc")]
struct Args {
    /// Drive that the vehicle drives; without it one is simulated, with a GNSS receiver whose NMEA 2000 frames the board
    /// takes once it is told to: `cargo gyronet device --port localhost:4006 set heading.nmea2000=true`, then `restart`.
    #[arg(value_name = "DRIVE.csv")]
    drive: Option<PathBuf>,
    /// Let the vehicle stand: the first three and a half seconds again and again.
    #[arg(long)]
    parked: bool,
    /// Part on SPI1, which the board takes once it is told to (`set imu=Bmi088`).
    #[arg(long, value_parser = ["Icm42688", "Bmi088", "Asm330lhh"])]
    spi: Option<String>,
    /// Port of the service line (USART6).
    #[arg(long, default_value_t = 4006)]
    service: u16,
    /// Port of the SLCAN line (USART2).
    #[arg(long, default_value_t = 4002)]
    slcan: u16,
    /// Port of an SLCAN adapter on the CAN bus.
    #[arg(long, default_value_t = 4005)]
    can: u16,
    /// Write the frames on the bus to this file, with the board's time, as `candump -L` does.
    #[arg(long, value_name = "FILE.log")]
    log: Option<PathBuf>,
    /// Image to run, as `cargo fw` writes it; without it, it is built.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Crystal of the image's board; the Netduino Plus 2 has 25 MHz.
    #[arg(long, default_value_t = 25_000_000)]
    crystal_hz: u32,
}

/// Runs it with the arguments of this process.
pub fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{NAME}: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Result<(), Box<dyn Error>> {
    require::python_with(board::PACKAGES).map_err(|why| {
        format!(
            "{why}: `python3 -m venv target/python && target/python/bin/pip install unicorn==2.1.4`, then \
             `GYRONET_PYTHON=$PWD/target/python/bin/python {NAME}`"
        )
    })?;
    let mut drive = match &args.drive {
        Some(path) => Recording::read(path)?,
        None => bundled::demo_drive(true)?,
    };
    if args.parked {
        drive.rows.truncate(PARKED);
    }
    let elf = match &args.elf {
        Some(elf) if elf.is_file() => std::path::absolute(elf)?,
        Some(elf) => return Err(format!("{}: no such file", elf.display()).into()),
        None => {
            eprintln!("{NAME}: builds the firmware, which takes a minute or more");
            let folder = std::env::current_exe()?.with_file_name("board-image");
            std::fs::create_dir_all(&folder)?;
            let elf = board::firmware("netduino-plus-2", &folder.display().to_string(), "coprocessor");
            elf.ok_or("the firmware cannot be built: see above")?
        }
    };
    let mut board = Board::unpowered(&elf).ok_or("the model of the board cannot run: see above")?;
    board.configure("USART2.baud", 921_600);
    board.configure("RCC.crystal_hz", args.crystal_hz);
    if let Some(part) = &args.spi {
        board.configure("SPI1.part", &**part);
    }
    board.power_on();
    let mut lines = [
        (SERVICE, Socket::open("service line (USART6)", args.service)?),
        (SLCAN, Socket::open("SLCAN (USART2)", args.slcan)?),
    ];
    let mut adapter = Adapter::open(args.can)?;
    let mut log = match &args.log {
        Some(path) => Some((path, Log::new(LineWriter::new(File::create(path).map_err(named(path))?)))),
        None => None,
    };
    let (mut vehicle, began) = (Vehicle::new(drive), Instant::now());
    let (mut due, mut report, mut sent_at) = (began, REPORT, Some(Duration::ZERO));
    for turn in (0..TURNS).cycle() {
        if turn == 0 {
            let (number, sample, frames) = vehicle.next();
            board.send(IMU, &MtData2::of(&sample, number as u16).emit());
            if args.spi.is_some() {
                let rates = sample.angular_rate.map(|rate| rate.rad_per_sec().to_degrees());
                let forces = sample.specific_force.map(|force| force.metre_per_sec2() / 9.806_65);
                board.configure("SPI1.imu_rates_dps", rates.to_vec());
                board.configure("SPI1.imu_acceleration_g", forces.to_vec());
            }
            frames.iter().for_each(|frame| board.can_send(frame));
            // Nobody else takes what the model keeps.
            board.events();
        }
        for (usart, socket) in &mut lines {
            let bytes = socket.read()?;
            if !bytes.is_empty() {
                board.send(*usart, &bytes);
            }
        }
        adapter.read()?.iter().for_each(|frame| board.can_send(frame));
        let now = board.run(TURN);
        for (usart, socket) in &mut lines {
            socket.write(&board.sent(*usart));
        }
        for Seen { end, own, frame, .. } in board.bus_log() {
            if own {
                sent_at = Some(end);
            }
            if let Some((path, log)) = &mut log {
                log.frame(Micros(end.as_micros() as u64), &frame).map_err(named(path))?;
            }
            adapter.seen(end, &frame);
        }
        adapter.write();
        if sent_at.take_if(|at| now >= *at + SENDS).is_some() {
            eprintln!(
                "{NAME}: no frame for {} s: is it a coprocessor for the STM32F405, with a crystal of {} Hz \
                 (--crystal-hz), at {BITS_PER_SECOND} bit/s?",
                SENDS.as_secs(),
                args.crystal_hz
            );
        }
        // The time of the board passes no faster than that of its testers: it makes up for a step at most.
        due = (due + TURN).max(Instant::now() - TURNS * TURN);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        if now >= report {
            let share = now.as_secs_f64() / began.elapsed().as_secs_f64();
            eprintln!("{} s on the board, {share:.2} of real time", now.as_secs());
            report += REPORT;
        }
    }
    Ok(())
}

/// Drives a drive again and again.
struct Vehicle {
    drive: Recording,
    wheels: Option<WheelFrames>,
    row: usize,
    courses: u8,
}

impl Vehicle {
    fn new(drive: Recording) -> Self {
        let wheels = drive.wheels();
        Self { drive, wheels, row: 0, courses: 0 }
    }

    /// What is measured and sent in 10 ms: the number of the sample, the sample, and the frames of the bus.
    fn next(&mut self) -> (usize, ImuSample, Vec<DataFrame>) {
        let rows = &self.drive.rows;
        let Row { mut sample, heading, .. } = rows[self.row % rows.len()];
        sample.time.0 = (self.row as f64 * DT * 1e6).round() as u64;
        let wheels = self.wheels.as_mut().and_then(|wheels| wheels.next(&rows[self.row % rows.len()]));
        let course = heading.map(|heading| {
            self.courses = self.courses.wrapping_add(1);
            wire::course([heading.course, heading.speed], self.courses)
        });
        self.row += 1;
        (self.row - 1, sample, wheels.into_iter().chain(course).collect())
    }
}

/// An SLCAN adapter on the bus. It is open once its client has sent `O` or a frame, until `C`.
struct Adapter {
    socket: Socket,
    port: Port<WAITING>,
    /// Frames of the client that the bus has not carried yet. They are not sent back to the client.
    sent: Vec<DataFrame>,
}

impl Adapter {
    fn open(port: u16) -> io::Result<Self> {
        let socket = Socket::open("CAN, as by an SLCAN adapter", port)?;
        Ok(Self { socket, port: Port::new(BITS_PER_SECOND), sent: Vec::new() })
    }

    /// Takes what the client sends, for the bus.
    fn read(&mut self) -> io::Result<Vec<DataFrame>> {
        let bytes = self.socket.read()?;
        if std::mem::take(&mut self.socket.is_new) {
            (self.port, self.sent) = (Port::new(BITS_PER_SECOND), Vec::new());
        }
        let sent = &mut self.sent;
        let had = sent.len();
        for byte in bytes {
            self.port.receive(byte, |frame| {
                let has_room = sent.len() < WAITING;
                sent.extend(has_room.then_some(frame));
                has_room
            });
        }
        let frames = sent[had..].to_vec();
        if !frames.is_empty() && !self.port.is_open() {
            b"O\r".iter().for_each(|byte| self.port.receive(*byte, |_| false));
        }
        Ok(frames)
    }

    fn seen(&mut self, time: Duration, frame: &DataFrame) {
        match self.sent.iter().position(|sent| sent == frame) {
            Some(own) => drop(self.sent.remove(own)),
            None if self.port.is_open() => self.port.enqueue(*frame, Micros(time.as_micros() as u64)),
            None => {}
        }
    }

    fn write(&mut self) {
        let mut bytes = Vec::new();
        while let Some(next) = self.port.outgoing() {
            let length = next.len();
            bytes.extend_from_slice(next);
            self.port.sent(length);
        }
        self.socket.write(&bytes);
    }
}

/// A socket for one client at a time.
struct Socket {
    name: &'static str,
    listener: TcpListener,
    client: Option<TcpStream>,
    is_new: bool,
}

impl Socket {
    fn open(name: &'static str, port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .map_err(|error| io::Error::new(error.kind(), format!("{name}: port {port}: {error}")))?;
        listener.set_nonblocking(true)?;
        println!("{name}: localhost:{}", listener.local_addr()?.port());
        Ok(Self { name, listener, client: None, is_new: false })
    }

    /// Returns what the client has sent since the last call, and takes the next client once it has gone.
    fn read(&mut self) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; 512];
        let read = self.client.as_mut().map_or(Ok(0), |client| client.read(&mut bytes));
        match read {
            Ok(0) => self.client = None,
            Err(ref error) if error.kind() != ErrorKind::WouldBlock => self.client = None,
            _ => {}
        }
        bytes.truncate(read.unwrap_or(0));
        match self.listener.accept() {
            Ok(_) if self.client.is_some() => {
                eprintln!("{}: has a client; another one is refused", self.name)
            }
            Ok((client, _)) => {
                client.set_nonblocking(true)?;
                client.set_nodelay(true)?;
                (self.client, self.is_new) = (Some(client), true);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
        Ok(bytes)
    }

    /// Sends to the client, if there is one; a client that does not read is disconnected.
    fn write(&mut self, bytes: &[u8]) {
        if let Some(client) = &mut self.client
            && let Err(error) = client.write_all(bytes)
        {
            if error.kind() != ErrorKind::BrokenPipe {
                eprintln!("{}: {error}; disconnected", self.name);
            }
            self.client = None;
        }
    }
}

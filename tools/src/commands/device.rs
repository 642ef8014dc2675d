//! `gyronet device` reads and changes the state and configuration of a board over diagnosis.

mod calibration;
mod settings;

use super::Common;
use clap::Subcommand;
use gyronet::can::diagnosis::DiagnosisIds;
use gyronet::heading::CourseCounters;
use gyronet::model::fognet_blob::FOGNET;
use gyronet::service::event::CanFault;
use gyronet::service::message::{AccessCounters, Info};
use gyronet_tools::client::bus::{self, Bus};
use gyronet_tools::client::device::settings::{flat, value as value_of};
use gyronet_tools::client::device::update::{Update, update};
use gyronet_tools::client::device::upload::{Uploaded, upload};
use gyronet_tools::client::device::{AccessState, Authority, Device};
use gyronet_tools::drive::error::read;
use gyronet_tools::network::weight_file::WeightFile;
use gyronet_tools::signing::{self, PrivateKey};
use serde::Serialize;
use std::io::{self, Write};
use std::path::PathBuf;

/// Query and configure a board over diagnosis (UDS).
///
/// The command connects to the board over its service line, its SLCAN line, or a CAN interface (--port).
///
/// New settings, wheel frames, calibration files and weights take effect after a restart (`device restart`). The exit
/// status is 1 if the board does not respond or refuses a request.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet device --port /dev/ttyUSB1 info
  gyronet device --port can:can0 set latitude_deg=48.1 mounting.roll_deg=1.5
  gyronet device --port /dev/ttyUSB1 calibrate unit --file unit.json
  gyronet device --port localhost:4006 weights gyronet.blob      # then: restart")]
pub struct Args {
    /// Serial port or host:port of such a line, or can:INTERFACE for a CAN interface of Linux; required.
    #[arg(long, global = true, value_name = "PORT|HOST:PORT|can:INTERFACE")]
    port: Option<String>,
    /// Baud rate of a serial port.
    #[arg(long, global = true, default_value_t = 115_200)]
    baud: u32,
    /// CAN identifiers of requests and responses, if they are not 7E0,7E8; eight digits mean 29 bits.
    #[arg(long, global = true, value_name = "REQUEST,RESPONSE", value_parser = identifiers)]
    ids: Option<DiagnosisIds>,
    /// Private key, to write to a board that stores its public key.
    #[arg(long, global = true, value_name = "NAME.key", conflicts_with = "signature")]
    key: Option<PathBuf>,
    /// Signature of the written file (from `gyronet sign`), for a board that stores a key.
    #[arg(long, global = true, value_name = "FILE.sig")]
    signature: Option<PathBuf>,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Print versions, the cause of the last reset, clock, flash, weights and status.
    Info,
    /// Print the configuration.
    Get,
    /// Change settings (NAME=VALUE as `get` prints them), or write a configuration or wheel frames from a file.
    Set {
        /// Settings, for example `latitude_deg=48.1 mounting.roll_deg=1.5`; values are JSON.
        settings: Vec<String>,
        /// Complete configuration, as `get --json` prints it; or wheel frames (.toml), as `gyronet wheels` and
        /// `device wheels` print them.
        #[arg(long, value_name = "FILE.json|FILE.toml")]
        file: Option<PathBuf>,
    },
    /// Print the settings of the wheel frames that the board receives, as a file for `set --file`.
    Wheels,
    /// Change the calibration or what the board has learnt, and print both.
    Calibrate {
        /// What to change; `show` only prints.
        #[arg(value_enum)]
        what: calibration::What,
        /// Calibration file from `gyronet calibrate`, for `unit`.
        #[arg(long, value_name = "FILE.json")]
        file: Option<PathBuf>,
    },
    /// Print all counters since the board started.
    Counters,
    /// Upload a weight file; the board checks it and uses it after a restart.
    Weights {
        /// Weight file, as `gyronet quantize` writes it.
        file: PathBuf,
    },
    /// Update the firmware; the board checks it, and starts it on trial after a restart.
    Update {
        /// Update, as `gyronet firmware` builds it.
        file: PathBuf,
        /// Accept firmware that is older than the board's.
        #[arg(long)]
        downgrade: bool,
    },
    /// Print who may write: whether a key is stored, the newest signature counter, and the serial number.
    Access,
    /// Store the public key that controls who may write; `none` removes it.
    SetKey {
        /// NAME.pub from `gyronet keys`, or `none`.
        #[arg(value_name = "KEY")]
        public: PathBuf,
    },
    /// Restart the board.
    Restart,
}

type Board = Device<Box<dyn Bus>>;

#[derive(Serialize)]
struct Access {
    #[serde(flatten)]
    access: AccessState,
    /// Requests refused for lack of access since the board started.
    refused: AccessCounters,
}

/// Parses two hexadecimal identifiers, REQUEST,RESPONSE.
fn identifiers(text: &str) -> Result<DiagnosisIds, String> {
    let (request, response) = text.split_once(',').ok_or("not REQUEST,RESPONSE")?;
    let number = |text: &str| u32::from_str_radix(text, 16).map_err(|error| format!("{text}: {error}"));
    let ids = DiagnosisIds {
        extended: request.len() > 3,
        request: number(request)?,
        // No functional requests are sent.
        functional: 0,
        response: number(response)?,
    };
    ids.ids().map(|_| ids).map_err(|id| format!("{id:X} has too many bits, or is given twice"))
}

pub fn run(args: &Args, common: Common) -> super::Result {
    let Some(port) = args.port.as_deref() else {
        let why = "no board is given: use --port /dev/ttyUSB1, --port host:port, or --port can:can0\n";
        clap::Error::raw(clap::error::ErrorKind::MissingRequiredArgument, why).exit();
    };
    let ids = args.ids.unwrap_or(DiagnosisIds::DEFAULT);
    let device = Device::with_ids(bus::open(port, args.baud)?, port, &ids)?;
    let mut device = device.authorise(match (&args.key, &args.signature) {
        (Some(path), _) => Authority::Key(PrivateKey::read(path)?),
        (None, Some(path)) => {
            let trailer =
                read(path)?.try_into().map_err(|_| format!("{}: not a signature", path.display()))?;
            Authority::Signature(trailer)
        }
        (None, None) => Authority::None,
    });
    match &args.action {
        Action::Info => {
            let info = device.info()?;
            if common.json {
                super::print_json(&mut io::stdout().lock(), &info)?;
            } else {
                print_info(&info, device.access()?.state)?;
                print_tilt(device.level_deg()?)?;
                print_course(device.course()?)?;
            }
        }
        Action::Get => settings::print(&device.configuration()?, common)?,
        Action::Set { settings, file } => settings::set(&mut device, settings, file.as_deref(), common)?,
        Action::Wheels => settings::print_wheels(&mut device, common)?,
        Action::Calibrate { what, file } => calibration::run(&mut device, *what, file.as_deref(), common)?,
        Action::Counters => print_value(&device.counters()?, common)?,
        Action::Weights { file } => weights(&mut device, file, common)?,
        Action::Update { file, downgrade } => update_firmware(&mut device, file, *downgrade, common)?,
        Action::Access => {
            let access = Access { access: device.access()?, refused: device.access_counters()? };
            print_value(&access, common)?;
        }
        Action::SetKey { public } => {
            let public = if public.as_os_str() == "none" { [0; 32] } else { signing::read_public(public)? };
            device.set_key(&public)?;
            done(common, "stored; it is in force now")?;
        }
        Action::Restart => {
            device.restart()?;
            done(common, "the board is restarting")?;
        }
    }
    Ok(())
}

fn done(common: Common, what: &str) -> super::Result {
    // One line, as scripts read it.
    let json = serde_json::json!({ "done": what }).to_string();
    Ok(writeln!(io::stdout(), "{}", if common.json { &json } else { what })?)
}

fn print_value(value: &impl Serialize, common: Common) -> super::Result {
    let lines = flat(&value_of(value)?);
    let lines: Vec<String> = lines.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    super::print(common, value, lines.join("\n"))
}

fn print_info(info: &Info, access: &str) -> io::Result<()> {
    let out = &mut io::stdout().lock();
    let identity = &info.identity;
    let [major, minor, patch] = identity.firmware;
    writeln!(out, "firmware      {major}.{minor}.{patch}, {}, protocol {}", info.firmware, info.protocol)?;
    match identity.device_id {
        Some(id) => writeln!(out, "part          {:#05x} revision {:#06x}", id & 0xFFF, id >> 16)?,
        None => writeln!(out, "part          unknown")?,
    }
    let fault = identity.clock_fault.map_or_else(String::new, |fault| format!(": {fault}"));
    writeln!(out, "clock         {:.3} MHz{fault}", f64::from(identity.clock_hz) / 1e6)?;
    let bus = match identity.can_fault {
        None => "CAN, SLCAN".to_owned(),
        Some(fault @ CanFault::Fd) => format!("CAN, SLCAN: {fault}"),
        Some(fault) => format!("SLCAN only: {fault}"),
    };
    writeln!(out, "bus           {bus}")?;
    writeln!(out, "started by    {}", identity.reset)?;
    if let Some(crash) = identity.crash {
        writeln!(out, "crashed       {crash}")?;
    }
    if identity.failed_starts > 0 {
        writeln!(out, "failed starts {} in a row", identity.failed_starts)?;
    }
    writeln!(out, "status        {}", info.status)?;
    if let Some(fault) = info.sensor {
        writeln!(out, "sensor        {fault}")?;
    }
    let writable = if info.writable { "" } else { ", no flash that may be written: nothing can be stored" };
    writeln!(out, "flash         {}{writable}", info.flash)?;
    if let Some(fault) = info.stored_fault {
        writeln!(out, "stored data   newest fault: {fault}")?;
    }
    let open = if access == "open" { ": no key is stored, anyone may write at standstill" } else { "" };
    writeln!(out, "access        {access}{open}")?;
    writeln!(out, "configuration {}, layout {}", info.configuration, info.record_versions[0])?;
    writeln!(out, "wheels        {}", info.wheels)?;
    writeln!(out, "calibration   {}, layout {}", info.calibration, info.record_versions[1])?;
    let crc = info.weights_crc.map(|crc| format!(", checksum {crc:08x}")).unwrap_or_default();
    writeln!(out, "weights       {}{crc}", info.weights)?;
    for (slot, refused) in ["A", "B"].into_iter().zip(info.refused_slots) {
        if let Some(error) = refused {
            writeln!(out, "slot {slot}        not used: {error}")?;
        }
    }
    Ok(())
}

/// Prints the tilt of the sensor beyond its configured mounting.
fn print_tilt(tilt: Option<[f32; 3]>) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match tilt {
        Some([roll, pitch, sigma]) => {
            writeln!(
                out,
                "tilt          roll {roll:+.1} deg, pitch {pitch:+.1} deg, +- {sigma:.1} deg, by standstills and turns"
            )
        }
        None => writeln!(out, "tilt          unknown: the vehicle has not stood yet"),
    }
}

fn print_course((state, [gain, sigma], counters): (u8, [f32; 2], CourseCounters)) -> io::Result<()> {
    let CourseCounters { used, refused, restarts } = counters;
    let text = match state {
        _ if counters == CourseCounters::default() && sigma == 0.0 => "no courses yet".to_owned(),
        3 => format!("contradicts the gyro: {refused} courses refused, {used} used, {restarts} starts again"),
        _ => format!(
            "{used} courses used, {refused} refused; gain of the gyro {:+.2} % +- {:.2} %",
            100.0 * gain,
            100.0 * sigma
        ),
    };
    writeln!(io::stdout().lock(), "course        {text}")
}

fn weights(device: &mut Board, path: &std::path::Path, common: Common) -> super::Result {
    let file = read(path)?;
    // Run the board's own check here, before the board erases its flash.
    if file.get(6..8) == Some(&FOGNET.to_le_bytes()[..]) {
        let name = path.display();
        return Err(format!(
            "{name}: FoGNet no longer runs on this board; `cargo paper tables` runs it on recordings"
        )
        .into());
    }
    WeightFile::new(&path.display().to_string(), &file).blob()?;
    let bar = super::progress::bar(common, file.len(), "upload");
    let Uploaded { slot, crc } = upload(device, &file, |written| bar.set_position(written as u64))?;
    bar.finish_and_clear();
    let text = format_args!("slot {slot} holds file {crc:08x}; the board uses it after a restart");
    super::print(common, &serde_json::json!({ "slot": slot, "crc": crc }), text)
}

fn update_firmware(
    device: &mut Board,
    path: &std::path::Path,
    downgrade: bool,
    common: Common,
) -> super::Result {
    let file = read(path)?;
    let mut file = Update::parse(&file).map_err(|error| format!("{}: {error}", path.display()))?;
    file.head.downgrade = downgrade;
    let bar = super::progress::bar(common, None, "update");
    let slot = update(device, &file, |sent, size| {
        bar.set_length(size as u64);
        bar.set_position(sent as u64);
    })?;
    bar.finish_and_clear();
    let version @ [major, minor, patch] = file.head.label.version;
    let text =
        format!("slot {slot} holds firmware {major}.{minor}.{patch}; it starts on trial after a restart");
    super::print(common, &serde_json::json!({ "slot": slot, "version": version }), text)
}

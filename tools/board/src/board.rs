//! The virtual board for tests: runs the image as flashed, on a model of its chip in Python (`host-tests/README.md`).
//!
//! The model runs in a process of its own. Board time passes only in [`Board::run`] and the `run_until` methods, so a
//! test behaves the same on any machine. Whatever the model refuses (an unmodelled register, a peripheral without its
//! clock) is a panic with the model's error text.

pub mod bus;
mod event;
pub mod line;
mod link;

use crate::wire::{data_frame, id11, id29};
use crate::{image, require};
pub use bus::CanBus;
use embedded_can::{Frame, Id};
pub use event::{Counts, Event};
use gyronet::can::DataFrame;
use gyronet::model::blob::CRC;
use gyronet::store::Slot;
use gyronet::store::firmware::{MAX_IMAGE, Trailer};
use gyronet::store::layout::FLASH_BASE;
use gyronet_tools::signing::hex;
use gyronet_tools::target::bench;
pub use line::Line;
use link::{Link, unhex};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Duration;

pub const PACKAGES: &[&str] = &["unicorn"];

/// The ELF file of an image for a board, named by its feature. The test is reported as skipped if the model
/// cannot run (then nothing is built) or the image cannot be built.
pub fn firmware(board: &str, scratch: &str, name: &str) -> Option<PathBuf> {
    require::python(PACKAGES)?;
    image::firmware_for((board, bench::TARGET), scratch, name)
}

#[derive(Debug, Clone, Copy)]
pub enum At<'a> {
    Address(u32),
    /// A symbol of the image: its full name, or a part that fits only one, such as `app::idle`.
    Symbol(&'a str),
}

#[derive(Debug, Clone, Copy)]
pub struct Seen {
    pub start: Duration,
    pub end: Duration,
    pub own: bool,
    pub frame: DataFrame,
}

/// A complete frame of the board's own, as an observer that knows CAN FD sees it.
#[derive(Debug, Clone)]
pub struct Own {
    pub id: u32,
    pub data: Vec<u8>,
    /// True for a CAN FD frame with the higher bit rate.
    pub is_fast: bool,
}

#[derive(Debug)]
pub struct Board {
    link: Link,
}

impl Board {
    /// A board without power, with the image in its flash; the test is reported as skipped without the model's packages.
    pub fn unpowered(image: &Path) -> Option<Self> {
        Self::of("stm32f405", image)
    }

    /// As [`Board::unpowered`], with this chip.
    pub fn of(chip: &str, image: &Path) -> Option<Self> {
        let python = require::python(PACKAGES)?;
        Some(Self { link: Link::open(&python, image, chip) })
    }

    #[track_caller]
    fn ask(&mut self, command: &str, arguments: Value) -> Value {
        self.link.ask(command, arguments).unwrap_or_else(|error| panic!("{command}: {error}"))
    }

    /// Applies power. RAM then holds noise.
    pub fn power_on(&mut self) {
        self.ask("power_on", json!({}));
    }

    /// Removes power. Flash stays as it is, and an operation under way in it is left half done.
    pub fn power_off(&mut self) {
        self.ask("power_off", json!({}));
    }

    /// Removes power for a time, and applies it for another one.
    pub fn power_cycle(&mut self, off: Duration, on: Duration) {
        self.power_off();
        self.run(off);
        self.power_on();
        self.run(on);
    }

    /// Pulls the reset pin low for a moment.
    pub fn reset_pin(&mut self) {
        self.ask("reset_pin", json!({}));
    }

    /// Lets board time pass, and returns the time since the first power-on.
    pub fn run(&mut self, time: Duration) -> Duration {
        let answer = self.ask("run", json!({ "us": micros(time) }));
        duration(&answer["time_us"])
    }

    /// Lets board time pass until an event of this kind, and returns its time; `None` after the limit.
    pub fn run_until(&mut self, event: &str, limit: Duration) -> Option<Duration> {
        self.until(json!({ "event": event }), limit)
    }

    /// Lets board time pass until a line has this many unread bytes from the board; returns whether it has.
    pub fn run_until_sent(&mut self, usart: usize, bytes: usize, limit: Duration) -> bool {
        self.until(json!({ "usart": usart, "bytes": bytes }), limit).is_some()
    }

    fn until(&mut self, condition: Value, limit: Duration) -> Option<Duration> {
        let answer = self.ask("run", json!({ "until": [condition], "limit_us": micros(limit) }));
        answer["met"].as_u64().map(|_| duration(&answer["time_us"]))
    }

    pub fn send(&mut self, usart: usize, bytes: &[u8]) {
        self.ask("usart_send", json!({ "usart": usart, "hex": hex(bytes) }));
    }

    pub fn send_at(&mut self, usart: usize, bytes: &[u8], time: Duration) {
        self.ask("usart_send", json!({ "usart": usart, "hex": hex(bytes), "at_us": micros(time) }));
    }

    pub fn sent(&mut self, usart: usize) -> Vec<u8> {
        let answer = self.ask("usart_take", json!({ "usart": usart }));
        list(&answer["chunks"]).iter().flat_map(|chunk| unhex(&chunk["hex"])).collect()
    }

    pub fn bus(&mut self) -> CanBus<'_> {
        CanBus(self, None)
    }

    /// The bus for a tester, whose frames of the board are kept with the time of their end.
    pub fn logged_bus<'a>(&'a mut self, log: &'a mut Vec<(Duration, DataFrame)>) -> CanBus<'a> {
        CanBus(self, Some(log))
    }

    pub fn line(&mut self, usart: usize) -> Line<'_> {
        Line::new(self, usart)
    }

    pub fn can_send(&mut self, frame: &DataFrame) {
        self.ask("can_send", foreign(frame));
    }

    /// Sends a frame of another node on the bus, not before a time.
    pub fn can_send_at(&mut self, frame: &DataFrame, time: Duration) {
        let mut arguments = foreign(frame);
        arguments["at_us"] = micros(time).into();
        self.ask("can_send", arguments);
    }

    /// Sends a CAN FD frame of another node on the bus, its data at the higher bit rate, not before a time.
    pub fn can_fd_send_at(&mut self, id: u16, data: &[u8], time: Duration) {
        let at = micros(time);
        self.ask("can_send", json!({ "id": id, "data": hex(data), "fd": true, "fast": true, "at_us": at }));
    }

    /// Takes the frames that the board has sent, with the time of their end.
    pub fn can_frames(&mut self) -> Vec<(Duration, DataFrame)> {
        self.bus_log().into_iter().filter(|seen| seen.own).map(|seen| (seen.end, seen.frame)).collect()
    }

    /// Takes what was on the bus and is complete.
    fn taken(&mut self) -> Vec<Value> {
        let answer = self.ask("can_take", json!({}));
        list(&answer["frames"]).iter().filter(|entry| entry["error"].is_null()).cloned().collect()
    }

    /// Takes the frames of the board, CAN FD among them.
    pub fn own_frames(&mut self) -> Vec<Own> {
        let own = self.taken().into_iter().filter(|entry| entry["source"] == "board");
        own.map(|entry| Own {
            id: word(&entry["id"]),
            data: unhex(&entry["data"]),
            is_fast: entry["fast"] == true,
        })
        .collect()
    }

    /// Takes all classic frames that were on the bus.
    pub fn bus_log(&mut self) -> Vec<Seen> {
        let classic = self.taken().into_iter().filter(|entry| entry["fd"] == false);
        classic
            .map(|entry| Seen {
                start: duration(&entry["start_us"]),
                end: duration(&entry["time_us"]),
                own: entry["source"] == "board",
                frame: frame(&entry),
            })
            .collect()
    }

    /// Sets a fault or a condition of the environment, such as `"RCC.crystal_hz"` to `null`.
    pub fn configure(&mut self, name: &str, value: impl Into<Value>) {
        self.ask("set", json!({ "values": { name: value.into() } }));
    }

    pub fn events(&mut self) -> Vec<Event> {
        let answer = self.ask("events_take", json!({}));
        list(&answer["events"]).iter().map(Event::new).collect()
    }

    /// Switches the recording of a peripheral's register accesses in the event log on or off.
    pub fn trace(&mut self, peripheral: &str, on: bool) {
        self.ask("trace", json!({ "peripheral": peripheral, "on": on }));
    }

    pub fn read(&mut self, at: At, length: usize) -> Vec<u8> {
        let answer = self.ask("memory_read", place(at, json!({ "length": length })));
        unhex(&answer["hex"])
    }

    /// Changes flash or RAM: a stored record, or an instruction (`FEE7` is a branch to itself). An image that is changed at
    /// a symbol gets the checksum of its changed bytes, so that the boot loader starts it.
    pub fn patch(&mut self, at: At, bytes: &[u8]) {
        self.ask("memory_write", place(at, json!({ "hex": hex(bytes) })));
        let start = FLASH_BASE + Slot::A.firmware().start;
        let end = At::Address(start + MAX_IMAGE);
        let length = self.read(end, 4).first_chunk().map_or(0, |word| u32::from_le_bytes(*word));
        if matches!(at, At::Symbol(_)) && length <= MAX_IMAGE {
            let crc = CRC.checksum(&self.read(At::Address(start), length as usize));
            let trailer = Trailer { is_confirmed: true, ..Trailer::new(length, crc, 0, 1) };
            self.ask("memory_write", place(end, json!({ "hex": hex(&trailer.bytes()) })));
        }
    }

    /// The address of a symbol, and its size in bytes.
    pub fn symbol(&mut self, name: &str) -> (u32, u32) {
        let answer = self.ask("symbol", json!({ "name": name }));
        (word(&answer["address"]), word(&answer["size"]))
    }

    /// `r0` to `r12`, `sp`, `lr`, `pc`, `xpsr`, `msp`, `psp`, `primask`, ...
    pub fn register(&mut self, name: &str) -> u32 {
        let answer = self.ask("registers", json!({}));
        word(&answer["registers"][name])
    }

    /// The priority bytes of all exceptions, by number, as SHPR and NVIC_IPR hold them.
    pub fn priorities(&mut self) -> Vec<i64> {
        let answer = self.ask("registers", json!({}));
        list(&answer["priorities"]).iter().filter_map(Value::as_i64).collect()
    }

    pub fn set_register(&mut self, name: &str, value: u32) {
        self.ask("registers", json!({ "set": { name: value } }));
    }

    /// Cuts the power a delay after this many accesses to the flash controller's registers or the flash array.
    pub fn cut_after(&mut self, accesses: usize, delay: Duration) {
        self.ask("cut_after", json!({ "accesses": accesses, "delay_us": micros(delay) }));
    }

    pub fn counts(&mut self) -> Counts {
        Counts::new(&self.ask("counts", json!({})))
    }

    /// Takes the longest path of each task since the last call, instructions, by the name of its function.
    pub fn paths(&mut self) -> Vec<(String, u64)> {
        let answer = self.ask("paths_take", json!({}));
        let path = |entry: &Value| {
            let name = entry["name"].as_str().unwrap_or_default().to_owned();
            (name, entry["instructions"].as_u64().expect("the model counts"))
        };
        list(&answer["paths"]).iter().map(path).collect()
    }

    pub fn snapshot(&mut self, name: &str) {
        self.ask("snapshot", json!({ "name": name }));
    }

    pub fn restore(&mut self, name: &str) {
        self.ask("restore", json!({ "name": name }));
    }
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

fn duration(micros: &Value) -> Duration {
    Duration::from_secs_f64(micros.as_f64().expect("the model gives a time") * 1e-6)
}

fn word(value: &Value) -> u32 {
    value.as_u64().and_then(|value| u32::try_from(value).ok()).expect("the model gives a word")
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("the model gives a list")
}

fn foreign(frame: &DataFrame) -> Value {
    let (id, extended) = match frame.id() {
        Id::Standard(id) => (u32::from(id.as_raw()), false),
        Id::Extended(id) => (id.as_raw(), true),
    };
    json!({ "id": id, "ext": extended, "data": hex(frame.data()) })
}

fn frame(entry: &Value) -> DataFrame {
    let id = word(&entry["id"]);
    let id = if entry["ext"] == true { id29(id) } else { id11(id as u16) };
    data_frame(id, &unhex(&entry["data"]))
}

fn place(at: At, mut arguments: Value) -> Value {
    match at {
        At::Address(address) => arguments["address"] = address.into(),
        At::Symbol(name) => arguments["symbol"] = name.into(),
    }
    arguments
}

//! Reads CAN logs in text form: candump, Vector ASC and PEAK TRC.

use super::can::{Bus, Frame, add};
use super::input::{Input, read_line};
use super::log::Log;

/// Longest line, bytes. A CAN FD frame of 64 bytes with Vector's statistics takes about 400.
const MAX_LINE: u64 = 4_096;

/// The format of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// can-utils: `(1.234567) can0 123#0102`.
    Candump,
    /// Vector ASC.
    Asc,
    /// PEAK TRC, versions 1.0 to 2.1.
    Trc,
}

/// Returns the format of a file by its beginning.
pub fn dialect(head: &[u8]) -> Option<Dialect> {
    let head = String::from_utf8_lossy(&head[..head.len().min(4_096)]).to_lowercase();
    let first = head.lines().map(str::trim).find(|line| !line.is_empty())?;
    let is_candump = first.starts_with('(') && first.contains(['#', '[']);
    let is_trc = head.contains(";$fileversion") || head.lines().any(|line| line.contains("message number"));
    if is_candump {
        Some(Dialect::Candump)
    } else if first.starts_with("date ") || first.starts_with("base ") {
        Some(Dialect::Asc)
    } else {
        (first.starts_with(';') && is_trc).then_some(Dialect::Trc)
    }
}

/// Reads a log.
pub fn read(
    dialect: Dialect,
    input: &mut Input<'_>,
    bus: Option<&Bus>,
    log: &mut Log,
) -> std::io::Result<()> {
    let mut state = State { radix: 16, relative: false, last: 0.0, columns: None };
    while let Some(line) = read_line(input, MAX_LINE)? {
        let line = line.trim();
        let parsed = match dialect {
            Dialect::Candump => candump(line),
            Dialect::Asc => state.asc(line),
            Dialect::Trc => state.trc(line),
        };
        match parsed {
            Line::Frame(Text { seconds, bus: name, id, extended, data }) => {
                add(bus, &Frame { seconds, bus: name, id, extended, data: &data }, log);
            }
            Line::Remark => {}
            Line::Other(what) => log.pass_over(what),
            Line::Bad => log.drop("lines that are not a frame".to_owned()),
        }
    }
    Ok(())
}

enum Line<'a> {
    Frame(Text<'a>),
    Remark,
    Other(&'static str),
    Bad,
}

struct Text<'a> {
    seconds: f64,
    bus: &'a str,
    id: u32,
    extended: bool,
    data: Vec<u8>,
}

/// The settings that earlier lines of the file give.
struct State {
    radix: u32,
    relative: bool,
    last: f64,
    /// The columns of a TRC file, by their first letters.
    columns: Option<Vec<char>>,
}

fn frame<'a>(text: Option<Text<'a>>) -> Line<'a> {
    text.map_or(Line::Bad, Line::Frame)
}

fn candump(line: &str) -> Line<'_> {
    if line.is_empty() {
        return Line::Remark;
    }
    let Some((stamp, rest)) = line.strip_prefix('(').and_then(|line| line.split_once(')')) else {
        return Line::Bad;
    };
    let Ok(seconds) = stamp.trim().parse() else { return Line::Bad };
    let mut words = rest.split_whitespace();
    let (Some(_), Some(word)) = (words.next(), words.next()) else { return Line::Bad };
    let (id, data) = match word.split_once('#') {
        // As `candump -L` writes: 123#0102, 123#R, CAN FD 123##1...
        Some((_, data)) if data.starts_with(['R', 'r']) => return Line::Other("remote frame"),
        Some((id, data)) => {
            let data = data.strip_prefix('#').map_or(data, |flagged| flagged.get(1..).unwrap_or_default());
            (id, data.replace('.', ""))
        }
        // As `candump -ta` writes: 123   [2]  01 02
        None => (word, words.skip(1).collect()),
    };
    let parse = || {
        let extended = id.len() > 3;
        let id = u32::from_str_radix(id, 16).ok()?;
        Some(Text { seconds, bus: "", id: id & 0x1FFF_FFFF, extended, data: bytes(&data)? })
    };
    frame(parse())
}

/// Parses hexadecimal digits as bytes.
fn bytes(digits: &str) -> Option<Vec<u8>> {
    if digits.len() > 128 || !digits.len().is_multiple_of(2) || !digits.is_ascii() {
        return None;
    }
    (0..digits.len()).step_by(2).map(|at| u8::from_str_radix(&digits[at..at + 2], 16).ok()).collect()
}

impl State {
    fn asc<'a>(&mut self, line: &'a str) -> Line<'a> {
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.first() == Some(&"base") {
            self.radix = if words.get(1) == Some(&"dec") { 10 } else { 16 };
            self.relative = words.contains(&"relative");
            return Line::Remark;
        }
        let Some(seconds) = words.first().and_then(|word| word.parse::<f64>().ok()) else {
            // A header line, or the begin or end of a trigger block.
            return Line::Remark;
        };
        let seconds = if self.relative { self.last + seconds } else { seconds };
        self.last = seconds;
        let Some((&kind, rest)) = words.get(1..).and_then(<[&str]>::split_first) else { return Line::Bad };
        if kind == "CANFD" {
            return self.asc_fd(seconds, rest);
        }
        let is_channel = kind.parse::<u8>().is_ok();
        match rest {
            _ if !is_channel => Line::Other("event"),
            ["Statistic:", ..] => Line::Other("event"),
            ["ErrorFrame", ..] => Line::Other("error frame"),
            [_, "Rx" | "Tx" | "TxRq", "r" | "R", ..] => Line::Other("remote frame"),
            [id, "Rx" | "Tx" | "TxRq", "d" | "D", len, data @ ..] => {
                frame(self.asc_frame(seconds, kind, id, len, data))
            }
            _ => Line::Other("event"),
        }
    }

    /// Parses a CAN FD event: CANFD CHANNEL DIRECTION ID [NAME] BRS ESI DLC LENGTH DATA...
    fn asc_fd<'a>(&self, seconds: f64, words: &[&'a str]) -> Line<'a> {
        let (channel, rest) = match words {
            [_, _, "ErrorFrame", ..] => return Line::Other("error frame"),
            [channel, _, rest @ ..] => (channel, rest),
            _ => return Line::Bad,
        };
        let is_flag = |word: &str| matches!(word, "0" | "1");
        let (id, rest) = match rest {
            [id, brs, esi, rest @ ..] if is_flag(brs) && is_flag(esi) => (id, rest),
            [id, _, brs, esi, rest @ ..] if is_flag(brs) && is_flag(esi) => (id, rest),
            _ => return Line::Bad,
        };
        match rest {
            [_, "0", ..] => Line::Other("remote frame"),
            [_, len, data @ ..] => {
                let parse = || {
                    let (id, extended) = self.id(id)?;
                    let data = data.get(..len.parse::<usize>().ok().filter(|len| *len <= 64)?)?;
                    let data = self.data(data)?;
                    Some(Text { seconds, bus: bus_name(channel), id, extended, data })
                };
                frame(parse())
            }
            _ => Line::Bad,
        }
    }

    fn asc_frame<'a>(
        &self,
        seconds: f64,
        bus: &'a str,
        id: &str,
        len: &str,
        data: &[&str],
    ) -> Option<Text<'a>> {
        // The field may also hold the name of a message or a protocol, which is not a number.
        let (id, extended) = self.id(id)?;
        let len = usize::from_str_radix(len, self.radix).ok()?.min(8);
        let data = self.data(data.get(..len)?)?;
        Some(Text { seconds, bus: bus_name(bus), id, extended, data })
    }

    fn id(&self, text: &str) -> Option<(u32, bool)> {
        let digits = text.strip_suffix(['x', 'X']);
        let id = u32::from_str_radix(digits.unwrap_or(text), self.radix).ok()?;
        (id <= 0x1FFF_FFFF).then_some((id, digits.is_some()))
    }

    fn data(&self, words: &[&str]) -> Option<Vec<u8>> {
        words.iter().map(|word| u8::from_str_radix(word, self.radix).ok()).collect()
    }

    fn trc<'a>(&mut self, line: &'a str) -> Line<'a> {
        if let Some(columns) = line.strip_prefix(";$COLUMNS=") {
            self.columns = Some(columns.split(',').filter_map(|name| name.trim().chars().next()).collect());
        }
        if line.is_empty() || line.starts_with(';') {
            return Line::Remark;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        match &self.columns {
            Some(columns) => trc_2(columns, &words),
            None => frame(trc_1(&words)),
        }
    }
}

fn bus_name(bus: &str) -> &str {
    if bus == "1" { "" } else { bus }
}

/// Parses a line of version 2, with the columns that the file names; the data is last.
fn trc_2<'a>(columns: &[char], words: &[&'a str]) -> Line<'a> {
    let column = |letter: char| {
        let at = columns.iter().position(|column| *column == letter)?;
        words.get(at).copied()
    };
    match column('T') {
        Some("DT" | "FD" | "FB" | "FE" | "BI") => {}
        Some("RR") => return Line::Other("remote frame"),
        Some(_) => return Line::Other("event"),
        None => return Line::Bad,
    }
    let parse = || {
        let seconds = 1e-3 * column('O')?.parse::<f64>().ok()?;
        let id = column('I')?;
        let len: usize = column('L').or_else(|| column('l'))?.parse().ok()?;
        let first = columns.iter().position(|column| *column == 'D')?;
        let data = words.get(first..first + len.min(64))?.concat();
        let bus = column('B').map_or("", bus_name);
        let extended = id.len() > 4;
        Some(Text { seconds, bus, id: u32::from_str_radix(id, 16).ok()?, extended, data: bytes(&data)? })
    };
    frame(parse())
}

/// Parses a line of version 1: `1) 17535.4 Tx 0100 8 00 ...`, from 1.3 on with the bus before the direction.
fn trc_1<'a>(words: &[&'a str]) -> Option<Text<'a>> {
    let seconds = 1e-3 * words.get(1)?.parse::<f64>().ok()?;
    let bus = words
        .get(2)
        .filter(|word| word.parse::<u8>().is_ok() && words.get(3).is_some_and(|w| w.contains('x')));
    let rest = words.get(2 + usize::from(bus.is_some())..)?;
    let rest = rest.strip_prefix(&["Rx"]).or_else(|| rest.strip_prefix(&["Tx"])).unwrap_or(rest);
    let (id, rest) = rest.split_first()?;
    let (len, data) = match rest {
        ["-", len, data @ ..] => (len, data),
        [len, data @ ..] => (len, data),
        [] => return None,
    };
    let data = bytes(&data.get(..len.parse::<usize>().ok()?.min(8))?.concat())?;
    let extended = id.len() > 4;
    let bus = bus.map_or("", |bus| bus_name(bus));
    Some(Text { seconds, bus, id: u32::from_str_radix(id, 16).ok()?, extended, data })
}

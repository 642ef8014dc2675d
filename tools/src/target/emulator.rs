//! This module runs the emulated board: QEMU's `netduinoplus2`, an STM32F405 with its serial lines on TCP.
//!
//! This module listens on ports that the system chooses, and QEMU connects to them before the machine starts: no port
//! is guessed, and no byte from the board is lost. Bytes sent to a receiver that the image has not enabled yet would
//! be lost, as on real hardware; so [`Board::send`] first checks the receiver's enable bits through QEMU's test port.
//! Every wait has a timeout, and QEMU is killed when the [`Board`] is dropped. Bytes are transferred at the host's
//! speed, not at a baud rate.

mod process;

use process::{Line, Process};
use std::io::{self, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

const PROGRAM: &str = "qemu-system-arm";
/// Timeout of QEMU's connections, and of the image enabling a receiver.
const START: Duration = Duration::from_secs(20);
const POLL: Duration = Duration::from_millis(5);
/// Time for which a client's first byte is awaited.
const HELLO: Duration = Duration::from_secs(2);

/// Addresses of control register 1 of USART 1 to 6 (RM0090, table 1 and 30.6.4), and its bits UE and RE.
const CR1: [u32; 6] = [0x4001_100C, 0x4000_440C, 0x4000_480C, 0x4000_4C0C, 0x4000_500C, 0x4001_140C];
const RECEIVER_ENABLED: u32 = 1 << 13 | 1 << 2;
/// Distance of the status register before control register 1, and all its bits except TXE. The emulated register
/// treats a word of more than ten bits as a mask, and any other word as a value with TXE set.
const SR_BEFORE_CR1: u32 = 0x0C;
const ALL_BUT_TXE: u32 = !(1 << 7);

/// The reason why the emulator or its image failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EmulatorError {
    /// QEMU is missing or cannot be started.
    #[error("{PROGRAM} cannot be run: {0}")]
    Start(io::Error),
    /// A socket of one of QEMU's lines failed.
    #[error("a socket on the loopback: {0}")]
    Socket(#[from] io::Error),
    /// QEMU or the image failed.
    #[error("{PROGRAM}: {what}\nits standard error:\n{errors}")]
    Failed {
        /// Description of the failure.
        what: String,
        /// The output of QEMU, and of the image through semihosting.
        errors: String,
    },
}

/// Holds the result of a call to the emulator.
pub type Result<T> = std::result::Result<T, EmulatorError>;

/// Checks that QEMU can be run.
///
/// # Errors
/// [`EmulatorError::Start`].
pub fn available() -> Result<()> {
    let version = Command::new(PROGRAM).arg("--version").stdout(Stdio::null()).status();
    version.map(drop).map_err(EmulatorError::Start)
}

/// Splits bytes into complete lines without their ends.
fn split(bytes: &[u8], end: u8) -> Vec<Vec<u8>> {
    let mut lines: Vec<Vec<u8>> = bytes.split(|byte| *byte == end).map(<[u8]>::to_vec).collect();
    lines.pop();
    lines
}

/// Controls an emulated board that runs an image.
#[derive(Debug)]
pub struct Board {
    process: Process,
    registers: Line,
    usarts: Vec<Line>,
}

impl Board {
    /// Starts QEMU with an image and its first `usarts` serial lines (1 to 6) connected. `arguments` follow the
    /// default arguments and override them.
    ///
    /// # Errors
    /// [`EmulatorError`], with QEMU's own message.
    pub fn boot(image: &Path, usarts: usize, arguments: &[&str]) -> Result<Self> {
        let listen = || TcpListener::bind((Ipv4Addr::LOCALHOST, 0));
        let port = |listener: &TcpListener| listener.local_addr().map(|address| address.port());
        let registers = listen()?;
        let listeners: Vec<TcpListener> = (0..usarts).map(|_| listen()).collect::<io::Result<_>>()?;
        let mut command = Command::new(PROGRAM);
        command
            .args(["-machine", "netduinoplus2", "-nographic"])
            // An instruction takes 1 ns, so the board's time does not depend on the host's load.
            .args(["-icount", "shift=0"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .args(["-monitor", "stdio", "-qtest-log", "/dev/null"])
            .args(["-qtest", &format!("tcp:127.0.0.1:{}", port(&registers)?)])
            .args(arguments);
        // A multiplexer with one client buffers up to 32 bytes, so that QEMU need not be woken for each byte, which
        // is slow on a busy host. The escape character 256 is not a byte value, so nothing is escaped.
        command.args(["-echr", "256"]);
        for (n, listener) in listeners.iter().enumerate() {
            let socket =
                format!("socket,id=line{n},host=127.0.0.1,port={},nodelay=on,mux=on", port(listener)?);
            command.args(["-chardev", &socket, "-serial", &format!("chardev:line{n}")]);
        }
        if usarts == 0 {
            command.args(["-serial", "none"]);
        }
        command.arg("-kernel").arg(image);
        let mut process = Process::start(command)?;
        let registers = process.accept(&registers)?;
        let usarts = listeners.iter().map(|listener| process.accept(listener)).collect::<Result<_>>()?;
        Ok(Self { process, registers, usarts })
    }

    /// Sends bytes to USART `n` (1 to 6) once its receiver is enabled; waits while the board accepts no bytes.
    ///
    /// # Errors
    /// If the receiver stays disabled, or accepts no byte for `limit`.
    pub fn send(&mut self, n: usize, bytes: &[u8], limit: Duration) -> Result<()> {
        let until = Instant::now() + START;
        while self.word(CR1[n - 1])? & RECEIVER_ENABLED != RECEIVER_ENABLED {
            self.process.sleep(until, format!("the image does not switch USART{n}'s receiver on"))?;
        }
        let mut stream = &self.usarts[n - 1].stream;
        stream.set_write_timeout(Some(limit))?;
        let sent = stream.write_all(bytes);
        sent.map_err(|error| self.process.failed(format!("USART{n} does not take the bytes: {error}")))
    }

    /// Waits until `enough` accepts the bytes that USART `n` has sent since the start.
    ///
    /// # Errors
    /// If that does not happen within `limit`.
    pub fn await_sent(&self, n: usize, limit: Duration, enough: impl FnMut(&[u8]) -> bool) -> Result<()> {
        if self.usarts[n - 1].received.holds(limit, enough) {
            Ok(())
        } else {
            Err(self.process.failed(format!("USART{n} did not send what is awaited within {limit:?}")))
        }
    }

    /// Waits until USART `n` has sent `count` lines, which end with `end`, and returns all lines since the start.
    /// Lines are without their ends; an unfinished line is left out.
    ///
    /// # Errors
    /// If the lines do not arrive within `limit`; the message says how many did.
    pub fn lines(&self, n: usize, end: u8, count: usize, limit: Duration) -> Result<Vec<Vec<u8>>> {
        let ends = |bytes: &[u8]| bytes.iter().filter(|byte| **byte == end).count();
        let (bytes, enough) = self.usarts[n - 1].received.wait(limit, |bytes| ends(bytes) >= count);
        if !enough {
            let sent = ends(&bytes);
            return Err(self
                .process
                .failed(format!("USART{n} sent {sent} lines in {limit:?} instead of {count}")));
        }
        Ok(split(&bytes, end))
    }

    /// Returns the lines of USART `n` once `enough` accepts them.
    ///
    /// # Errors
    /// If that does not happen within `limit`.
    pub fn lines_until(
        &self,
        n: usize,
        end: u8,
        limit: Duration,
        enough: impl Fn(&[Vec<u8>]) -> bool,
    ) -> Result<Vec<Vec<u8>>> {
        let (bytes, is_enough) = self.usarts[n - 1].received.wait(limit, |bytes| enough(&split(bytes, end)));
        if !is_enough {
            return Err(self
                .process
                .failed(format!("USART{n} did not send what is awaited within {limit:?}")));
        }
        Ok(split(&bytes, end))
    }

    /// Makes USART `n` refuse bytes from the image (its transmit register stays full), or accept them again.
    ///
    /// # Errors
    /// If QEMU does not answer.
    pub fn stall(&mut self, n: usize, stalled: bool) -> Result<()> {
        let value = if stalled { ALL_BUT_TXE } else { 0 };
        self.ask(&format!("writel {:#x} {value:#x}", CR1[n - 1] - SR_BEFORE_CR1)).map(drop)
    }

    /// Returns an address at which one TCP client can talk to USART `n`. The client receives all bytes that the USART
    /// has sent since the start, but only after the client has sent a byte, or after 2 s: pyserial discards received
    /// bytes when it opens a line.
    ///
    /// # Errors
    /// If the system provides no port.
    pub fn serve(&mut self, n: usize) -> Result<SocketAddr> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let address = listener.local_addr()?;
        let Line { stream, received } = &self.usarts[n - 1];
        let (mut board, received) = (stream.try_clone()?, Arc::clone(received));
        // Both threads end when the client or the board closes its connection.
        std::thread::spawn(move || {
            let Ok((client, _)) = listener.accept() else { return };
            let Ok(mut from_client) = client.try_clone() else { return };
            // Frames are short, and a tester waits for each frame.
            let _ = client.set_nodelay(true);
            let _ = client.set_read_timeout(Some(HELLO));
            let _ = client.peek(&mut [0]);
            let _ = client.set_read_timeout(None);
            std::thread::spawn(move || std::io::copy(&mut from_client, &mut board));
            received.copy_to(&client);
            let _ = client.shutdown(Shutdown::Both);
        });
        Ok(address)
    }

    /// Returns a word of the board's memory or registers.
    ///
    /// # Errors
    /// If QEMU does not answer.
    pub fn word(&mut self, address: u32) -> Result<u32> {
        let answer = self.ask(&format!("readl {address:#x}"))?;
        let word = answer.strip_prefix("0x").and_then(|digits| u32::from_str_radix(digits, 16).ok());
        word.ok_or_else(|| self.process.failed(format!("the test port answers {answer:?}")))
    }

    /// Returns the answer of QEMU's test port to a command, without its "OK".
    fn ask(&mut self, command: &str) -> Result<String> {
        let Line { stream, received } = &mut self.registers;
        let asked = received.wait(Duration::ZERO, |_| true).0.len();
        if let Err(error) = stream.write_all(format!("{command}\n").as_bytes()) {
            return Err(self.process.failed(format!("the test port does not listen: {error}")));
        }
        let answer = |bytes: &[u8]| {
            let text = String::from_utf8_lossy(bytes.get(asked..)?).into_owned();
            Some(text.strip_prefix("OK")?.strip_suffix('\n')?.trim().to_owned())
        };
        let (bytes, _) = received.wait(START, |bytes| answer(bytes).is_some());
        answer(&bytes).ok_or_else(|| self.process.failed(format!("the test port does not answer {command}")))
    }

    /// Waits until QEMU ends by itself (semihosting) and returns its exit code.
    ///
    /// # Errors
    /// If QEMU does not end within `limit`, or is killed by a signal.
    pub fn exit_code(&mut self, limit: Duration) -> Result<i32> {
        let until = Instant::now() + limit;
        loop {
            if let Ok(Some(status)) = self.process.child.try_wait() {
                return status.code().ok_or_else(|| self.process.failed(format!("ended with {status}")));
            }
            self.process.sleep(until, format!("did not end within {limit:?}"))?;
        }
    }

    /// Ends QEMU cleanly, so that its plugins can print, and returns everything that QEMU, and the image through
    /// semihosting, have written to standard error.
    ///
    /// # Errors
    /// If QEMU does not end.
    pub fn quit(mut self) -> Result<String> {
        self.process.quit()
    }

    /// Creates an error of the caller that contains QEMU's output.
    #[must_use]
    pub fn failed(&self, what: impl std::fmt::Display) -> EmulatorError {
        self.process.failed(what)
    }

    /// Returns the output of QEMU, and of the image through semihosting, on standard error.
    #[must_use]
    pub fn errors(&self) -> String {
        self.process.errors()
    }
}

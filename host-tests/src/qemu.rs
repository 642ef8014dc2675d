//! This module is the emulated board for tests: [`gyronet_tools::target::emulator`] with errors that end the test.

use crate::require::{self, Need};
use gyronet_tools::client::bus::SlcanBus;
use gyronet_tools::client::connection::Connection;
use gyronet_tools::client::device::Device;
use gyronet_tools::target::emulator::{self, Result};
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

/// The service line is on this USART.
pub const SERVICE: usize = 6;

/// A tester on the service line.
pub type Tester = Device<SlcanBus<Connection>>;

/// Checks for QEMU; without it reports that the test is skipped.
#[must_use]
pub fn available(test: &str) -> Option<()> {
    require::wants(test, Need::Qemu, emulator::available().map_err(|error| error.to_string()))
}

/// Controls an emulated board that runs an image. Each failure is a panic with QEMU's own message; each method is
/// described at that of the same name in [`emulator::Board`].
#[derive(Debug)]
pub struct Board(emulator::Board);

#[track_caller]
fn sure<T>(result: Result<T>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

#[expect(missing_docs, reason = "see the type")]
impl Board {
    #[must_use]
    pub fn boot(image: &Path, usarts: usize, arguments: &[&str]) -> Self {
        Self(sure(emulator::Board::boot(image, usarts, arguments)))
    }

    pub fn send(&mut self, n: usize, bytes: &[u8], limit: Duration) {
        sure(self.0.send(n, bytes, limit));
    }

    pub fn await_sent(&self, n: usize, limit: Duration, enough: impl FnMut(&[u8]) -> bool) {
        sure(self.0.await_sent(n, limit, enough));
    }

    #[must_use]
    pub fn lines(&self, n: usize, end: u8, count: usize, limit: Duration) -> Vec<Vec<u8>> {
        sure(self.0.lines(n, end, count, limit))
    }

    #[must_use]
    pub fn lines_until(
        &self,
        n: usize,
        end: u8,
        limit: Duration,
        enough: impl Fn(&[Vec<u8>]) -> bool,
    ) -> Vec<Vec<u8>> {
        sure(self.0.lines_until(n, end, limit, enough))
    }

    pub fn stall(&mut self, n: usize, stalled: bool) {
        sure(self.0.stall(n, stalled));
    }

    #[must_use]
    pub fn serve(&mut self, n: usize) -> SocketAddr {
        sure(self.0.serve(n))
    }

    /// Opens the service line of a board with [`SERVICE`] USARTs, once the image reads from it.
    #[must_use]
    pub fn device(&mut self, limit: Duration) -> Tester {
        self.send(SERVICE, b"\r", limit);
        let port = self.serve(SERVICE).to_string();
        Device::new(SlcanBus::open(&port, 0).expect("the harness listens"), &port)
    }

    pub fn word(&mut self, address: u32) -> u32 {
        sure(self.0.word(address))
    }

    pub fn exit_code(&mut self, limit: Duration) -> i32 {
        sure(self.0.exit_code(limit))
    }

    #[must_use]
    pub fn errors(&self) -> String {
        self.0.errors()
    }
}

//! A device is a board on a bus that is queried and configured over diagnosis (UDS on ISO-TP, see [`gyronet::uds`]).

mod access;
pub mod calibration;
pub mod error;
pub mod requests;
pub mod settings;
pub mod update;
pub mod upload;

pub use access::AccessState;

use super::bus::Bus;
use crate::signing::PrivateKey;
use embedded_can::{Frame, Id};
use error::{Code, DeviceError};
use gyronet::can::DataFrame;
use gyronet::can::diagnosis::DiagnosisIds;
use gyronet::service::message::Refusal;
use gyronet::uds::Nrc;
use gyronet::uds::isotp::{TIMEOUT_MS, Transport};
use gyronet::uds::signature::TRAILER;
use std::time::Duration;

/// Timeout of a response: longer than the standard's 50 ms, for lines that are slow or shared.
const RESPONSE: Duration = Duration::from_millis(TIMEOUT_MS as u64);
/// Timeout after "response pending": erasing a slot takes up to 4 s by the datasheet.
const PENDING: Duration = Duration::from_secs(8);
/// The longest time that the proof of a standstill takes after an erase, and the time between two tries.
const PROOF: Duration = Duration::from_secs(15);
const RETRY: Duration = Duration::from_millis(500);
/// Number of times that a request is sent before it fails.
const ATTEMPTS: u32 = 3;
const NEGATIVE: u8 = 0x7F;
/// Added to a service's number in a positive response.
const POSITIVE: u8 = 0x40;
/// Data identifier of the reason why the last request was refused.
const REFUSAL: [u8; 2] = [0x01, 0x0B];

pub struct Device<B> {
    bus: B,
    name: String,
    request: Id,
    response: Id,
    authority: Authority,
}

#[derive(Default)]
pub enum Authority {
    /// No proof; a board with a key refuses to be written.
    #[default]
    None,
    /// The private key, which answers challenges and signs.
    Key(PrivateKey),
    /// A signature of the content that is written.
    Signature([u8; TRAILER]),
}

impl<B: Bus> Device<B> {
    /// Creates a device with these CAN identifiers; `name` is the line's name in errors.
    pub fn with_ids(bus: B, name: &str, ids: &DiagnosisIds) -> Result<Self, DeviceError> {
        let [request, _, response] = ids.ids().map_err(DeviceError::Identifier)?;
        Ok(Self { bus, name: name.to_owned(), request, response, authority: Authority::None })
    }

    #[must_use]
    pub fn authorise(self, authority: Authority) -> Self {
        Self { authority, ..self }
    }

    /// Sends a request, up to three times, and returns the positive response without its first byte.
    pub fn ask(&mut self, request: &[u8]) -> Result<Vec<u8>, DeviceError> {
        let service = request.first().copied().unwrap_or_default();
        match self.exchange(request)? {
            Ok(response) => Ok(response),
            Err(code) => Err(match self.refusal()? {
                Some(refusal) => DeviceError::Refused(refusal),
                None => DeviceError::Negative { service, code: Code(code) },
            }),
        }
    }

    /// Sends a request as [`Self::ask`] does, and again while the vehicle is not proven to stand. After an erase, in which the
    /// board has missed its sensor, the proof takes seconds.
    pub(crate) fn ask_at_rest(&mut self, request: &[u8]) -> Result<Vec<u8>, DeviceError> {
        let until = self.bus.now() + PROOF;
        loop {
            match self.ask(request) {
                Err(DeviceError::Refused(Refusal::Moving)) if self.bus.now() < until => {
                    let next = self.bus.now() + RETRY;
                    while self.bus.now() < next {
                        self.bus.receive().map_err(|source| self.broken(source))?;
                    }
                }
                other => return other,
            }
        }
    }

    fn refusal(&mut self) -> Result<Option<Refusal>, DeviceError> {
        let [high, low] = REFUSAL;
        let Ok(response) = self.exchange(&[0x22, high, low])? else { return Ok(None) };
        let record = response.get(2..).unwrap_or_default();
        postcard::from_bytes(record).map_err(|_| DeviceError::Mismatch)
    }

    /// Returns the positive response, or the code of the negative response.
    fn exchange(&mut self, request: &[u8]) -> Result<Result<Vec<u8>, u8>, DeviceError> {
        for _ in 0..ATTEMPTS {
            if let Some(response) = self.attempt(request)? {
                return Ok(response);
            }
        }
        Err(DeviceError::Silence { name: self.name.clone() })
    }

    /// Sends a request once; returns `None` if no response arrives in time.
    fn attempt(&mut self, request: &[u8]) -> Result<Option<Result<Vec<u8>, u8>>, DeviceError> {
        let service = request.first().copied().unwrap_or_default();
        let mut transport = Transport::IDLE;
        if !transport.send(request) {
            return Err(DeviceError::TooLong);
        }
        let mut until = self.bus.now() + RESPONSE;
        let mut response = None;
        loop {
            let now = self.bus.now();
            // The cast wraps, as the transport expects.
            let milliseconds = now.as_millis() as u32;
            while let Some(data) = transport.next_frame(milliseconds) {
                let frame = DataFrame::new(self.request, &data).ok_or(DeviceError::TooLong)?;
                self.bus.send(&frame).map_err(|source| self.broken(source))?;
                transport.frames_left(milliseconds);
                until = until.max(now + RESPONSE);
            }
            if response.is_some() || now > until {
                return Ok(response);
            }
            for frame in self.bus.receive().map_err(|source| self.broken(source))? {
                if frame.id() != self.response {
                    continue;
                }
                transport.receive(frame.data(), milliseconds);
                until = until.max(now + RESPONSE);
                transport.answer(|message, _| match message {
                    [NEGATIVE, of, code] if *of == service => {
                        if *code == Nrc::RequestCorrectlyReceivedResponsePending as u8 {
                            until = now + PENDING;
                        } else {
                            response = Some(Err(*code));
                        }
                    }
                    [first, rest @ ..] if *first == service.wrapping_add(POSITIVE) => {
                        response = Some(Ok(rest.to_vec()));
                    }
                    // A late response to an earlier request.
                    _ => {}
                });
            }
        }
    }

    fn broken(&self, source: std::io::Error) -> DeviceError {
        DeviceError::Line { name: self.name.clone(), source }
    }
}

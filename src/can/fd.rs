//! One CAN FD frame in place of the three yaw messages: their payloads one after the other, each as it is sent alone, with its
//! own counter and CRC. A board joins the frames of a set before its controller.

use super::DataFrame;
use super::settings::Settings;
use embedded_can::{Frame, Id, StandardId};

/// Default identifier.
pub const FD_ID: u16 = 0x1A7;
/// Bytes of the frame.
pub const LENGTH: usize = 24;
/// Bit rate of the data, to which the controllers switch after the identifier, bit/s.
pub const DATA_BITS_PER_SECOND: u32 = 2_000_000;

/// Joins the three frames of a set, which an encoder sends one after the other.
#[derive(Debug, Clone, Copy)]
pub struct Joiner {
    /// Identifiers of the frame, and of rate, angle and detail.
    set: Option<(Id, [Id; 3])>,
    data: [u8; LENGTH],
    /// The part that comes next.
    next: usize,
}

impl Joiner {
    /// Creates a joiner; without [`super::config::YawSettings::fd`] all frames stay as they are.
    pub fn new(settings: &Settings) -> Self {
        let id = |raw| StandardId::new(raw).map(Id::Standard);
        let set = settings.yaw.and_then(|yaw| {
            let [rate, angle, detail] = yaw.ids.map(id);
            Some((id(yaw.fd?)?, [rate?, angle?, detail?]))
        });
        Self { set, data: [0; LENGTH], next: 0 }
    }

    /// Takes a frame, and returns identifier and data of what is to be sent now. Eight bytes are a classic frame. A set of
    /// which a part is missing is not sent.
    pub fn join<'a>(&'a mut self, frame: &'a DataFrame) -> Option<(Id, &'a [u8])> {
        let part =
            self.set.and_then(|(id, parts)| Some((id, parts.iter().position(|of| *of == frame.id())?)));
        let Some((id, part)) = part else { return Some((frame.id(), frame.data())) };
        if part != 0 && part != self.next {
            self.next = 0;
            return None;
        }
        let payloads = self.data.as_chunks_mut().0;
        *payloads.get_mut(part)? = *frame.padded();
        self.next = (part + 1) % payloads.len();
        (self.next == 0).then_some((id, &self.data))
    }
}

//! Defines a classic CAN data frame for code that does not depend on a driver's frame type.

use embedded_can::{Frame, Id};

/// A classic CAN data frame: identifier and up to eight bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DataFrame {
    id: Id,
    data: [u8; 8],
    len: u8,
}

impl DataFrame {
    /// Converts the frame to a driver's own type; `None` if that type cannot hold the frame.
    #[must_use]
    pub fn convert<F: Frame>(&self) -> Option<F> {
        F::new(self.id(), self.data())
    }
}

impl Frame for DataFrame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; 8];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Self { id: id.into(), data: bytes, len: data.len() as u8 })
    }

    /// Returns `None`: remote frames carry no data and are not supported.
    fn new_remote(_id: impl Into<Id>, _dlc: usize) -> Option<Self> {
        None
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        false
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        usize::from(self.len)
    }

    fn data(&self) -> &[u8] {
        self.data.get(..usize::from(self.len)).unwrap_or_default()
    }
}

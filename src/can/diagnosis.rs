//! These are the identifiers of diagnosis (ISO 15765-2, normal addressing).

use embedded_can::{ExtendedId, Id, StandardId};

/// Names the identifiers of diagnosis as a user writes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DiagnosisIds {
    /// All three have 29 bits, not 11.
    pub extended: bool,
    /// Requests to this board.
    pub request: u32,
    /// Requests to all.
    pub functional: u32,
    /// Frames of this board.
    pub response: u32,
}

impl DiagnosisIds {
    /// The first of ISO 15765-4.
    pub const DEFAULT: Self = Self { extended: false, request: 0x7E0, functional: 0x7DF, response: 0x7E8 };

    /// Returns the identifiers for requests to this board, requests to all, and frames of this board.
    ///
    /// # Errors
    /// The first identifier that has too many bits, or is there twice.
    pub fn ids(&self) -> Result<[Id; 3], u32> {
        let Self { extended, request, functional, response } = *self;
        let id = |raw: u32| match extended {
            true => ExtendedId::new(raw).map(Id::Extended).ok_or(raw),
            false => u16::try_from(raw).ok().and_then(StandardId::new).map(Id::Standard).ok_or(raw),
        };
        if functional == request || response == functional {
            return Err(functional);
        }
        if response == request { Err(response) } else { Ok([id(request)?, id(functional)?, id(response)?]) }
    }
}

//! Defines the CAN identifiers of diagnosis (ISO 15765-2, normal addressing).

use embedded_can::{ExtendedId, Id, StandardId};

/// The identifiers of diagnosis, as a user writes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DiagnosisIds {
    /// True if all three identifiers have 29 bits instead of 11.
    pub extended: bool,
    /// Identifier of requests to this board.
    pub request: u32,
    /// Identifier of functional requests, which address every ECU.
    pub functional: u32,
    /// Identifier of the frames that this board sends.
    pub response: u32,
}

impl DiagnosisIds {
    /// The first set of identifiers in ISO 15765-4.
    pub const DEFAULT: Self = Self { extended: false, request: 0x7E0, functional: 0x7DF, response: 0x7E8 };

    /// Returns the identifiers of physical and functional requests and responses, or a wrong or repeated one.
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

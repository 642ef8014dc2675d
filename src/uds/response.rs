//! Reads values from requests, writes values to responses, and maps refusals to negative response codes
//! (ISO 14229-1 A.1).

use super::isotp::MAX_MESSAGE;
use crate::service::message::Refusal;
use crate::store::StoreError;
use crate::store::firmware::FirmwareError;
use crate::store::slots::SlotError;
pub use automotive_diag::uds::UdsError as Nrc;
use heapless::Vec;
use serde::Serialize;
use serde::de::DeserializeOwned;

pub(super) type Response = Vec<u8, MAX_MESSAGE>;

pub(super) fn put(out: &mut Response, bytes: &[u8]) -> Result<(), Nrc> {
    out.extend_from_slice(bytes).map_err(|_| Nrc::ResponseTooLong)
}

/// Returns the bytes as an array if there are exactly `N`.
pub(super) fn exactly<const N: usize>(bytes: &[u8]) -> Result<[u8; N], Nrc> {
    bytes.try_into().map_err(|_| Nrc::IncorrectMessageLengthOrInvalidFormat)
}

/// Decodes a value in postcard's encoding; trailing bytes are an error.
pub(super) fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Nrc> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok(_) | Err(_) => Err(Nrc::IncorrectMessageLengthOrInvalidFormat),
    }
}

pub(super) fn put_record(out: &mut Response, record: &impl Serialize) -> Result<(), Nrc> {
    let start = out.len();
    let room = out.capacity();
    out.resize_default(room).map_err(|_| Nrc::ResponseTooLong)?;
    let written =
        postcard::to_slice(record, out.get_mut(start..).unwrap_or_default()).map(|bytes| bytes.len());
    out.truncate(start + written.as_ref().map_or(0, |len| *len));
    written.map(|_| ()).map_err(|_| Nrc::ResponseTooLong)
}

pub(super) fn nrc(refusal: Refusal) -> Nrc {
    match refusal {
        Refusal::Moving
        | Refusal::OtherTester
        | Refusal::Firmware(FirmwareError::NoBootLoader | FirmwareError::OnTrial)
        | Refusal::Store(StoreError::NoFlash)
        | Refusal::Slot(SlotError::NoFlash) => Nrc::ConditionsNotCorrect,
        Refusal::Firmware(FirmwareError::NoHead)
        | Refusal::Slot(SlotError::NotBegun | SlotError::Incomplete { .. }) => Nrc::RequestSequenceError,
        Refusal::Firmware(FirmwareError::Content)
        | Refusal::Store(StoreError::Flash(_) | StoreError::Full)
        | Refusal::Slot(
            SlotError::Flash(_) | SlotError::Empty | SlotError::NotAccepted(_) | SlotError::Blob(_),
        ) => Nrc::GeneralProgrammingFailure,
        Refusal::Locked => Nrc::SecurityAccessDenied,
        Refusal::Unsigned => Nrc::IncorrectMessageLengthOrInvalidFormat,
        Refusal::Answer | Refusal::Signature => Nrc::InvalidKey,
        Refusal::Slot(SlotError::Length(_)) => Nrc::UploadDownloadNotAccepted,
        // A value that this board does not take.
        _ => Nrc::RequestOutOfRange,
    }
}

//! Service 0x19 reports the trouble memory (ISO 14229-1 11.3).

use super::dtc::{Entry, Memory, bit};
use super::response::{Nrc, Response, exactly, put};
use automotive_diag::uds::DtcSubFunction;

pub(super) fn read(memory: &Memory, sub: u8, rest: &[u8], out: &mut Response) -> Result<(), Nrc> {
    let code = |code: u32| {
        let [_, a, b, c] = code.to_be_bytes();
        [a, b, c]
    };
    match DtcSubFunction::from_repr(sub) {
        Some(DtcSubFunction::ReportNumberOfDtcByStatusMask) => {
            let [mask] = exactly(rest)?;
            let matching = memory.entries().filter(|(_, entry)| entry.status & mask != 0).count();
            // The codes are those of SAE J2012-DA, with a failure type.
            put(out, &[bit::AVAILABLE, 0, 0, matching as u8])
        }
        Some(sub @ (DtcSubFunction::ReportDtcByStatusMask | DtcSubFunction::ReportSupportedDtc)) => {
            let mask = match sub {
                DtcSubFunction::ReportDtcByStatusMask => exactly(rest).map(|[mask]| Some(mask))?,
                _ => exactly(rest).map(|[]: [u8; 0]| None)?,
            };
            put(out, &[bit::AVAILABLE])?;
            let chosen = |status: u8| mask.is_none_or(|mask| status & mask != 0);
            for (trouble, entry) in memory.entries().filter(|(_, entry)| chosen(entry.status)) {
                put(out, &code(trouble.code))?;
                put(out, &[entry.status])?;
            }
            Ok(())
        }
        Some(DtcSubFunction::ReportDtcSnapshotRecordByDtcNumber) => {
            let entry = put_entry(memory, rest, out)?;
            if entry.status & bit::CONFIRMED == 0 {
                return Ok(());
            }
            // One record of two data identifiers.
            put(out, &[1, 2, 0x01, 0x04, entry.snapshot.status, entry.snapshot.faults, 0x01, 0x08])?;
            put(out, &entry.snapshot.tick.to_be_bytes())
        }
        Some(DtcSubFunction::ReportDtcExtendedDataRecordByDtcNumber) => {
            let entry = put_entry(memory, rest, out)?;
            put(out, &[1, entry.occurrences])
        }
        _ => Err(Nrc::SubFunctionNotSupported),
    }
}

/// Appends code and status of the trouble that a request names, with record number 1 or all; returns its entry.
fn put_entry<'m>(memory: &'m Memory, rest: &[u8], out: &mut Response) -> Result<&'m Entry, Nrc> {
    let [a, b, c, record] = exactly(rest)?;
    let code = u32::from_be_bytes([0, a, b, c]);
    let known = memory.entries().find(|(trouble, _)| trouble.code == code);
    let (_, entry) = known.filter(|_| matches!(record, 1 | 0xFF)).ok_or(Nrc::RequestOutOfRange)?;
    put(out, &[a, b, c, entry.status])?;
    Ok(entry)
}

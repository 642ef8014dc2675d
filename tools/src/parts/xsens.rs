//! MTData2 messages in single precision.

use gyronet::sample::ImuSample;
use gyronet::sensor::xsens::MtData2;

/// The six clipping bits of the status word.
pub const CLIPPED: u32 = 0x3F << 8;

/// Encodes a sample as a message. The sample's codes come from f32, so decoding gives the same codes.
pub fn message(number: usize, sample: &ImuSample) -> MtData2 {
    let message = MtData2::of(sample, number as u16);
    let clipped = if sample.validity.is_good() { 0 } else { CLIPPED };
    MtData2 { status: message.status.map(|status| status | clipped), ..message }
}

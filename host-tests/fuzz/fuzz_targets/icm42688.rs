//! Any bytes as packets of either kind.
#![no_main]

use gyronet::sensor::icm42688::packet::{Packet, Resolution};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    for resolution in [Resolution::Bits16, Resolution::Bits20] {
        for bytes in data.chunks(resolution.bytes()) {
            if let Ok(packet) = Packet::parse(resolution, bytes) {
                assert_eq!(Packet::parse(resolution, &packet.emit()), Ok(packet));
            }
        }
    }
});

//! These checksums belong to more than one part.

/// CRC-32/MPEG-2, as the KVH gyros send it: polynomial 04C11DB7, start FFFFFFFF, nothing
/// reflected, nothing inverted at the end. It is not the CRC-32 of zip and Ethernet. Over a
/// whole frame, its CRC included, it is 0.
///
/// A `static`, so that its table (1 KB of flash) is there once.
pub static CRC_32_MPEG_2: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_MPEG_2);

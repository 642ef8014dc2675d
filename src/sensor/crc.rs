//! Holds the checksums that several sensors share.

/// CRC-32/MPEG-2, as the KVH gyros send it: polynomial 04C11DB7, start FFFFFFFF, no reflection, no final
/// inversion. It differs from the CRC-32 of zip and Ethernet. Over a whole frame, its CRC included, the result is 0.
///
/// This is a `static`, so that an image contains the table (1 KB of flash) only once.
pub static CRC_32_MPEG_2: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_MPEG_2);

//! These checksums are used by more than one part.

/// Computes CRC-32/MPEG-2, as the KVH gyros send it: polynomial 04C11DB7, start FFFFFFFF, no reflection, no final
/// inversion. It is not the CRC-32 of zip and Ethernet. Over a whole frame, its CRC included, it is 0.
///
/// It is a `static`, so that an image contains its table (1 KB of flash) once.
pub static CRC_32_MPEG_2: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_MPEG_2);

//! Decompresses the zstd chunks of an MCAP file with `ruzstd`; the MCAP crate uses a C library.

use mcap::sans_io::decompressor::{DecompressResult, Decompressor};
use mcap::{McapError, McapResult};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use std::io::Read;

/// Length of the largest block with the headers of the block and of the frame, bytes.
const ENOUGH: usize = (128 << 10) + 3 + 18 + 4;

/// A decompressor that decodes one block at a time, so that no input can need more memory than its frame's window.
pub struct Zstd {
    decoder: FrameDecoder,
    in_frame: bool,
}

impl Zstd {
    pub fn new() -> Self {
        Self { decoder: FrameDecoder::new(), in_frame: false }
    }
}

impl Decompressor for Zstd {
    fn next_read_size(&self) -> usize {
        ENOUGH
    }

    fn decompress(&mut self, src: &[u8], dst: &mut [u8]) -> McapResult<DecompressResult> {
        let damaged = |error: &dyn std::fmt::Display| McapError::DecompressionError(error.to_string());
        let mut rest = src;
        if self.in_frame && self.decoder.is_finished() && self.decoder.can_collect() == 0 {
            self.in_frame = false;
        }
        if self.decoder.can_collect() == 0 && !src.is_empty() {
            if !self.in_frame {
                self.decoder.reset(&mut rest).map_err(|error| damaged(&error))?;
                self.in_frame = true;
            }
            self.decoder
                .decode_blocks(&mut rest, BlockDecodingStrategy::UptoBlocks(1))
                .map_err(|error| damaged(&error))?;
        }
        let wrote = if self.in_frame { self.decoder.read(dst).map_err(|error| damaged(&error))? } else { 0 };
        Ok(DecompressResult { consumed: src.len() - rest.len(), wrote })
    }

    fn reset(&mut self) -> McapResult<()> {
        *self = Self::new();
        Ok(())
    }

    fn name(&self) -> &'static str {
        "zstd"
    }
}

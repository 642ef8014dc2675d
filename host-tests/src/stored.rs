//! The flash of a board before it starts: the library's own store writes to the mock of the F405's flash, and the
//! content is copied into the virtual board's.

use crate::flash::{F405, Flash, Region};
use crate::noise::Noise;
use embedded_storage::nor_flash::NorFlash;
use gyronet::model::blob::CRC;
use gyronet::model::weights;
use gyronet::store::firmware::{LABEL, LABEL_SIZE, Label, MAX_IMAGE, Trailer, activate};
use gyronet::store::layout::{self, FLASH_BASE, SLOT_SIZE};
use gyronet::store::{Accepted, Record, Slot, Store, StoreError, Upload};

pub fn open(flash: &Flash) -> Result<Store<Region>, StoreError> {
    Store::open(Region::new(flash, layout::STORE), 0)
}

/// The checksum at the end of a weight file.
pub fn crc(file: &[u8]) -> u32 {
    u32::from_le_bytes(*file.last_chunk().expect("a checksum"))
}

pub fn slots(flash: &F405) -> [&[u8]; 2] {
    let bytes = &flash.bytes()[layout::SLOTS.start as usize..layout::SLOTS.end as usize];
    bytes.split_at(SLOT_SIZE).into()
}

/// Uploads a file to a slot, checks it and accepts it, as the board does.
pub fn upload(flash: &Flash, slot: Slot, file: &[u8]) -> Result<(), String> {
    let text = |error: &dyn std::error::Error| error.to_string();
    let mut region = Region::new(flash, 0..1 << 20);
    let mut upload = Upload::begin(&mut region, slot, file.len() as u32).map_err(|e| text(&e))?;
    for block in file.chunks(256) {
        upload.block(&mut region, block).map_err(|e| text(&e))?;
    }
    let crc = upload.verify(slots(&flash.borrow())).map_err(|e| text(&e))?.1.crc;
    let mut store = open(flash).map_err(|e| text(&e))?;
    let accepted = store.get::<Accepted>().map_err(|e| text(&e))?.unwrap_or(Accepted::NONE);
    store.set(&accepted.with(slot, crc)).map_err(|e| text(&e))
}

/// The built-in weights with these bits of the output bias flipped (within its bits 8 to 15), and a valid
/// checksum.
pub fn other_weights(bits: u8) -> Vec<u8> {
    let mut file = weights::GYRONET.0.to_vec();
    let end = file.len() - 4;
    // After that byte come two more bytes of the bias, and the multiplier.
    file[end - (2 + 1 + 4)] ^= bits;
    let crc = CRC.checksum(&file[..end]);
    file[end..].copy_from_slice(&crc.to_le_bytes());
    file
}

/// An image of firmware: a label among noise.
pub fn image(label: &Label, seed: u64) -> Vec<u8> {
    let mut noise = Noise::new(seed);
    let mut image: Vec<u8> = (0..2_048).map(|_| noise.byte()).collect();
    image[LABEL..LABEL + LABEL_SIZE].copy_from_slice(&label.bytes());
    image
}

/// Writes an image to an erased slot as a programmer does.
pub fn flash_image(flash: &Flash, slot: Slot, image: &[u8]) {
    let trailer =
        Trailer { is_confirmed: true, ..Trailer::new(image.len() as u32, CRC.checksum(image), 0, 1) };
    let mut region = Region::new(flash, 0..1 << 20);
    let start = slot.firmware().start;
    let written = region.write(start, image).and(region.write(start + MAX_IMAGE, &trailer.bytes()));
    written.expect("it was erased");
}

/// Writes an image to a slot and has it tried at the next start, as the device does; `None` where that fails.
pub fn install<F: NorFlash>(flash: &mut F, slot: Slot, image: &[u8], number: u32) -> Option<()> {
    let mut upload = Upload::firmware(flash, slot, image.len() as u32).ok()?;
    for block in image.chunks(256) {
        upload.block(flash, block).ok()?;
    }
    activate(flash, slot, &Trailer::new(image.len() as u32, CRC.checksum(image), 0, number)).ok()
}

#[derive(Debug, Default)]
pub struct Stored(Flash);

impl Stored {
    pub fn record<R: Record>(self, record: &R) -> Self {
        open(&self.0).and_then(|mut store| store.set(record)).expect("it is stored");
        self
    }

    /// Accepts a weight file; the last one is used.
    pub fn weights(self, slot: Slot, file: &[u8]) -> Self {
        upload(&self.0, slot, file).expect("it is accepted");
        self
    }

    pub fn damaged(self, offset: u32, bits: u8) -> Self {
        self.0.borrow_mut().damage(offset as usize, bits);
        self
    }

    pub fn write_to(&self, board: &mut crate::board::Board) {
        let flash = self.0.borrow();
        for range in [layout::STORE, layout::SLOTS] {
            let bytes = &flash.bytes()[range.start as usize..range.end as usize];
            board.patch(crate::board::At::Address(FLASH_BASE + range.start), bytes);
        }
    }
}

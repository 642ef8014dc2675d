//! Makes of the linked images what a board gets: an ELF file with the boot loader for a programmer, and an update for
//! diagnosis.
//!
//! An update holds the image for either slot, since an image runs only where it was linked for. It begins with the head
//! that is signed ([`gyronet::uds::update`]).

use super::bench::{self, BenchError, TARGET};
use crate::client::device::update::Update;
use crate::drive::error::{DataError, read};
use gyronet::model::blob::CRC;
use gyronet::store::firmware::{LABEL, LABEL_SIZE, Label, MAX_IMAGE, Trailer};
use gyronet::store::layout::{BOOT_SIZE, FLASH_BASE};
use gyronet::store::{Slot, banks};
use object::{Object, ObjectSection, ObjectSegment};
use std::ops::Range;
use std::path::Path;

#[derive(Debug, thiserror::Error)]
pub enum FirmwareFileError {
    #[error(transparent)]
    Build(#[from] BenchError),
    #[error(transparent)]
    File(#[from] DataError),
    #[error("not a linked image: {0}")]
    Format(#[from] object::Error),
    #[error("no board {name}, but {}", boards.join(", "))]
    Board { name: String, boards: Vec<String> },
    #[error("the image has no {0}")]
    Lacks(&'static str),
}

/// The board whose flash has two banks that swap ([`gyronet::store::banks`]): one image fits both slots.
pub const NUCLEO: &str = "nucleo-h563zi";

/// Returns the boards for which the images are built: those with an STM32F405 in the manifest of the images, and
/// [`NUCLEO`].
fn boards() -> Vec<String> {
    let manifest = std::fs::read_to_string(bench::workspace().join("src/bin/Cargo.toml")).unwrap_or_default();
    let features = manifest.lines().take_while(|line| !line.starts_with("# An emulated"));
    let boards = features.filter_map(|line| line.strip_suffix(" = [\"stm32f405\"]"));
    boards.chain([NUCLEO]).map(str::to_owned).collect()
}

pub struct Linked {
    /// The boot loader.
    pub boot: Vec<u8>,
    /// The image for slots A and B, if it was linked for both, as ELF files.
    pub images: Vec<Vec<u8>>,
    swaps: bool,
}

impl Linked {
    /// Builds the boot loader, and the image for the first `slots` slots, for a board, named by its features.
    pub fn build(board: &str, slots: usize, folder: &Path) -> Result<Self, FirmwareFileError> {
        let package = if board == NUCLEO {
            bench::workspace().join("examples/nucleo")
        } else {
            std::path::absolute(board).unwrap_or_default()
        };
        if package.join("Cargo.toml").is_file() {
            let manifest = String::from_utf8_lossy(&read(&package.join("Cargo.toml"))?).into_owned();
            let name = manifest.lines().find_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"'));
            let built = bench::build_banks(&package, folder)?;
            let image = read(&built.join(name.unwrap_or_default()))?;
            return Ok(Self { boot: read(&built.join("boot"))?, images: vec![image; slots], swaps: true });
        }
        let boards = boards();
        if !boards.iter().any(|known| known == board) {
            return Err(FirmwareFileError::Board { name: board.to_owned(), boards });
        }
        let build = |features: &str, image: &str| -> Result<Vec<u8>, FirmwareFileError> {
            Ok(read(&bench::build_for((features, TARGET), image, folder)?)?)
        };
        let boot = build(board, "boot")?;
        let features = [board.to_owned(), format!("{board},slot-b")];
        let images = features.iter().take(slots).map(|features| build(features, "coprocessor"));
        Ok(Self { boot, images: images.collect::<Result<_, _>>()?, swaps: false })
    }

    pub fn boot_loader(&self) -> Result<Vec<u8>, FirmwareFileError> {
        flat(&self.boot, FLASH_BASE..FLASH_BASE + BOOT_SIZE)
    }

    /// Returns the update for diagnosis, of the image for both slots.
    pub fn update(&self) -> Result<Update, FirmwareFileError> {
        let [a, b] = &self.images[..] else { return Err(FirmwareFileError::Lacks("slot B")) };
        let images = [self.image(a, Slot::A)?, self.image(b, Slot::B)?];
        Ok(Update::new(label(&images[0])?, images))
    }

    /// Returns the ELF file for a programmer: boot loader and confirmed image in slot A, none in slot B.
    pub fn for_programmer(&self) -> Result<Vec<u8>, FirmwareFileError> {
        let mut elf = self.images.first().ok_or(FirmwareFileError::Lacks("slot A"))?.clone();
        let image = self.image(&elf, Slot::A)?;
        let trailer =
            Trailer { is_confirmed: true, ..Trailer::new(image.len() as u32, CRC.checksum(&image), 0, 1) };
        let boot = self.boot_loader()?;
        let parts = if self.swaps {
            vec![
                (".boot_a", boot.clone()),
                (".boot_b", boot),
                (".trailer_a", banks::spread(&trailer.bytes()).to_vec()),
            ]
        } else {
            vec![(".boot", boot), (".trailer_a", trailer.bytes().to_vec())]
        };
        for (name, bytes) in parts {
            let place =
                object::File::parse(&*elf)?.section_by_name(name).and_then(|section| section.file_range());
            let (start, _) = place.ok_or(FirmwareFileError::Lacks("room for the boot loader"))?;
            elf[start as usize..][..bytes.len()].copy_from_slice(&bytes);
        }
        Ok(elf)
    }

    /// Returns the bytes of an image that was linked for a slot, whole words; what is not linked is erased.
    fn image(&self, elf: &[u8], slot: Slot) -> Result<Vec<u8>, FirmwareFileError> {
        let start = FLASH_BASE + if self.swaps { banks::IMAGE } else { slot.firmware().start };
        let image = flat(elf, start..start + MAX_IMAGE)?;
        label(&image).map(|_| image)
    }
}

pub fn label(image: &[u8]) -> Result<Label, FirmwareFileError> {
    let bytes = image.get(LABEL..).and_then(|rest| rest.first_chunk::<LABEL_SIZE>());
    bytes.and_then(Label::parse).ok_or(FirmwareFileError::Lacks("label"))
}

/// Returns what an ELF file puts into a range of addresses, up to its last byte, whole words.
fn flat(elf: &[u8], range: Range<u32>) -> Result<Vec<u8>, FirmwareFileError> {
    let mut bytes = Vec::new();
    // An image's sections are in the segments at their load addresses.
    let file = object::read::elf::ElfFile32::<object::Endianness>::parse(elf)?;
    for segment in file.segments() {
        let at = segment.elf_program_header().p_paddr.get(object::Endianness::Little);
        let data = segment.data()?;
        if range.contains(&at) && !data.is_empty() {
            let (start, len) = ((at - range.start) as usize, data.len());
            bytes.resize(bytes.len().max((start + len).next_multiple_of(4)), 0xFF);
            bytes[start..start + len].copy_from_slice(data);
        }
    }
    Ok(bytes)
}

//! Flash of two banks that swap: power cuts at every operation while records are stored and copied, and while firmware is
//! downloaded, tried, confirmed and rolled back.

use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind as Kind, ReadNorFlash};
use gyronet::store::banks::{BANK, Banks, QUAD, Records, SECTOR, Slots};
use gyronet::store::firmware::{Label, Trailer, confirm, select};
use gyronet::store::{Configuration, Slot, Store};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::stored::{image, install};
use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Quad {
    Erased,
    Written([u8; QUAD]),
    /// Its code does not fit.
    Torn,
}

#[derive(Debug, Clone)]
struct Part {
    quads: Vec<Quad>,
    is_swapped: bool,
    operations: u64,
    /// The operation at which the power is cut, and whether before, in the middle or after.
    cut: Option<(u64, u64)>,
    noise: Noise,
}

/// What all users of a part share.
#[derive(Debug, Clone)]
struct Flash(Rc<RefCell<Part>>);

impl Flash {
    fn blank() -> Self {
        let quads = vec![Quad::Erased; 2 * BANK as usize / QUAD];
        Self(Rc::new(RefCell::new(Part {
            quads,
            is_swapped: false,
            operations: 0,
            cut: None,
            noise: Noise::new(563),
        })))
    }

    fn copy(&self) -> Self {
        Self(Rc::new(RefCell::new(self.0.borrow().clone())))
    }

    fn swap(&self, to: Slot) {
        self.0.borrow_mut().is_swapped = to == Slot::B;
    }

    fn at(&self, offset: u32) -> usize {
        (if self.is_swapped() { offset ^ BANK } else { offset }) as usize / QUAD
    }

    /// Makes each quad-word of a range the new one, or the old one or a torn one where the power is cut.
    fn operate(&self, offset: u32, new: &[Quad]) -> Result<(), Kind> {
        let at = self.at(offset);
        let part = &mut *self.0.borrow_mut();
        part.operations += 1;
        let kind = part.cut.map_or(3, |(cut, kind)| match part.operations.cmp(&cut) {
            std::cmp::Ordering::Less => 3,
            std::cmp::Ordering::Equal => kind,
            std::cmp::Ordering::Greater => 0,
        });
        for (place, new) in part.quads[at..].iter_mut().zip(new) {
            match kind {
                0 => {}
                1 if new != place => {
                    *place = [*place, *new, Quad::Torn][part.noise.int(0, 2) as usize];
                }
                _ => *place = *new,
            }
        }
        if kind == 3 { Ok(()) } else { Err(Kind::Other) }
    }
}

impl Banks for Flash {
    fn is_swapped(&self) -> bool {
        self.0.borrow().is_swapped
    }

    fn mapped(&self, _: Range<u32>) -> &[u8] {
        unreachable!("it is not used here")
    }

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Kind> {
        let part = self.0.borrow();
        for (at, byte) in (offset..).zip(bytes) {
            *byte = match part.quads[self.at(at)] {
                Quad::Erased => 0xFF,
                Quad::Written(quad) => quad[at as usize % QUAD],
                Quad::Torn => return Err(Kind::Other),
            };
        }
        Ok(())
    }

    fn erase(&mut self, sector: u32) -> Result<(), Kind> {
        assert_eq!(sector % SECTOR, 0);
        self.operate(sector, &[Quad::Erased; SECTOR as usize / QUAD])
    }

    fn write(&mut self, at: u32, quad: &[u8; QUAD]) -> Result<(), Kind> {
        assert_eq!(self.0.borrow().quads[self.at(at)], Quad::Erased, "{at:#x} is programmed twice");
        self.operate(at, &[Quad::Written(*quad)])
    }
}

/// Does an act with a cut at each of its operations, and passes what is left to `check`.
fn every_cut(name: &str, before: &Flash, act: &dyn Fn(&Flash), check: &dyn Fn(&Flash, &str)) -> u64 {
    let whole = before.copy();
    act(&whole);
    let [from, to] = [before, &whole].map(|flash| flash.0.borrow().operations);
    assert!(to > from, "{name}");
    for (operation, kind) in (from + 1..=to).flat_map(|operation| [0, 1, 1, 2].map(|kind| (operation, kind)))
    {
        let flash = before.copy();
        flash.0.borrow_mut().cut = Some((operation, kind));
        act(&flash);
        flash.0.borrow_mut().cut = None;
        check(&flash, &format!("{name}: kind {kind} at operation {operation} of {from} to {to}"));
    }
    check(&whole, name);
    4 * (to - from)
}

fn settings(latitude: f32) -> Configuration {
    Configuration { latitude_deg: Some(latitude), ..Configuration::DEFAULT }
}

/// Starts, and returns the latitude that is stored; `None` if a cut ends that.
fn stored(flash: &Flash) -> Option<f32> {
    let mut store = Store::open(Records::open(flash.clone()).ok()?, 0).ok()?;
    store.get::<Configuration>().ok()??.latitude_deg
}

fn store(flash: &Flash, latitude: f32) {
    let store = Records::open(flash.clone()).ok().and_then(|records| Store::open(records, 0).ok());
    let _ = store.map(|mut store| store.set(&settings(latitude)));
}

/// What is stored is found by the image of either bank, whichever way the banks have swapped before and after a cut.
#[test]
fn the_newest_records_are_found_after_a_cut_of_a_store_or_of_a_copy() {
    let flash = Flash::blank();
    assert_eq!(stored(&flash), None);
    let (mut cuts, mut running) = (0, Slot::A);
    for round in 1..4 {
        let (old, new) = (round as f32, round as f32 + 1.0);
        if round == 1 {
            store(&flash, old);
        }
        let finds = |flash: &Flash, at: &str, allowed: &[f32]| {
            for slots in Slot::ALL.into_iter().flat_map(|first| Slot::ALL.map(|second| [first, second])) {
                let flash = flash.copy();
                let found = slots.map(|slot| {
                    flash.swap(slot);
                    stored(&flash)
                });
                assert!(found[0].is_some_and(|found| allowed.contains(&found)), "{at}: {found:?}");
                assert_eq!(found[0], found[1], "{at}");
            }
        };
        cuts += every_cut("store", &flash, &|flash| store(flash, new), &|flash, at| {
            finds(flash, at, &[old, new]);
        });
        store(&flash, new);
        running = running.other();
        flash.swap(running);
        cuts += every_cut("copy", &flash, &|flash| _ = stored(flash), &|flash, at| finds(flash, at, &[new]));
        assert_eq!(stored(&flash), Some(new));
    }
    println!("{cuts} cuts");
    assert!(cuts > 1_200, "{cuts}");
}

const LABEL: Label = Label::new([1, 0, 0], "a board");

/// Installs an image in the upper bank.
fn download(flash: &Flash, seed: u64, number: u32) -> Option<()> {
    let mut slots = Slots(flash.clone());
    let slot = slots.lower().other();
    install(&mut slots, slot, &image(&LABEL, seed), number)
}

/// Starts as the boot loader does, and returns the slot that runs; `None` if a cut ends that.
fn start(flash: &Flash, has_failed: bool) -> Option<Slot> {
    let slot = select(&mut Slots(flash.clone()), has_failed)?;
    flash.swap(slot);
    Some(slot)
}

fn holds(flash: &Flash, seeds: &[u64]) -> bool {
    let (mut slots, mut bytes) = (Slots(flash.clone()), Vec::new());
    seeds.iter().any(|seed| {
        let image = image(&LABEL, *seed);
        bytes.resize(image.len(), 0);
        let start = slots.lower().firmware().start;
        slots.read(start, &mut bytes).is_ok() && bytes == image
    })
}

#[test]
fn an_image_that_is_whole_starts_after_a_cut_whichever_bank_is_in_front() {
    let flash = Flash::blank();
    flash.swap(Slot::B);
    download(&flash, 1, 1).expect("no cut");
    assert_eq!(start(&flash, false), Some(Slot::A));
    assert!(confirm(&mut Slots(flash.clone()), Slot::A));
    let starts = |flash: &Flash, at: &str| {
        // A change of the option bytes that was cut leaves either bank in front.
        for (front, has_failed) in Slot::ALL.into_iter().flat_map(|slot| [(slot, false), (slot, true)]) {
            let flash = flash.copy();
            flash.swap(front);
            let first = start(&flash, false).unwrap_or_else(|| panic!("{at}: nothing starts"));
            assert!(holds(&flash, &[1, 2, 3]), "{at}: {first} is not whole");
            let second = start(&flash, has_failed).unwrap_or_else(|| panic!("{at}: nothing starts again"));
            assert!(holds(&flash, &[1, 2, 3]), "{at}: {second} is not whole");
            let mut slots = Slots(flash.clone());
            let trailer = Trailer::read(&mut slots, second).expect("it was started");
            assert!(trailer.is_confirmed || confirm(&mut slots, second), "{at}");
            assert!(download(&flash, 77, trailer.number + 1).is_some(), "{at}");
            assert_eq!(start(&flash, true), Some(second.other()), "{at}");
        }
    };
    let mut cuts = every_cut("download", &flash, &|flash| _ = download(flash, 2, 2), &starts);
    download(&flash, 2, 2).expect("no cut");
    cuts += every_cut("start on trial", &flash, &|flash| _ = start(flash, true), &starts);
    let tried = flash.copy();
    assert_eq!(start(&tried, true), Some(Slot::B));
    cuts += every_cut("rollback", &tried, &|flash| _ = start(flash, true), &starts);
    cuts +=
        every_cut("confirmation", &tried, &|flash| _ = confirm(&mut Slots(flash.clone()), Slot::B), &starts);
    assert!(confirm(&mut Slots(tried.clone()), Slot::B));
    cuts += every_cut("download over the older one", &tried, &|flash| _ = download(flash, 3, 3), &starts);
    println!("{cuts} cuts");
    assert!(cuts > 400, "{cuts}");
}

#[test]
fn only_the_slot_that_does_not_run_is_written() {
    let flash = Flash::blank();
    let mut slots = Slots(flash.clone());
    for front in Slot::ALL {
        flash.swap(front);
        let Range { start, end } = front.firmware();
        assert_eq!(slots.write(start, &[0; 16]), Err(Kind::OutOfBounds));
        assert_eq!(slots.erase(start, end), Err(Kind::OutOfBounds));
        let Range { start, end } = front.other().firmware();
        assert_eq!(slots.erase(start, end - 1), Err(Kind::OutOfBounds));
        assert_eq!(slots.write(end - 4, &[0; 8]), Err(Kind::OutOfBounds));
        assert_eq!(slots.write(start + 4, &[0; 16]), Err(Kind::NotAligned));
        assert_eq!(slots.write(0x1_0000, &[0; 4]), Err(Kind::OutOfBounds));
    }
    assert_eq!(flash.0.borrow().operations, 0);
    let mut records = Records::open(flash).expect("no cut");
    assert_eq!(records.write(0x4000, &[0; 4]), Err(Kind::OutOfBounds));
    assert_eq!(records.erase(0, 0x1000), Err(Kind::NotAligned));
    records.write(0, &[1; 4]).expect("it is erased");
    assert_eq!(records.write(0, &[3; 4]), Err(Kind::Other), "a word becomes zero, or stays");
    records.write(0, &[0; 4]).expect("any word becomes zero");
}

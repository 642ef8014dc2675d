//! Power cuts at every access to the flash while firmware is downloaded, tried, confirmed and rolled back: an image that
//! is whole starts, always.

use embedded_storage::nor_flash::NorFlash;
use gyronet::store::Slot;
use gyronet::store::firmware::{self, Label, MAX_IMAGE, Trailer, confirm, select};
use gyronet_host_tests::flash::{Cut, Flash, Region, shared};
use gyronet_host_tests::stored::{flash_image, image, install};

const LABEL: Label = Label::new([1, 0, 0], "a board");
type Step = fn(&Flash);

fn region(flash: &Flash) -> Region {
    Region::new(flash, 0..1 << 20)
}

fn update(flash: &Flash, slot: Slot, seed: u64, number: u32) -> Option<()> {
    install(&mut region(flash), slot, &image(&LABEL, seed), number)
}

fn start(flash: &Flash, has_failed: bool) -> Option<Slot> {
    select(&mut region(flash), has_failed)
}

fn holds(flash: &Flash, slot: Slot, seeds: &[u64]) -> bool {
    let start = slot.firmware().start as usize;
    seeds.iter().any(|seed| {
        let image = image(&LABEL, *seed);
        flash.borrow().bytes()[start..start + image.len()] == image[..]
    })
}

/// Cuts the power at each operation of a step, and checks what starts then: with a supply that stays, when the image on
/// trial works, and when it does not.
fn every_cut(name: &str, before: &Flash, step: Step, seeds: &[u64]) -> usize {
    let whole = shared(before.borrow().clone());
    step(&whole);
    let operations = whole.borrow().operations() - before.borrow().operations();
    let mut cuts = 0;
    for (after, cut) in (0..operations).flat_map(|after| Cut::ALL.map(|cut| (after, cut))) {
        let at = format!("{name}: {cut:?} at operation {after} of {operations}");
        let flash = shared(before.borrow().clone());
        flash.borrow_mut().cut_after(after, cut);
        step(&flash);
        assert!(flash.borrow_mut().restore(), "{at}: the power was cut");
        cuts += 1;
        let torn = flash.borrow().clone();
        for has_failed in [false, true] {
            let flash = shared(torn.clone());
            let first = start(&flash, false).unwrap_or_else(|| panic!("{at}: nothing starts"));
            assert!(holds(&flash, first, seeds), "{at}: {first} is not whole");
            let second = start(&flash, has_failed).unwrap_or_else(|| panic!("{at}: nothing starts again"));
            assert!(holds(&flash, second, seeds), "{at}: {second} is not whole");
            // What runs is confirmed, or confirms itself, and stays.
            let trailer = Trailer::read(&mut region(&flash), second).expect("it was started");
            assert!(trailer.is_confirmed || confirm(&mut region(&flash), second), "{at}");
            assert_eq!([true, false].map(|failed| start(&flash, failed)), [Some(second); 2], "{at}");
            // The next update works.
            let spare = second.other();
            assert!(update(&flash, spare, 77, trailer.number + 1).is_some(), "{at}");
            assert_eq!(start(&flash, true), Some(spare), "{at}");
        }
    }
    cuts
}

/// A flash on which these steps were taken.
fn after(steps: &[Step]) -> Flash {
    let flash = Flash::default();
    flash_image(&flash, Slot::A, &image(&LABEL, 1));
    steps.iter().for_each(|step| step(&flash));
    flash
}

#[test]
fn an_image_that_is_whole_starts_after_a_cut_of_download_trial_confirmation_and_rollback() {
    let download: Step = |flash| _ = update(flash, Slot::B, 2, 2);
    let begin_trial: Step = |flash| _ = start(flash, true);
    let confirmed: Step = |flash| _ = confirm(&mut region(flash), Slot::B);
    let rolled_back: Step = |flash| _ = start(flash, true);
    let again: Step = |flash| _ = update(flash, Slot::A, 3, 3);
    let once_more: Step = |flash| _ = update(flash, Slot::B, 3, 2);
    let cases: [(&str, &[Step], Step); 6] = [
        ("download", &[], download),
        ("start on trial", &[download], begin_trial),
        ("confirmation", &[download, begin_trial], confirmed),
        ("rollback", &[download, begin_trial], rolled_back),
        ("download over the older image", &[download, begin_trial, confirmed], again),
        ("download over a failed image", &[download, begin_trial, rolled_back], once_more),
    ];
    let mut all = 0;
    for (name, steps, step) in cases {
        let cuts = every_cut(name, &after(steps), step, &[1, 2, 3]);
        println!("{name}: {cuts} cuts");
        all += cuts;
    }
    println!("{all} cuts in all");
    assert!(all > 7_000, "{all}");
}

/// An erase that is cut leaves no words that look like a trailer, however small the image is.
#[test]
fn no_mixture_of_a_cut_erase_is_a_trailer() {
    let flash = after(&[|flash| _ = update(flash, Slot::B, 2, 2)]);
    let before = flash.borrow().clone();
    for round in 0..64u64 {
        for cut in [Cut::Anywhere, Cut::Zeros, Cut::Front] {
            let flash = shared(before.clone());
            // Other torn words in each round.
            for _ in 0..round {
                flash.borrow_mut().cut_after(0, Cut::Front);
                let _ = region(&flash).write(0x1_0000, &[0; 4]);
                flash.borrow_mut().restore();
            }
            flash.borrow_mut().cut_after(3, cut);
            assert!(firmware::erase(&mut region(&flash), Slot::B).is_err());
            flash.borrow_mut().restore();
            assert_eq!(Trailer::read(&mut region(&flash), Slot::B), None, "{cut:?} {round}");
            assert_eq!(start(&flash, false), Some(Slot::A));
        }
    }
}

#[test]
fn a_trial_that_the_watchdog_has_ended_is_over() {
    let flash = Flash::default();
    assert!(update(&flash, Slot::A, 1, 1).is_some() && start(&flash, false) == Some(Slot::A));
    assert!(confirm(&mut region(&flash), Slot::A));
    // Its last block is a short one.
    let short = image(&LABEL, 2);
    assert!(install(&mut region(&flash), Slot::B, &short[..short.len() - 100], 2).is_some());
    assert_eq!(start(&flash, true), Some(Slot::B), "what failed was not on trial");
    assert_eq!([true, false].map(|has_failed| start(&flash, has_failed)), [Some(Slot::A); 2]);
}

#[test]
fn a_trailer_of_an_image_longer_than_its_slot_is_none() {
    for (length, is_read) in [(MAX_IMAGE, true), (MAX_IMAGE + 4, false)] {
        let flash = Flash::default();
        let trailer = Trailer::new(length, 0, 0, 1);
        firmware::activate(&mut region(&flash), Slot::B, &trailer).expect("an erased flash");
        assert_eq!(Trailer::read(&mut region(&flash), Slot::B).is_some(), is_read, "{length}");
    }
}

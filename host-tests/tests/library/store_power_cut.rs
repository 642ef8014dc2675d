//! Power cuts at every operation of a configuration write, a write of what was learnt, a change of the key and a weight
//! upload, on a flash with the F405's rules: the old or the new is always there, whole.

use gyronet::model::weights;
use gyronet::store::layout::{self, SLOT_SIZE};
use gyronet::store::slots::{Selection, WeightSource, select};
use gyronet::store::{Accepted, Access, Configuration, Learned, Record, Slot};
use gyronet::units::SpecificForce;
use gyronet_host_tests::flash::{Cut, F405, Flash, shared};
use gyronet_host_tests::stored::{crc, open, other_weights, slots, upload};

fn configuration(k: usize) -> Configuration {
    Configuration { latitude_deg: Some((k % 90) as f32), ..Configuration::DEFAULT }
}

fn access(k: usize) -> Access {
    Access { key: Some([k as u8; 32]), counter: k as u32, wrong: 0 }
}

fn learned(k: usize) -> Learned {
    let force = [SpecificForce(1 << 20), SpecificForce(k as i32), SpecificForce(-(k as i32))];
    Learned { specific_force: Some(force), ..Learned::NOTHING }
}

/// Flash contents before writes that need the most different operations: the first of all, a
/// plain one, and each that changes to another sector, until both sectors have been used twice.
fn starts<R: Record>(make: fn(usize) -> R) -> Vec<(F405, usize, u64)> {
    let flash = shared(F405::up_to(layout::STORE.end as usize));
    // The other records must survive too.
    let mut store = open(&flash).expect("an empty flash");
    store.set(&Accepted::NONE.with(Slot::B, 7)).expect("it is stored");
    store.set(&learned(1)).expect("it is stored");
    store.set(&configuration(1)).expect("it is stored");
    store.set(&access(1)).expect("it is stored");
    store.set(&make(1)).expect("it is stored");
    let (mut starts, mut plain, mut changes) = (Vec::new(), 0, 0);
    for k in 2..5_000 {
        let before = flash.borrow().clone();
        store.set(&make(k)).expect("it is stored");
        let operations = flash.borrow().operations() - before.operations();
        if k == 2 {
            plain = operations;
        }
        let change = operations.abs_diff(plain) > 2;
        changes += usize::from(change);
        if k == 2 || change {
            starts.push((before, k, operations));
        }
        if changes == 3 {
            return starts;
        }
    }
    panic!("only {changes} changes of sector in 5,000 writes");
}

fn whole<R: Record + PartialEq + std::fmt::Debug>(flash: &Flash, make: fn(usize) -> R, k: usize, at: &str) {
    let mut store = open(flash).unwrap_or_else(|error| panic!("{at}: {error}"));
    let found = store.get::<R>().unwrap_or_else(|error| panic!("{at}: {error}"));
    assert!(found == Some(make(k - 1)) || found == Some(make(k)), "{at}: {found:?}");
    let accepted = store.get::<Accepted>().unwrap_or_else(|error| panic!("{at}: {error}"));
    assert_eq!(accepted, Some(Accepted::NONE.with(Slot::B, 7)), "{at}");
    if R::KEY == Configuration::KEY {
        assert_eq!(store.get::<Learned>(), Ok(Some(learned(1))), "{at}");
    } else {
        assert_eq!(store.get::<Configuration>(), Ok(Some(configuration(1))), "{at}");
    }
    if R::KEY != Access::KEY {
        assert_eq!(store.get::<Access>(), Ok(Some(access(1))), "{at}");
    }
}

/// Tries every cut of every write, and after it every cut of the next attempt.
fn every_cut<R: Record + PartialEq + std::fmt::Debug>(name: &str, make: fn(usize) -> R) {
    let (mut cuts, mut second_cuts) = (0u64, 0u64);
    for (start, k, operations) in starts(make) {
        for cut in Cut::ALL {
            for after in 0..operations {
                let at = format!("{name} {k}, cut {cut:?} operation {after} of {operations}");
                let flash = shared(start.clone());
                let mut store = open(&flash).expect("it was whole");
                flash.borrow_mut().cut_after(after, cut);
                assert!(store.set(&make(k)).is_err(), "{at}: nobody can have heard of success");
                assert!(flash.borrow_mut().restore(), "{at}: the power was cut");
                cuts += 1;
                let torn = flash.borrow().clone();
                whole(&flash, make, k, &at);
                let started = shared(torn.clone());
                open(&started).and_then(|mut store| store.make_room()).expect("the flash answers");
                whole(&started, make, k, &at);
                assert!(open(&started).is_ok_and(|store| !store.damaged()), "{at}: a start mends it");
                // The next attempt works, and may be cut itself.
                let retry = |flash: &Flash| open(flash).and_then(|mut store| store.set(&make(k)));
                retry(&flash).unwrap_or_else(|error| panic!("{at}: {error}"));
                assert_eq!(open(&flash).and_then(|mut store| store.get::<R>()), Ok(Some(make(k))), "{at}");
                let retried = flash.borrow().operations() - torn.operations();
                // In turns: every fourth of them.
                for again in (after % 4..retried).step_by(4) {
                    let flash = shared(torn.clone());
                    flash.borrow_mut().cut_after(again, cut);
                    assert!(retry(&flash).is_err(), "{at}");
                    flash.borrow_mut().restore();
                    second_cuts += 1;
                    whole(&flash, make, k, &format!("{at}, then {again} of {retried}"));
                }
            }
        }
    }
    println!("{name}: {cuts} cut points tried, {second_cuts} more in the attempt after");
    assert!(cuts > 300, "{cuts}");
}

#[test]
fn a_cut_while_a_configuration_is_written_leaves_the_old_or_the_new_one() {
    every_cut("configuration", configuration);
}

#[test]
fn a_cut_while_a_calibration_is_written_leaves_the_old_or_the_new_one() {
    every_cut("calibration", learned);
}

#[test]
fn a_cut_while_a_key_is_replaced_leaves_the_old_or_the_new_one() {
    every_cut("key", access);
}

fn running(flash: &Flash) -> (WeightSource, u32) {
    let accepted = open(flash).and_then(|mut store| store.get::<Accepted>());
    let accepted = accepted.expect("records are whole").unwrap_or(Accepted::NONE);
    let flash = flash.borrow();
    let Selection { weights, source, .. } = select(&accepted, slots(&flash), &weights::DEFAULT.0, u32::MAX);
    (source, weights.expect("there always are some").crc)
}

#[test]
fn a_cut_during_the_upload_of_weights_leaves_the_accepted_ones() {
    let (old, new) = (weights::DEFAULT.0.to_vec(), other_weights(1));
    let flash = Flash::default();
    assert_eq!(running(&flash), (WeightSource::BuiltIn, crc(&old)));
    upload(&flash, Slot::A, &old).expect("it is accepted");
    assert_eq!(running(&flash), (WeightSource::Slot(Slot::A), crc(&old)));
    let start = flash.borrow().clone();
    upload(&flash, Slot::B, &new).expect("it is accepted");
    assert_eq!(running(&flash), (WeightSource::Slot(Slot::B), crc(&new)));
    let operations = flash.borrow().operations() - start.operations();
    let mut cuts = 0;
    // Once the slot is erased, only how many words are there matters, not how the cut tore one: every third word is cut
    // there, and the ways to cut take turns.
    let edge = |after| after < 4 || after + 64 > operations;
    for after in (0..operations).filter(|&after| edge(after) || after % 3 == 0) {
        let turn = Cut::ALL[after as usize % Cut::ALL.len()];
        for cut in Cut::ALL.into_iter().filter(|cut| edge(after) || *cut == turn) {
            let flash = shared(start.clone());
            flash.borrow_mut().cut_after(after, cut);
            assert!(upload(&flash, Slot::B, &new).is_err());
            assert!(flash.borrow_mut().restore());
            cuts += 1;
            let found = running(&flash);
            let done = (WeightSource::Slot(Slot::B), crc(&new));
            assert!(
                found == (WeightSource::Slot(Slot::A), crc(&old)) || found == done,
                "cut {cut:?} operation {after}: {found:?}"
            );
        }
    }
    println!("weight upload: {cuts} cut points tried in {operations} operations");
    // And over a slot that is named: the other one takes over, then the built-in weights do.
    flash.borrow_mut().damage(layout::SLOTS.start as usize + SLOT_SIZE + 90_000, 1);
    assert_eq!(running(&flash), (WeightSource::Slot(Slot::A), crc(&old)));
    flash.borrow_mut().damage(layout::SLOTS.start as usize + 5, 0x80);
    assert_eq!(running(&flash), (WeightSource::BuiltIn, crc(&old)));
}

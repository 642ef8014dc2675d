//! The power is cut at each access to the flash controller or the array, while the image stores a configuration or
//! takes a weight file over CAN. After each cut the board comes up with the old or the new value, whole.
//!
//! All that outlives a cut is the flash. Cuts that leave the same flash are therefore one case: the board is started
//! once for it.

use crate::common::{self, SLCAN, START};
use crate::service::{self, storing};
use gyronet::model::weights;
use gyronet::mounting::GyroMap;
use gyronet::service::message::{BLOCK, FlashState, Info, Origin};
use gyronet::store::layout::{FLASH_BASE, SLOTS, STORE};
use gyronet::store::slots::WeightSource;
use gyronet::store::{Calibration, Configuration, Mounting, Slot, UnitMap};
use gyronet_host_tests::board::{At, Board};
use gyronet_host_tests::stored::{Stored, crc, other_weights};
use std::collections::HashSet;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::time::{Duration, Instant};

/// The request that has the weights used.
const ACTIVATE: [u8; 4] = [0x31, 1, 0xFF, 0x01];
/// More accesses than anything here takes.
const MANY: usize = 1 << 30;
/// Board time after which a sensor that has never sent is known to be silent.
const SILENCE: Duration = Duration::from_secs(3);
/// Board time until nothing can happen any more: an erase of a slot.
const LIMIT: Duration = Duration::from_secs(3);
/// Times into a word's 16 us and into an erase of 250 ms (1 s for a slot) at which the power fails.
const INTO_WORD: [Duration; 1] = [Duration::from_micros(8)];
const INTO_ERASE: [Duration; 3] =
    [Duration::from_millis(1), Duration::from_millis(125), Duration::from_millis(240)];

/// A configuration that differs from another one at both ends of its record.
fn configuration(k: usize) -> Configuration {
    let mounting = Mounting { yaw_deg: k as f32 * 0.5, ..Mounting::default() };
    Configuration { latitude_deg: Some(k as f32 * 0.25), mounting, ..Configuration::DEFAULT }
}

fn calibration() -> Calibration {
    Calibration { unit: Some(UnitMap { gyro_map: GyroMap::IDENTITY, weights: 0 }) }
}

/// A board with accepted weights in slot A, a calibration, and so many configurations in its records, the last one in
/// force.
fn used(configurations: usize) -> Option<Board> {
    let mut board = common::unpowered()?;
    let stored = Stored::default().weights(Slot::A, &other_weights(2)).record(&calibration());
    (1..=configurations).fold(stored, |stored, k| stored.record(&configuration(k))).write_to(&mut board);
    board.power_on();
    // The sensor's silence is in the memory of troubles before anything is cut.
    board.run(SILENCE);
    let _ = board.events();
    Some(board)
}

/// The state before what is cut, and after it.
const BEFORE: &str = "before";
const AFTER: &str = "after";

/// Keeps the board's state. What it has sent of the sensor's silence is not kept with it: it would be copied with every
/// cut.
fn keep(board: &mut Board, name: &str) {
    let _ = (board.sent(SLCAN), board.can_frames());
    board.snapshot(name);
}

/// Counts the cuts, and the different contents of the flash that they left.
#[derive(Debug, Default)]
struct Tried {
    cuts: usize,
    seen: HashSet<u64>,
}

impl Tried {
    /// Cuts the power at an access of what a request starts, then at places inside the operation that the access began.
    fn at(
        &mut self,
        board: &mut Board,
        request: &[u8],
        access: usize,
        check: &impl Fn(&mut Board, Configuration, Info),
    ) {
        let began = self.cut(board, request, (access, Duration::ZERO), check);
        let inside = match began.as_deref() {
            Some("erase") => &INTO_ERASE[..],
            Some(_) => &INTO_WORD[..],
            None => &[],
        };
        for delay in inside {
            self.cut(board, request, (access, *delay), check);
        }
    }

    /// Cuts the power once; the operation that it has interrupted.
    fn cut(
        &mut self,
        board: &mut Board,
        request: &[u8],
        (access, delay): (usize, Duration),
        check: &impl Fn(&mut Board, Configuration, Info),
    ) -> Option<String> {
        board.restore(BEFORE);
        service::send(board, request);
        board.cut_after(access, delay);
        let off = board.run_until("power_off", LIMIT);
        assert!(off.is_some(), "service {:#04x} has no access {access}", request[0]);
        self.cuts += 1;
        let events = board.events();
        let interrupted = events.iter().find(|event| event.kind == "flash_interrupted");
        let interrupted = interrupted.map(|event| event.text("operation").to_owned());
        let mut content = DefaultHasher::new();
        for range in [STORE, SLOTS] {
            board.read(At::Address(FLASH_BASE + range.start), range.len()).hash(&mut content);
        }
        if self.seen.insert(content.finish()) {
            board.power_on();
            board.run(START);
            let (configuration, info) = (service::configuration(board), service::info(board));
            check(board, configuration, info);
        }
        interrupted
    }
}

/// The accesses that a request takes; the state after it is kept.
fn accesses(board: &mut Board, request: &[u8]) -> usize {
    board.restore(BEFORE);
    service::send(board, request);
    board.cut_after(MANY, Duration::ZERO);
    let response = service::answer(board, LIMIT).expect("a response");
    assert_eq!(response[0], request[0] + 0x40, "{response:02x?}");
    let count = MANY - board.counts().accesses_left;
    keep(board, AFTER);
    count
}

/// Cuts a store of configuration `k` at each access.
fn store(board: &mut Board, k: usize) {
    let request = storing(&configuration(k));
    let (mut tried, begun) = (Tried::default(), Instant::now());
    let count = accesses(board, &request);
    let check = |board: &mut Board, found: Configuration, info: Info| {
        assert!(found == configuration(k - 1) || found == configuration(k), "{found:?}");
        assert_eq!((info.configuration, info.calibration), (Origin::Stored, Origin::Stored));
        assert_eq!(info.weights_crc, Some(crc(&other_weights(2))));
        assert!(matches!(info.flash, FlashState::Ready | FlashState::Damaged), "{:?}", info.flash);
        // The next attempt works.
        service::enter(board, 3);
        assert_eq!(service::ask(board, &request)[0], 0x6E);
    };
    for access in 1..=count {
        tried.at(board, &request, access, &check);
    }
    let Tried { cuts, seen } = tried;
    println!("{cuts} cuts at {count} accesses, {} contents of flash, {:.0?}", seen.len(), begun.elapsed());
}

#[test]
fn configuration_is_the_old_or_the_new_one_after_a_cut_of_an_append() {
    let Some(mut board) = used(5) else { return };
    service::enter(&mut board, 3);
    keep(&mut board, BEFORE);
    store(&mut board, 6);
}

#[test]
fn configuration_is_the_old_or_the_new_one_after_a_cut_of_an_erase_and_copy() {
    // The records' sector is nearly full.
    const NEARLY: usize = 175;
    let Some(mut board) = used(NEARLY) else { return };
    for k in NEARLY + 1.. {
        service::enter(&mut board, 3);
        let _ = board.events();
        keep(&mut board, BEFORE);
        assert_eq!(service::ask(&mut board, &storing(&configuration(k)))[0], 0x6E);
        if board.events().iter().any(|event| event.kind == "flash_erase") {
            // The board is still the one that was started with an older configuration.
            return store(&mut board, k);
        }
    }
}

/// Cuts an upload at each access of its first and last requests, and at one of every sixteenth block: all of its 100,000 accesses
/// take six hours. `library::store_power_cut` cuts at each operation.
#[test]
fn old_weights_stay_usable_until_the_new_ones_are_activated() {
    let Some(mut board) = used(3) else { return };
    let (old, new) = (crc(&other_weights(2)), other_weights(1));
    let begin = [&[0x34, 0, 0x44, 0, 0, 0, 0][..], &(new.len() as u32).to_be_bytes()].concat();
    let blocks = new.chunks(BLOCK).zip((1u8..=255).chain(0..=255).cycle());
    let mut requests = vec![begin];
    requests.extend(blocks.map(|(bytes, number)| [&[0x36, number][..], bytes].concat()));
    requests.extend([vec![0x37], ACTIVATE.to_vec()]);
    let (mut tried, begun, mut total) = (Tried::default(), Instant::now(), 0);
    service::enter(&mut board, 2);
    keep(&mut board, BEFORE);
    for (number, request) in requests.iter().enumerate() {
        let activates = *request == ACTIVATE;
        let check = |_: &mut Board, found: Configuration, info: Info| {
            let running = (info.weights, info.weights_crc);
            let before = (WeightSource::Slot(Slot::A), Some(old));
            let activated = (WeightSource::Slot(Slot::B), Some(crc(&new)));
            assert!(running == before || activates && running == activated, "{running:?} in {number}");
            assert_eq!((found, info.configuration), (configuration(3), Origin::Stored), "request {number}");
        };
        let count = accesses(&mut board, request);
        total += count;
        let is_edge = number <= 1 || number + 3 >= requests.len();
        for access in 1..=count {
            if is_edge || number % 16 == 0 && access == 1 + number * 37 % count {
                tried.at(&mut board, request, access, &check);
            }
        }
        board.restore(AFTER);
        keep(&mut board, BEFORE);
    }
    board.power_cycle(Duration::from_millis(10), START);
    assert_eq!(service::info(&mut board).weights_crc, Some(crc(&new)), "without a cut");
    assert_ne!(crc(&new), crc(&weights::DEFAULT.0));
    let Tried { cuts, seen } = tried;
    println!("{cuts} cuts in {total} accesses, {} contents of flash, {:.0?}", seen.len(), begun.elapsed());
}

//! Firmware updates with the images as they are flashed: boot loader, download over CAN, trial, confirmation, and the way
//! back from images that are bad.

use crate::common::{self, MS, START, id, resets, stand};
use crate::service::{self, on_bus, on_line};
use embedded_can::Frame;
use gyronet::can::yaw::{Quality, RateMessage};
use gyronet::model::blob::CRC;
use gyronet::service::device::{Firmware, FirmwareState};
use gyronet::store::Slot;
use gyronet::store::firmware::{MAX_IMAGE, Trailer};
use gyronet::store::layout::FLASH_BASE;
use gyronet_host_tests::board::{At, Board, PACKAGES};
use gyronet_host_tests::{image, require};
use gyronet_tools::client::device::update::{Update, update};
use gyronet_tools::client::device::{Authority, Device};
use std::time::Duration;

const S: Duration = Duration::from_secs(1);
const RATE: u16 = 0x1A0;
/// What an image has reached: a frame that was acknowledged.
const SENSOR: u32 = 1;
const CAN: u32 = 2;
/// Time on trial at the end of which an image gives up, and the most until the boot loader has started the one before.
const TRIAL: Duration = Duration::from_secs(60);
const BACK: Duration = Duration::from_secs(1);

fn built() -> Option<Update> {
    require::python(PACKAGES)?;
    image::update(env!("CARGO_TARGET_TMPDIR"))
}

fn firmware(board: &mut Board) -> (Option<Slot>, FirmwareState) {
    let Firmware { slot, state, .. } = service::info(board).firmware;
    (slot, state)
}

fn address(slot: Slot) -> u32 {
    FLASH_BASE + slot.firmware().start
}

#[test]
fn the_whole_image_is_updated_over_can_while_rates_are_sent() {
    let (Some(update_file), Some(mut board)) = (built(), common::boot()) else { return };
    board.run(START);
    let configuration = service::at_latitude(48.1);
    on_bus(&mut board).set_configuration(&configuration).expect("it stands");
    let key = service::lock(&mut board);
    assert_eq!(firmware(&mut board), (Some(Slot::A), FirmwareState::Confirmed));
    stand(&mut board, 6_000);
    board.run(6 * S);
    let _ = (board.events(), board.can_frames());
    let (begin, mut log, mut at) = (board.counts().time, Vec::new(), 0);
    let device = Device::new(board.logged_bus(&mut log), "the virtual board");
    let mut device = device.authorise(Authority::Key(key.clone()));
    let slot = update(&mut device, &update_file, |sent, _| at = sent)
        .unwrap_or_else(|error| panic!("after {at} bytes: {error}"));
    drop(device);
    let took = board.counts().time - begin;
    assert_eq!(slot, Slot::B);
    let size = update_file.images[1].len();
    // No rate is missing but where the board erases, which it announces.
    let rate = id(RATE);
    let rates: Vec<_> = log.iter().filter(|(_, frame)| frame.id() == rate).collect();
    let gaps: Vec<_> = rates.windows(2).filter(|pair| pair[1].0 - pair[0].0 > 15 * MS).collect();
    println!(
        "{size} bytes in {took:.2?}, {} rates, silences {:.0?}",
        rates.len(),
        gaps.iter().map(|pair| pair[1].0 - pair[0].0).collect::<Vec<_>>()
    );
    assert!(took < 60 * S, "{took:?}");
    for pair in &gaps {
        let before = RateMessage::parse(pair[0].1.data()).expect("a rate").quality;
        assert_eq!(before, Quality::Unusable, "announced");
    }
    let erased: Vec<u64> = board
        .events()
        .iter()
        .filter(|event| event.kind == "flash_erase")
        .flat_map(|event| event.numbers("sectors"))
        .collect();
    assert_eq!((gaps.len(), &erased[..]), (2, &[6, 7][..]));
    let silent: Duration = gaps.iter().map(|pair| pair[1].0 - pair[0].0).sum();
    assert!(rates.len() as u32 + 2 >= (took - silent).as_millis() as u32 / 10, "{}", rates.len());
    // The controller's three places run over in each, and DMA writes over what waits.
    let lines = common::counters(&mut board).lines;
    assert!(lines.frames_lost == 2 && lines.line_errors >= 2 * 512, "{lines:?}");
    // The first frame of the new image, and its confirmation.
    service::by_owner(&mut board, &key).restart().expect("access is proven");
    let _ = (board.run(100 * MS), board.can_frames());
    board.run(START);
    assert_eq!(firmware(&mut board), (Some(Slot::B), FirmwareState::OnTrial));
    let first = board.can_frames().into_iter().find(|(_, frame)| frame.id() == rate).expect("rates").0;
    let reset = resets(&mut board).pop().expect("a restart");
    println!("first rate {:.0?} after the reset", first - reset.0);
    assert!(first - reset.0 < 300 * MS);
    board.run(16 * S);
    assert_eq!(firmware(&mut board), (Some(Slot::B), FirmwareState::Confirmed));
    board.power_cycle(10 * MS, START);
    assert_eq!(firmware(&mut board), (Some(Slot::B), FirmwareState::Confirmed));
    assert_eq!(service::configuration(&mut board), configuration, "it outlives the update");
    assert_eq!(on_bus(&mut board).access().expect("a response").state, "locked", "and so does the key");
}

/// Writes an image to slot B, to start on trial.
fn install(board: &mut Board, image: &[u8], expected: u32) {
    let trailer = Trailer::new(image.len() as u32, CRC.checksum(image), expected, 2);
    board.patch(At::Address(address(Slot::B)), image);
    board.patch(At::Address(address(Slot::B) + MAX_IMAGE), &trailer.bytes());
}

/// Starts the board with the image in slot A, and restarts it with another one on trial in slot B. That restart is the first
/// event.
fn try_on(expected: u32, spoil: impl FnOnce(&mut Board, &mut Vec<u8>)) -> Option<Board> {
    let (Update { images: [_, mut image], .. }, mut board) = (built()?, common::boot()?);
    board.run(START);
    assert_eq!(firmware(&mut board), (Some(Slot::A), FirmwareState::Confirmed));
    spoil(&mut board, &mut image);
    install(&mut board, &image, expected);
    let _ = board.events();
    service::restart(&mut board);
    Some(board)
}

/// A function's code in the image for slot B. The linker may order that image a little otherwise than the one for slot A:
/// the function is found near its place there by its first instructions.
fn function<'a>(board: &mut Board, image: &'a mut [u8], name: &str) -> &'a mut [u8] {
    let (start, size) = board.symbol(name);
    let begins = board.read(At::Address(start), 12);
    let near = (start - address(Slot::A)) as usize;
    let places = (near.saturating_sub(256)..near + 256).step_by(2);
    let places: Vec<usize> = places.filter(|at| image[*at..].starts_with(&begins)).collect();
    // The first function is where it is in the other image, and begins with a jump over another distance.
    let place = match places[..] {
        [place] => place,
        [] if name == "Reset" => near,
        _ => panic!("{name} at {near:#x}: {places:x?}"),
    };
    &mut image[place..place + size as usize]
}

/// Puts instructions at the beginning of a function of the image for slot B.
fn replace(board: &mut Board, image: &mut [u8], name: &str, code: &[u8]) {
    function(board, image, name)[..code.len()].copy_from_slice(code);
}

/// Checks that the image before runs again, and says why.
fn rolled_back(board: &mut Board) {
    board.run(START);
    assert_eq!(firmware(board), (Some(Slot::A), FirmwareState::RolledBack));
    let troubles = on_bus(board).ask(&[0x19, 2, 0x09]).expect("a list");
    assert!(troubles[2..].chunks(4).any(|trouble| trouble[..3] == [0x5A, 0x03, 0x52]), "{troubles:02x?}");
    board.power_cycle(10 * MS, START);
    assert_eq!(firmware(board), (Some(Slot::A), FirmwareState::RolledBack), "for good");
}

#[test]
fn an_image_that_hangs_is_rolled_back_by_the_first_reset_and_one_that_crashes_by_the_third() {
    const HANG: [u8; 2] = [0xFE, 0xE7];
    const UNDEFINED: [u8; 2] = [0, 0xDE];
    // Its idle task, its output task, and its first instruction, before it has started the watchdog.
    for (function, code, resets) in [
        ("idle::Idle::step", HANG, &["iwdg"][..]),
        ("output::Output::step", HANG, &["iwdg"]),
        ("Reset", HANG, &["iwdg"]),
        ("idle::Idle::step", UNDEFINED, &["software"; 3]),
    ] {
        let spoil = |board: &mut Board, image: &mut Vec<u8>| replace(board, image, function, &code);
        let Some(mut board) = try_on(0, spoil) else { return };
        board.run(5 * S);
        let causes: Vec<String> = common::resets(&mut board).into_iter().map(|(_, cause)| cause).collect();
        assert_eq!(causes[1..], *resets, "{function}");
        rolled_back(&mut board);
    }
}

/// The image resets itself where the supply is too low to program flash: no fault of its own.
#[test]
fn a_supply_that_dips_does_not_end_a_trial() {
    let Some(mut board) = try_on(0, |_, _| {}) else { return };
    board.run(2 * S);
    board.configure("PWR.supply_mv", 2_700);
    board.run(50 * MS);
    board.configure("PWR.supply_mv", 3_300);
    board.run(16 * S);
    let causes: Vec<String> = common::resets(&mut board).into_iter().map(|(_, cause)| cause).collect();
    assert!(causes.len() > 1 && causes.iter().all(|cause| cause == "software"), "{causes:?}");
    assert_eq!(firmware(&mut board), (Some(Slot::B), FirmwareState::Confirmed));
}

#[test]
fn an_image_without_can_is_rolled_back_after_its_trial() {
    // It says of each frame that no mailbox was free: movs r0, #0; bx lr
    let spoil = |board: &mut Board, image: &mut Vec<u8>| {
        replace(board, image, "stm32f405::can::Can::transmit", &[0, 0x20, 0x70, 0x47]);
    };
    let Some(mut board) = try_on(CAN, spoil) else { return };
    let _ = board.events();
    assert_eq!(firmware(&mut board), (Some(Slot::B), FirmwareState::OnTrial));
    board.run(TRIAL - BACK);
    assert_eq!(resets(&mut board), []);
    board.run(2 * BACK);
    assert_eq!(resets(&mut board).len(), 1);
    rolled_back(&mut board);
}

#[test]
fn an_image_that_lacks_the_sensor_is_rolled_back_after_its_trial() {
    // It waits for another preamble: cmp r_, #FA becomes cmp r_, #FB.
    let spoil = |board: &mut Board, image: &mut Vec<u8>| {
        let function = function(board, image, "sensor::xsens::Mti::next_message");
        let compares = |code: &&mut [u8]| code[0] == 0xFA && (0x28..0x30).contains(&code[1]);
        let places: Vec<_> = function.chunks_mut(2).filter(compares).collect();
        assert_eq!(places.len(), 1, "where the preamble is compared");
        places.into_iter().for_each(|code| code[0] = 0xFB);
    };
    let Some(mut board) = try_on(SENSOR | CAN, spoil) else { return };
    let _ = board.events();
    stand(&mut board, 6_200);
    board.run(TRIAL - BACK);
    assert_eq!(firmware(&mut board), (Some(Slot::B), FirmwareState::OnTrial));
    board.run(2 * BACK);
    assert_eq!(resets(&mut board).len(), 1);
    rolled_back(&mut board);
}

#[test]
fn an_image_that_is_damaged_after_its_confirmation_gives_way_and_without_any_the_led_says_so() {
    let Some(mut board) = try_on(0, |_, _| {}) else { return };
    board.run(16 * S);
    assert_eq!(firmware(&mut board), (Some(Slot::B), FirmwareState::Confirmed));
    let damage = |board: &mut Board, slot| {
        let place = At::Address(address(slot) + 100_000);
        let byte = board.read(place, 1)[0];
        board.patch(place, &[byte ^ 0x10]);
    };
    damage(&mut board, Slot::B);
    board.power_cycle(10 * MS, 2 * START);
    assert_eq!(firmware(&mut board), (Some(Slot::A), FirmwareState::NewerDamaged));
    damage(&mut board, Slot::A);
    board.configure("GPIOA.watch", vec![10]);
    board.power_cycle(10 * MS, 2 * START);
    let _ = (board.events(), board.bus_log());
    board.run(3 * S);
    let edges = board.events().iter().filter(|event| event.kind == "pin").count();
    assert!((8..=12).contains(&edges), "two flashes a second: {edges} edges");
    assert_eq!(board.bus_log().len(), 0);
    // A probe flashes it.
    damage(&mut board, Slot::A);
    board.power_cycle(10 * MS, 2 * START);
    assert_eq!(firmware(&mut board).0, Some(Slot::A));
}

pub struct Cuts<'a> {
    /// Cuts in a step at most, at accesses to the flash.
    pub most: usize,
    /// Times of a cut after its access.
    pub delays: &'a [Duration],
    /// Lets a board start, and returns whether an image runs.
    pub starts: &'a dyn Fn(&mut Board) -> bool,
    /// Time that a start takes, and from then until an image on trial is about to be confirmed.
    pub times: [Duration; 2],
    pub install: fn(&mut Board, &[u8], u32),
    pub firmware: fn(&mut Board) -> (Option<Slot>, FirmwareState),
}

impl Cuts<'_> {
    /// Cuts the power while an image is downloaded, activated, tried, rolled back and confirmed. The image that is rolled back is
    /// the first KiB of one.
    pub fn update(&self, board: &mut Board, file: &Update) {
        const TINY: usize = 1_024;
        let [a, b] = &file.images;
        let tiny = Update::new(file.head.label, [a.clone(), b[..TINY].to_vec()]);
        let [start, trial] = self.times;
        service::enter(board, 2);
        let head = [&[0x2E, 1, 0x1A][..], &tiny.head.bytes()].concat();
        assert_eq!(service::ask(board, &head), [0x6E, 1, 0x1A]);
        let begin = [&[0x34, 0, 0x44, 0, 0, 0, 2][..], &(TINY as u32).to_be_bytes()].concat();
        self.during(board, "erase", &|board| service::send(board, &begin), 3 * S);
        for (number, block) in (1u8..).zip(tiny.images[1].chunks(256)) {
            let block = [&[0x36, number][..], block].concat();
            match number {
                2 => self.during(board, "block", &|board| service::send(board, &block), 100 * MS),
                _ => assert_eq!(service::ask(board, &block), [0x76, number]),
            }
        }
        assert_eq!(service::ask(board, &[0x37])[..2], [0x77, 1]);
        self.during(board, "activation", &|board| service::send(board, &[0x31, 1, 0xFF, 1]), 100 * MS);
        // The piece of an image hangs.
        self.during(board, "start on trial", &|board| board.reset_pin(), start);
        self.during(board, "rollback", &|_| (), 5 * S);
        board.run(start);
        assert_eq!((self.firmware)(board), (Some(Slot::A), FirmwareState::RolledBack));
        (self.install)(board, b, 0);
        self.during(board, "start of a whole image", &|board| board.reset_pin(), start);
        assert_eq!((self.firmware)(board), (Some(Slot::B), FirmwareState::OnTrial));
        board.run(trial);
        self.during(board, "confirmation", &|_| (), S);
        assert_eq!((self.firmware)(board), (Some(Slot::B), FirmwareState::Confirmed));
    }

    /// Cuts the power while the board acts, and checks that an image starts, at the third start at the latest. The board goes on
    /// from what is without a cut.
    fn during(&self, board: &mut Board, name: &str, act: &dyn Fn(&mut Board), limit: Duration) {
        const MANY: usize = 1 << 30;
        board.snapshot("before");
        board.cut_after(MANY, Duration::ZERO);
        act(board);
        board.run(limit);
        let count = MANY - board.counts().accesses_left;
        assert!(count > 0, "{name}");
        let _ = board.can_frames();
        board.snapshot("after");
        let accesses: Vec<_> = (1..=count).step_by(count.div_ceil(self.most)).collect();
        println!("{name}: {} cuts at {count} accesses", accesses.len() * self.delays.len());
        for access in accesses {
            for &delay in self.delays {
                board.restore("before");
                board.cut_after(access, delay);
                act(board);
                let _ = board.run_until("power_off", limit + 300 * MS);
                board.power_cycle(MS, Duration::ZERO);
                assert!((0..3).any(|_| (self.starts)(board)), "{name}: {access} of {count}, {delay:?}");
            }
        }
        board.restore("after");
    }
}

fn cut_power(most: usize, delays: &[Duration]) {
    let (Some(file), Some(mut board)) = (built(), common::boot()) else { return };
    board.run(3 * S);
    // The boot loader may try the new one first, until its watchdog ends that.
    let starts = |board: &mut Board| {
        board.run(2 * START);
        on_line(board).info().is_ok_and(|info| info.firmware.slot.is_some())
    };
    let times = [START, 14_700 * MS];
    Cuts { most, delays, starts: &starts, times, install, firmware }.update(&mut board, &file);
}

#[test]
fn an_image_starts_after_a_cut_at_an_access_of_the_update() {
    cut_power(10, &[Duration::ZERO, Duration::from_micros(8), 300 * MS]);
}

/// `cargo test -p gyronet-host-tests --test board cut_at_each_access_of_the_update -- --ignored --nocapture`
#[test]
#[ignore = "2,000 cuts take half an hour"]
fn an_image_starts_after_a_cut_at_each_access_of_the_update() {
    let delays = [Duration::ZERO, Duration::from_micros(4), Duration::from_micros(12), 300 * MS, 900 * MS];
    cut_power(usize::MAX, &delays);
}

//! The diagnostic server: any frames, at any times, on a board with or without flash.

use super::{byte, take};
use crate::flash::{F405, Region, shared};
use crate::noise::Noise;
use crate::stored::{flash_image, image};
use crate::synthetic::{idling, judged};
use crate::tester::segment;
use gyronet::health::{Faults, Status};
use gyronet::sample::{Standstill, WheelSample};
use gyronet::service::message::{AllCounters, Identity};
use gyronet::service::{Device, SupportedHardware};
use gyronet::store::firmware::Label;
use gyronet::store::layout::STORE;
use gyronet::store::{FlashFault, FogPart, ImuPart, Record as _, Slot};
use gyronet::uds::Server;

const SUPPORTED_HARDWARE: SupportedHardware = SupportedHardware {
    imus: &[ImuPart::XsensMti],
    fogs: &[FogPart::Dsp1760],
    gnss: false,
    fd: false,
    clock_hz: 168_000_000,
};

type Board = Device<Region, Region>;

struct Bench {
    server: Server,
    board: Board,
    now: u32,
}

impl Bench {
    fn poll(&mut self) -> Vec<[u8; 8]> {
        self.server.poll(&mut self.board, AllCounters::default, self.now, || Some([7; 32]));
        std::iter::from_fn(|| self.server.next_frame(self.now)).collect()
    }
}

/// Runs commands: the time that passes, then a message in frames, or a raw frame. Whatever came before, the server
/// must answer a tester that is silent for a while and then sends a request.
pub fn frames(mut data: &[u8]) {
    let choice = byte(&mut data);
    let mut board = Board::new(&SUPPORTED_HARDWARE);
    let has_slots = choice & 2 != 0;
    let flash = shared(if has_slots { F405::default() } else { F405::up_to(STORE.end as usize) });
    let records = (choice & 4 != 0).then(|| Region::new(&flash, STORE));
    let slots = has_slots.then(|| {
        flash_image(&flash, Slot::A, &image(&Label::new([1, 0, 0], "a board"), 1));
        Region::mapped(&flash, Some(Slot::A))
    });
    let controller = if choice & 8 == 0 { Ok(()) } else { Err(FlashFault::Unlocked) };
    board.begin(records, slots, controller, Identity::UNKNOWN);
    let mut noise = Noise::new(1);
    for tick in 0..if choice & 1 != 0 { 310 } else { 0 } {
        let sample = idling(tick, 0.001, &mut noise);
        board.observe(
            Some(&sample),
            0,
            (Status::Ready, Faults::NONE),
            &WheelSample::without_speeds(Standstill::Still),
            &judged(Standstill::Still),
        );
    }
    let mut bench = Bench { server: Server::new(), board, now: u32::MAX - 1_000 };
    while !data.is_empty() {
        let (kind, wait) = (byte(&mut data), byte(&mut data));
        bench.now = bench.now.wrapping_add(if kind & 0x80 != 0 { 100 } else { 1 } * u32::from(wait));
        let functional = kind & 0x40 != 0;
        if kind & 0x20 != 0 {
            let frame = take(&mut data, usize::from(kind & 0xF).min(8));
            give(&mut bench, functional, frame);
        } else {
            let length = usize::from(byte(&mut data)) + usize::from(kind & 0x1F);
            let message = take(&mut data, length);
            segment(message).iter().for_each(|frame| give(&mut bench, functional, frame));
        }
    }
    for _ in 0..3 {
        bench.now = bench.now.wrapping_add(1_001);
        bench.poll();
    }
    bench.server.receive(&[2, 0x3E, 0], bench.now);
    let answer = bench.poll();
    assert!(matches!(answer[..], [[2, 0x7E, 0, ..]]), "{answer:02x?}");
    bench.board.configuration().check().expect("the configuration in use is valid");
}

fn give(bench: &mut Bench, functional: bool, frame: &[u8]) {
    match functional {
        true => bench.server.receive_functional(frame, bench.now),
        false => bench.server.receive(frame, bench.now),
    }
    for _ in 0..3 {
        for sent in bench.poll() {
            let is_response = matches!(sent[0], 0x01..=0x07 | 0x10..=0x3F);
            assert!(is_response, "{sent:02x?}");
            if sent[0] & 0xF0 == 0x10 {
                bench.server.receive(&[0x30, 0, 0], bench.now);
            }
        }
    }
}

//! Tests the diagnostic server: any frames, at any times, on a board with or without flash.

use super::records::SECTOR;
use super::{Seed, byte, take};
use crate::noise::Noise;
use crate::ram_flash::{self, RamFlash};
use crate::synthetic::idling;
use crate::synthetic::judged;
use crate::tester::segment;
use gyronet::health::{Faults, Status};
use gyronet::sample::{Standstill, WheelSample};
use gyronet::service::message::{AllCounters, Identity};
use gyronet::service::{Device, SupportedHardware};
use gyronet::store::layout::RECORD_SECTOR;
use gyronet::store::{FlashFault, FogPart, ImuPart, Record as _};
use gyronet::uds::update::Head;
use gyronet::uds::{Server, signature};

const SUPPORTED_HARDWARE: SupportedHardware = SupportedHardware {
    imus: &[ImuPart::XsensMti],
    fogs: &[FogPart::Dsp1760],
    gnss: false,
    clock_hz: 168_000_000,
};

type Board = Device<RamFlash<SECTOR>, RamFlash<RECORD_SECTOR>>;

struct Bench {
    server: Server,
    board: Board,
    now: u32,
}

impl Bench {
    /// Polls the server; returns the frames that it sends.
    fn poll(&mut self) -> Vec<[u8; 8]> {
        self.server.poll(&mut self.board, &AllCounters::default(), self.now, || Some([7; 32]));
        std::iter::from_fn(|| self.server.next_frame(self.now)).collect()
    }
}

/// Runs commands: the time that passes, then a message in frames, or a raw frame. Whatever came before, the server
/// must answer a tester that is silent for a while and then sends a request.
pub fn frames(mut data: &[u8]) {
    let choice = byte(&mut data);
    let mut board = Board::new(&SUPPORTED_HARDWARE);
    let (records, slots) = (RamFlash::new(&[]), (choice & 2 != 0).then(RamFlash::for_weights));
    let controller = if choice & 8 == 0 { Ok(()) } else { Err(FlashFault::Unlocked) };
    board.begin((choice & 4 != 0).then_some(records), slots, controller, Identity::UNKNOWN);
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

/// Passes a frame to the server, and lets a response continue.
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

pub fn seeds() -> Vec<Seed> {
    let message = |request: &[u8]| [&[0, 1, request.len() as u8], request].concat();
    let script = |choice: u8, requests: &[&[u8]]| {
        let messages = requests.iter().flat_map(|request| message(request));
        std::iter::once(choice).chain(messages).collect::<Vec<u8>>()
    };
    let block = [&[0x36, 1][..], &[0; 16]].concat();
    let images = [signature::digest(&[0; 16]); 2];
    let head = Head { label: ram_flash::FIRMWARE, downgrade: false, images }.bytes();
    let head = [&[0x2E, 1, 0x1A][..], &head].concat();
    vec![
        (
            "reads",
            script(
                0,
                &[
                    &[0x22, 1, 0, 0xF1, 0x89],
                    &[0x22, 1, 2],
                    &[0x19, 2, 0xFF],
                    &[0x19, 0x0A],
                    &[0x14, 255, 255, 255],
                ],
            ),
        ),
        ("sessions", script(0, &[&[0x10, 3], &[0x3E, 0], &[0x85, 2], &[0x11, 1]])),
        ("download", script(7, &[&[0x10, 2], &[0x34, 0, 0x11, 0, 16], &block, &[0x37], &[0x31, 1, 0xFF, 1]])),
        (
            "update",
            script(7, &[&[0x10, 2], &head, &[0x34, 0, 0x11, 2, 16], &block, &[0x37], &[0x31, 1, 0xFF, 1]]),
        ),
        ("routine", script(7, &[&[0x10, 3], &[0x31, 1, 2, 0], &[0x31, 3, 2, 0], &[0x31, 1, 2, 2]])),
        (
            "key",
            script(
                7,
                &[
                    &[0x10, 3],
                    &[&[0x2E, 1, 0x10][..], &[0x66; 32]].concat(),
                    &[0x10, 3],
                    &[0x27, 1],
                    &[&[0x27, 2][..], &[0; 64]].concat(),
                    &[&[0x2E, 2, 4, 0, 0, 0, 0, 1, 0, 0, 0, 1][..], &[0; 64]].concat(),
                    &[0x22, 1, 0x11],
                ],
            ),
        ),
        ("frames", vec![1, 0x28, 1, 0x10, 20, 0x22, 1, 0, 1, 1, 1, 0x28, 1, 0x21, 1, 2, 3, 4, 5, 6, 7]),
    ]
}

//! Testers of the virtual board, with limits of board time: a test does the same however busy the host is.

use crate::common::{self, MS, SERVICE, START};
use embedded_can::{Frame, Id};
use gyronet::service::message::Info;
use gyronet::store::{Configuration, Record};
use gyronet_host_tests::board::{Board, CanBus, Line};
use gyronet_host_tests::tester::segment;
use gyronet_host_tests::wire::{data_frame, id11};
use gyronet_tools::client::bus::SlcanBus;
use gyronet_tools::client::device::{Authority, Device};
use gyronet_tools::signing::PrivateKey;
use std::time::Duration;

pub const IDS: [Id; 2] = [id11(0x7E0), id11(0x7E8)];
/// The frames of a request that the board grants at a time, and the time that they take and are granted in.
const BLOCK: usize = 8;
const BLOCK_TIME: Duration = Duration::from_millis(5);
/// Board time that a response may take: an erase of a record sector at the data sheet's maximum.
pub const ANSWER: Duration = Duration::from_millis(700);

pub fn on_line(board: &mut Board) -> Device<SlcanBus<Line<'_>>> {
    Device::new(SlcanBus::new(board.line(SERVICE)), "the virtual board")
}

/// A tester on CAN, which takes the frames that the board sends meanwhile.
pub fn on_bus(board: &mut Board) -> Device<CanBus<'_>> {
    Device::new(board.bus(), "the virtual board")
}

/// The same, of the owner of the board's key.
pub fn by_owner<'b>(board: &'b mut Board, key: &PrivateKey) -> Device<CanBus<'b>> {
    on_bus(board).authorise(Authority::Key(key.clone()))
}

pub fn restart(board: &mut Board) {
    on_bus(board).restart().expect("a response");
    board.run(START);
}

pub fn lock(board: &mut Board) -> PrivateKey {
    let key = PrivateKey::generate().expect("random numbers");
    on_bus(board).set_key(&key.public()).expect("there was none");
    key
}

pub fn info(board: &mut Board) -> Info {
    on_line(board).info().expect("a response")
}

pub fn configuration(board: &mut Board) -> Configuration {
    on_line(board).configuration().expect("a response")
}

/// The built-in settings with this latitude.
pub fn at_latitude(deg: f32) -> Configuration {
    Configuration { latitude_deg: Some(deg), ..Configuration::DEFAULT }
}

pub fn storing(configuration: &Configuration) -> Vec<u8> {
    let record = postcard::to_stdvec(configuration).expect("there is room");
    [&[0x2E, 0x01, 0x00, Configuration::VERSION][..], &record].concat()
}

/// Puts a request on CAN. When this returns, its last frames are on their way: nothing has been done about it.
pub fn send(board: &mut Board, request: &[u8]) {
    let frames = segment(request);
    let last = frames.len() - 1;
    for (number, data) in frames.iter().enumerate() {
        board.can_send(&data_frame(IDS[0], data));
        // The board grants the frames behind the first one, and behind each block.
        if number % BLOCK == 0 && number < last {
            board.run(BLOCK_TIME);
        }
    }
}

/// Sends frames to a server; returns the data of its own of the next millisecond.
pub fn exchange(board: &mut Board, [to, from]: [Id; 2], frames: &[[u8; 8]]) -> Vec<[u8; 8]> {
    frames.iter().for_each(|data| board.can_send(&data_frame(to, data)));
    board.run(MS);
    let sent = common::frames(&board.can_frames());
    let own = sent.iter().filter(|frame| frame.id() == from);
    own.map(|frame| frame.data().try_into().expect("eight bytes")).collect()
}

/// Waits for the response to the request that was sent, which must fit a frame; `None` when none comes within the limit.
pub fn answer(board: &mut Board, limit: Duration) -> Option<Vec<u8>> {
    (0..limit.as_millis()).find_map(|_| {
        let frames = exchange(board, IDS, &[]).into_iter().filter(|data| data[0] < 8);
        let mut messages = frames.map(|data| data[1..=usize::from(data[0])].to_vec());
        // "Response pending" is waited out.
        messages.find(|message| !matches!(message[..], [0x7F, _, 0x78]))
    })
}

/// Sends a request over CAN and returns the response, which must fit a frame.
pub fn ask(board: &mut Board, request: &[u8]) -> Vec<u8> {
    send(board, request);
    answer(board, ANSWER).unwrap_or_else(|| panic!("no response to {request:02x?}"))
}

pub fn enter(board: &mut Board, session: u8) {
    assert_eq!(ask(board, &[0x10, session])[..2], [0x50, session]);
}

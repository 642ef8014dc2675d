//! Questions on the service line, with limits of board time: a test does the same however busy the host is.

use crate::common::SERVICE;
use gyronet::service::frame::{Deframer, emit};
use gyronet::service::message::{Info, Refusal};
use gyronet::service::{Reply, Request};
use gyronet::store::slots::Slot;
use gyronet::store::{Configuration, Record};
use gyronet_host_tests::board::Board;
use std::time::Duration;

/// Board time that an answer may take: an erase of a record sector at the data sheet's maximum, and the line.
pub const ANSWER: Duration = Duration::from_millis(700);
/// Board time that passes from byte to byte of an answer, at most.
const BYTES: Duration = Duration::from_millis(2);

/// Puts a request on the line, behind a zero that ends whatever came before.
pub fn send(board: &mut Board, request: &Request) {
    let _ = board.sent(SERVICE);
    board.send(SERVICE, &[0]);
    board.send(SERVICE, &emit(1, request).expect("it fits a frame"));
}

/// Waits for the answer to the request that was sent; `None` when none has begun within the limit.
pub fn answer(board: &mut Board, limit: Duration) -> Option<Reply> {
    let mut deframer = Deframer::new();
    let mut limit = limit;
    while board.run_until_sent(SERVICE, 1, limit) {
        for byte in board.sent(SERVICE) {
            match deframer.receive(byte) {
                Some(Ok((_, reply))) => return Some(reply),
                Some(Err(error)) => panic!("a damaged answer: {error}"),
                None => {}
            }
        }
        limit = BYTES;
    }
    None
}

/// Asks, and gives the answer or the refusal.
pub fn ask(board: &mut Board, request: &Request) -> Result<Reply, Refusal> {
    send(board, request);
    match answer(board, ANSWER) {
        Some(Reply::Refused(refusal)) => Err(refusal),
        Some(reply) => Ok(reply),
        None => panic!("no answer to {request:?}"),
    }
}

/// The request to store a configuration.
pub fn storing(configuration: Configuration) -> Request {
    Request::SetConfiguration { version: Configuration::VERSION, configuration }
}

/// The configuration that the board was started with.
pub fn configuration(board: &mut Board) -> Configuration {
    match ask(board, &Request::GetConfiguration) {
        Ok(Reply::Configuration { configuration, .. }) => configuration,
        other => panic!("{other:?}"),
    }
}

/// The state that the board reports.
pub fn info(board: &mut Board) -> Info {
    match ask(board, &Request::Info) {
        Ok(Reply::Info(info)) => info,
        other => panic!("{other:?}"),
    }
}

/// The slot that an upload goes to, once begun.
pub fn begin_upload(board: &mut Board, length: usize) -> Slot {
    send(board, &Request::WeightsBegin { length: length as u32 });
    match answer(board, Duration::from_secs(4)) {
        Some(Reply::Weights { slot, .. }) => slot,
        other => panic!("{other:?}"),
    }
}

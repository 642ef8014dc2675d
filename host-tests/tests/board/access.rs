//! Who may write, on the image as flashed: keys, signatures, and challenges of the chip's random numbers.

use crate::common::{self, START};
use crate::service::{self, at_latitude, by_owner, on_bus};
use gyronet_host_tests::board::Board;
use gyronet_tools::client::device::Authority;
use gyronet_tools::client::device::error::DeviceError;
use gyronet_tools::signing::PrivateKey;
use serde_json::json;
use std::time::Duration;

fn locked() -> Option<(Board, PrivateKey)> {
    let mut board = common::started()?;
    assert_eq!(on_bus(&mut board).access().expect("a response").state, "open");
    let key = service::lock(&mut board);
    Some((board, key))
}

fn challenge(board: &mut Board) -> Result<Vec<u8>, DeviceError> {
    let mut device = on_bus(board);
    device.ask(&[0x10, 3]).expect("a session");
    device.ask(&[0x27, 1])
}

/// A board that has a key gives no challenge while its random numbers fail, in each of three ways.
pub fn fail_with_the_generator(board: &mut Board) {
    for (setting, value, good) in [
        ("RNG.seed_error", json!(true), json!(false)),
        ("RNG.clock_error", json!(true), json!(false)),
        ("RNG.stuck", json!(0x55), json!(null)),
    ] {
        board.configure(setting, value);
        match challenge(board) {
            Err(DeviceError::Negative { service: 0x27, code }) => assert_eq!(code.0, 0x22, "{setting}"),
            other => panic!("{setting}: {other:?}"),
        }
        board.configure(setting, good);
        challenge(board).expect("it works again");
    }
}

/// A response to a challenge: the generator's numbers differ from board start to board start.
#[test]
fn challenges_never_repeat_and_fail_with_the_generator() {
    let Some((mut board, key)) = locked() else { return };
    on_bus(&mut board).ask(&[0x11, 1]).expect("this session has stored the key");
    board.run(START);
    let mut seen = Vec::new();
    for _ in 0..3 {
        let seed = challenge(&mut board).expect("a challenge");
        assert_eq!(seed.len(), 33);
        assert!(!seen.contains(&seed) && seed[1..] != [0; 32], "{seed:02x?}");
        seen.push(seed);
        board.reset_pin();
        board.run(START);
    }
    fail_with_the_generator(&mut board);
    by_owner(&mut board, &key).restart().expect("access is proven");
}

#[test]
fn a_signature_is_checked_while_the_rates_go_out() {
    let Some((mut board, key)) = locked() else { return };
    let configuration = at_latitude(48.0);
    // Standing for long enough.
    let now = board.counts().time;
    common::send(&mut board, &common::drive(700), now);
    board.run(Duration::from_secs(4));
    let stored = by_owner(&mut board, &key).set_configuration(&configuration);
    stored.expect("the records' sector is erased here");
    // The next tester is on another line.
    service::enter(&mut board, 1);
    board.run(Duration::from_millis(500));
    let begin = board.counts().time;
    let _ = board.can_frames();
    let mut device = service::on_line(&mut board).authorise(Authority::Key(key));
    device.set_configuration(&configuration).expect("it is signed");
    let took = board.counts().time - begin;
    let gap = common::gap(&board.can_frames(), 10);
    println!("two signatures are checked and stored in {took:?}; longest gap between rates {gap:?}");
    assert!(took < Duration::from_secs(1), "{took:?}");
    assert!(gap < Duration::from_millis(15), "{gap:?}");
}

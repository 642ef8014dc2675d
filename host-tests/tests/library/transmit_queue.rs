//! A bus that is off, full or gone never blocks: the oldest frames are dropped, and counted.

use embedded_can::ErrorKind;
use embedded_can::nb::Can;
use gyronet::can::DataFrame;
use gyronet::can::queue::TransmitQueue;
use gyronet_host_tests::wire::{data_frame, id11};
use proptest::prelude::*;
use std::collections::VecDeque;

/// The next answer of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Mood {
    Takes,
    #[default]
    Busy,
    Off,
    /// Takes the frame and gives back the one that it had.
    Swaps,
}

#[derive(Debug, Default)]
pub struct Controller {
    pub moods: VecDeque<Mood>,
    /// Its answer after those.
    pub then: Mood,
    pub held: Option<DataFrame>,
    pub sent: Vec<DataFrame>,
    pub received: VecDeque<DataFrame>,
    pub tries: usize,
}

impl Controller {
    fn new(moods: impl IntoIterator<Item = Mood>) -> Self {
        Self { moods: moods.into_iter().collect(), ..Self::default() }
    }
}

impl Can for Controller {
    type Frame = DataFrame;
    type Error = ErrorKind;

    fn transmit(&mut self, frame: &DataFrame) -> nb::Result<Option<DataFrame>, ErrorKind> {
        self.tries += 1;
        match self.moods.pop_front().unwrap_or(self.then) {
            Mood::Takes => {
                self.sent.push(*frame);
                Ok(None)
            }
            Mood::Busy => Err(nb::Error::WouldBlock),
            Mood::Off => Err(nb::Error::Other(ErrorKind::Other)),
            Mood::Swaps => Ok(self.held.replace(*frame)),
        }
    }

    fn receive(&mut self) -> nb::Result<DataFrame, ErrorKind> {
        self.received.pop_front().ok_or(nb::Error::WouldBlock)
    }
}

fn frame(number: usize) -> DataFrame {
    data_frame(id11(0x174), &number.to_le_bytes())
}

#[test]
fn a_bus_that_is_gone_costs_the_oldest_frames() {
    let mut queue = TransmitQueue::<DataFrame, 7>::new();
    let mut gone = Controller::new([]);
    // Ten seconds of six frames every ten milliseconds.
    for number in 0..6_000 {
        queue.enqueue(frame(number));
        assert_eq!(queue.service(&mut gone), 0);
        assert!(!queue.is_empty());
    }
    assert_eq!(gone.tries, 6_000, "one try a turn");
    assert_eq!((queue.len(), queue.dropped()), (7, 5_993));
    // The bus is back: what comes out is the newest, in order.
    let mut back = Controller::new([Mood::Takes; 10]);
    assert_eq!(queue.service(&mut back), 7);
    assert_eq!(back.sent, (5_993..6_000).map(frame).collect::<Vec<_>>());
    assert!(queue.is_empty());
}

#[test]
fn a_frame_that_is_given_back_is_not_lost() {
    let mut queue = TransmitQueue::<DataFrame, 3>::new();
    for number in 0..3 {
        queue.enqueue(frame(number));
    }
    let mut controller = Controller::new([Mood::Swaps, Mood::Swaps, Mood::Takes]);
    assert_eq!(queue.service(&mut controller), 2);
    // 0 was held, 1 took its place, 0 came back and was sent.
    assert_eq!((controller.held, controller.sent), (Some(frame(1)), vec![frame(0)]));
    assert_eq!(queue.pop(), Some(frame(2)));
    assert_eq!(queue.pop(), None);
}

#[test]
fn the_oldest_frame_can_be_looked_at_and_dropped() {
    let mut queue = TransmitQueue::<DataFrame, 3>::new();
    queue.drop_front();
    assert_eq!((queue.front(), queue.dropped()), (None, 0));
    (0..2).for_each(|number| queue.enqueue(frame(number)));
    assert_eq!(queue.front(), Some(&frame(0)));
    queue.drop_front();
    assert_eq!((queue.front(), queue.dropped()), (Some(&frame(1)), 1));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Nothing is lost unseen, nothing twice, errors are counted, and a turn is bounded.
    #[test]
    fn every_frame_is_accounted_for(
        moods in proptest::collection::vec(
            prop_oneof![Just(Mood::Takes), Just(Mood::Busy), Just(Mood::Off), Just(Mood::Swaps)], 0..200,
        ),
        pushes in proptest::collection::vec(0..5_usize, 0..60),
    ) {
        let mut queue = TransmitQueue::<DataFrame, 4>::new();
        let mut controller = Controller::new(moods.clone());
        let (mut number, mut accepted) = (0, 0);
        for count in pushes {
            for _ in 0..count {
                queue.enqueue(frame(number));
                number += 1;
            }
            let before = controller.tries;
            accepted += queue.service(&mut controller);
            prop_assert!(controller.tries - before <= 4);
        }
        let held = usize::from(controller.held.is_some());
        prop_assert_eq!(controller.sent.len() + held, accepted);
        prop_assert_eq!(accepted + queue.len() + queue.dropped() as usize, number);
    }
}

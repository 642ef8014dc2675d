//! Bits of what waits in RAM between pipeline and network: windows and estimates.

use super::Effects;
use crate::campaign::board::Remembering;
use crate::campaign::draw::Draw;
use crate::campaign::fault::Span;
use crate::campaign::scene::{STATE_EVERY, Scene};
use gyronet::model::{Estimate, GyroNet, WindowNetwork};
use gyronet::sample::RATE_HZ;
use gyronet::units::AngularRate;
use gyronet::window::{FEATURES, Features, WINDOW};

/// Rows of a run: the flip after 1.5 s, then 2.5 s.
const ROWS: usize = 400;
/// The window that the flip is in, counted from the run's start.
const AT: usize = 30;

/// What the bit is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The features of a window, 32 bits each.
    Window,
    /// The corrections of an estimate and its scale, 32 bits each.
    Estimate,
}

/// A network that a bit flips before or behind, once.
struct Upset<N> {
    network: N,
    place: Place,
    bit: usize,
    asked: usize,
}

impl<N: WindowNetwork> WindowNetwork for Upset<N> {
    fn estimate(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.asked += 1;
        let (word, mask) = (self.bit / 32, 1 << (self.bit % 32));
        match self.place {
            Place::Window if self.asked == AT => {
                let mut window = *window;
                window[word / FEATURES][word % FEATURES] ^= mask;
                self.network.estimate(&window)
            }
            Place::Estimate if self.asked == AT => {
                let mut estimate = self.network.estimate(window);
                let AngularRate(code) = estimate.corrections.get_mut(word).unwrap_or(&mut estimate.scale);
                *code ^= mask;
                estimate
            }
            _ => self.network.estimate(window),
        }
    }
}

/// Flips `bits` bits, one a run, each somewhere in the drive.
pub fn flip(
    place: Place,
    scene: &Scene<'_>,
    network: &mut GyroNet<'_>,
    (bits, seed): (usize, u64),
    mut tick: impl FnMut(),
) -> Effects {
    let words = match place {
        Place::Window => WINDOW * FEATURES,
        Place::Estimate => WINDOW + 1,
    };
    let states = (scene.rows() - ROWS) / STATE_EVERY;
    // Static initialisation is over, and a second has been good.
    let first = 6;
    let mut draw = Draw::new(seed, place as u64);
    let mut effects = Effects::default();
    for _ in 0..bits {
        let from = (first + draw.below(states.saturating_sub(first))) * STATE_EVERY;
        let span = Span { from, to: from + ROWS, healthy: 0 };
        let remembering = Remembering { network: &mut *network, known: &scene.known };
        let mut upset = Upset { network: remembering, place, bit: draw.below(32 * words), asked: 0 };
        let at = scene.drive.readings[from + RATE_HZ as usize].at;
        let outcome = scene.run_on(span, &[], Some(at), &mut upset, |_, _| {});
        effects.count(
            outcome.told_after.is_some() && !outcome.is_undetected(),
            outcome.moved,
            outcome.moved_sigmas,
        );
        tick();
    }
    effects
}

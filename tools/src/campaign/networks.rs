//! This module runs both networks of the board and caches their estimates for an undamaged drive, because most
//! windows of a damaged run are the same.

use gyronet::model::fognet::{FogEstimate, FogNetState, MinuteNetwork};
use gyronet::model::seconds::{Second, SecondsWindow};
use gyronet::model::window::{Features, WINDOW};
use gyronet::model::{Blob, Estimate, FogBlob, FogNet, GyroNet, SCALE_MIN, WindowNetwork, weights};
use gyronet::units::{Angle, AngularRate};
use std::collections::HashMap;
use std::sync::OnceLock;

/// Estimates the windows of a board.
pub trait Networks {
    /// Returns GyroNet's estimate of a window.
    fn window(&mut self, window: &[Features; WINDOW]) -> Estimate;
    /// Returns FoGNet's estimate of a window.
    fn minute(&mut self, window: &SecondsWindow<'_>) -> FogEstimate;
}

/// Holds the integer networks.
pub struct Integer<'a> {
    gyronet: GyroNet<'a>,
    fognet: FogNet<'static, 'static>,
}

impl<'a> Integer<'a> {
    /// Creates GyroNet with these weights, and FoGNet with the library's.
    ///
    /// # Panics
    /// If the library's own weights are refused.
    #[must_use]
    pub fn new(blob: Blob<'a>) -> Self {
        let fog = FogBlob::new_checked(&weights::FOGNET.0).expect("they come with the library");
        // Leaks one state per thread, which lives as long as the program.
        let state = Box::leak(Box::new(FogNetState::ZERO));
        Self { gyronet: GyroNet::new(blob), fognet: FogNet::new(fog, state) }
    }
}

impl Networks for Integer<'_> {
    fn window(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.gyronet.estimate(window)
    }

    fn minute(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        self.fognet.estimate(window)
    }
}

/// Holds the windows of an undamaged drive, and the networks' estimate of each once it has been computed.
#[derive(Debug, Clone, Default)]
pub struct Known {
    /// GyroNet's windows, one ending at each sample.
    pub windows: HashMap<[Features; WINDOW], OnceLock<Estimate>>,
    minutes: HashMap<Vec<Second>, OnceLock<FogEstimate>>,
}

/// Computes each window of an undamaged drive only once, because few windows of a run are new.
pub struct Remembering<'a, N> {
    /// The networks that estimate windows not in the cache.
    pub networks: &'a mut N,
    /// The cache.
    pub known: &'a Known,
}

impl<N: Networks> Networks for Remembering<'_, N> {
    fn window(&mut self, window: &[Features; WINDOW]) -> Estimate {
        let Self { networks, known } = self;
        match known.windows.get(window) {
            Some(answer) => *answer.get_or_init(|| networks.window(window)),
            None => networks.window(window),
        }
    }

    fn minute(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        let Self { networks, known } = self;
        let seconds: Vec<Second> = window.iter().copied().collect();
        match known.minutes.get(&seconds) {
            Some(answer) => *answer.get_or_init(|| networks.minute(window)),
            None => networks.minute(window),
        }
    }
}

/// Records the windows that it gets, and estimates no correction.
#[derive(Debug, Default)]
pub struct Collecting(pub Known);

impl Networks for Collecting {
    fn window(&mut self, window: &[Features; WINDOW]) -> Estimate {
        self.0.windows.insert(*window, OnceLock::new());
        Estimate { corrections: [AngularRate::ZERO; WINDOW], scale: SCALE_MIN, ..Estimate::NONE }
    }

    fn minute(&mut self, window: &SecondsWindow<'_>) -> FogEstimate {
        self.0.minutes.insert(window.iter().copied().collect(), OnceLock::new());
        FogEstimate { correction: Angle::ZERO, linear: Angle::ZERO, gain: 0, clamped_inputs: 0 }
    }
}

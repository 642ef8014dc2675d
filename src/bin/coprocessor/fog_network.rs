//! Runs FoGNet in idle time, one piece of a window per step.

use gyronet::coprocessor::Coprocessor;
use gyronet::model::FogNet;
use gyronet::model::fognet::FogEstimate;
use gyronet::model::seconds::WindowCopy;

/// The network with its working memory.
pub struct FogParts {
    pub network: FogNet<'static, 'static>,
    /// Copy of the window that is due, from which the network loads: that takes longer than `output` may wait.
    pub window: WindowCopy,
}

/// FoGNet, and its progress through a window.
pub struct FogNetwork {
    parts: Option<&'static mut FogParts>,
    stage: Stage,
}

/// Progress through a window; the variants hold the number of the window.
#[derive(Clone, Copy, PartialEq)]
enum Stage {
    Waiting,
    Copied(u32),
    Running(u32),
}

impl FogNetwork {
    /// Returns a network without a window; without `parts` it never takes one.
    pub fn new(parts: Option<&'static mut FogParts>) -> Self {
        Self { parts, stage: Stage::Waiting }
    }

    /// Stops FoGNet until the next start, because its weights are being replaced.
    pub fn stop(&mut self) {
        *self = Self::new(None);
    }

    /// Returns whether FoGNet can take a window.
    pub fn is_waiting(&self) -> bool {
        self.parts.is_some() && self.stage == Stage::Waiting
    }

    /// Returns whether a window is in progress.
    pub fn is_running(&self) -> bool {
        self.stage != Stage::Waiting
    }

    /// Copies the window that is due, if any. Only this step needs the coprocessor.
    #[inline(never)]
    pub fn take(&mut self, coprocessor: &mut Coprocessor) {
        let (Some(parts), Some((number, window))) = (self.parts.as_mut(), coprocessor.fog_window()) else {
            return;
        };
        parts.window.take(&window);
        self.stage = Stage::Copied(number);
    }

    /// Computes a piece (0.23 M modelled cycles at most, which anything may interrupt); returns the estimate after
    /// the last piece.
    #[inline(never)]
    pub fn advance(&mut self) -> Option<(u32, FogEstimate)> {
        let FogParts { network, window } = self.parts.as_mut()?;
        match self.stage {
            Stage::Waiting => None,
            Stage::Copied(number) => {
                self.stage = window.window().map_or(Stage::Waiting, |window| {
                    network.start(&window);
                    Stage::Running(number)
                });
                None
            }
            Stage::Running(number) => {
                let estimate = network.advance()?;
                self.stage = Stage::Waiting;
                Some((number, estimate))
            }
        }
    }
}

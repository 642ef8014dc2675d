//! FoGNet in idle time: a piece of its window with every turn.

use gyronet::coprocessor::Coprocessor;
use gyronet::model::FogNet;
use gyronet::model::fognet::FogEstimate;
use gyronet::model::seconds::WindowCopy;

/// The network with its working memory.
pub struct FogParts {
    pub network: FogNet<'static, 'static>,
    /// The window that is due: the network loads it from here, since that takes longer than the output task may wait.
    pub window: WindowCopy,
}

/// The network, and how far it is with its window.
pub struct FogNetwork {
    parts: Option<&'static mut FogParts>,
    stage: Stage,
}

/// The window that is worked on, by its number.
#[derive(Clone, Copy, PartialEq)]
enum Stage {
    Waiting,
    Copied(u32),
    Running(u32),
}

impl FogNetwork {
    /// Begins without a window; without weights none is ever taken.
    pub fn new(parts: Option<&'static mut FogParts>) -> Self {
        Self { parts, stage: Stage::Waiting }
    }

    /// Stops for good: its weights are being replaced.
    pub fn stop(&mut self) {
        *self = Self::new(None);
    }

    /// Returns whether it could take a window.
    pub fn is_waiting(&self) -> bool {
        self.parts.is_some() && self.stage == Stage::Waiting
    }

    /// Returns whether a window is being worked on.
    pub fn is_running(&self) -> bool {
        self.stage != Stage::Waiting
    }

    /// Copies the window that is due, if one is, which is all that it needs the coprocessor for.
    #[inline(never)]
    pub fn take(&mut self, coprocessor: &mut Coprocessor) {
        let (Some(parts), Some((number, window))) = (self.parts.as_mut(), coprocessor.fog_window()) else {
            return;
        };
        parts.window.take(&window);
        self.stage = Stage::Copied(number);
    }

    /// Does a piece (0.23 M modelled cycles at most, which anything may interrupt); gives the estimate
    /// with the last one.
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

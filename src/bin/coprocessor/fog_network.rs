//! FoGNet in idle time: a piece of its window with every turn.

use gyronet::coprocessor::Coprocessor;
use gyronet::model::FogNet;
use gyronet::model::fognet::FogEstimate;

/// The network, and the number of the window that it works on.
pub struct FogNetwork {
    network: Option<&'static mut FogNet<'static, 'static>>,
    number: Option<u32>,
}

impl FogNetwork {
    /// Nothing to do yet; without good weights there never is.
    pub fn new(network: Option<&'static mut FogNet<'static, 'static>>) -> Self {
        Self { network, number: None }
    }

    /// Whether it could begin a window.
    pub fn is_waiting(&self) -> bool {
        self.network.is_some() && self.number.is_none()
    }

    /// Whether a window is being worked on.
    pub fn is_running(&self) -> bool {
        self.number.is_some()
    }

    /// Begins the window that is due, if one is: reads it, which is all that it needs the coprocessor for.
    #[inline(never)]
    pub fn begin(&mut self, coprocessor: &mut Coprocessor) -> bool {
        let (Some(network), Some((number, window))) = (self.network.as_mut(), coprocessor.fog_window())
        else {
            return false;
        };
        network.start(&window);
        self.number = Some(number);
        true
    }

    /// Does a piece (0.23 M modelled cycles at most, which anything may interrupt); gives the estimate
    /// with the last one.
    #[inline(never)]
    pub fn advance(&mut self) -> Option<(u32, FogEstimate)> {
        let number = self.number?;
        let estimate = self.network.as_mut()?.advance()?;
        self.number = None;
        Some((number, estimate))
    }
}

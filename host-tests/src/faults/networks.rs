//! The library's networks, as the board runs them.

use gyronet::coprocessor::Coprocessor;
use gyronet::model::fognet::{FogNetState, MinuteNetwork};
use gyronet::model::{Blob, FogBlob, FogNet, GyroNet, WindowNetwork, weights};

pub struct Networks {
    gyronet: GyroNet<'static>,
    fognet: FogNet<'static, 'static>,
}

impl Default for Networks {
    fn default() -> Self {
        let blob = Blob::new_checked(&weights::DEFAULT.0).expect("the library's weights");
        let fog = FogBlob::new_checked(&weights::FOGNET.0).expect("the library's weights");
        // One state per thread, which lives as long as the program.
        let state = Box::leak(Box::new(FogNetState::ZERO));
        Self { gyronet: GyroNet::new(blob), fognet: FogNet::new(fog, state) }
    }
}

impl Networks {
    /// Runs the windows that are due.
    pub fn run(&mut self, coprocessor: &mut Coprocessor) {
        if let Some(due) = coprocessor.window() {
            let estimate = self.gyronet.estimate(&due.features);
            coprocessor.deliver(due.end, estimate).expect("the window that is due");
        }
        let minute = coprocessor.fog_window();
        let minute = minute.map(|(number, window)| (number, self.fognet.estimate(&window)));
        if let Some((number, estimate)) = minute {
            coprocessor.deliver_fog(number, estimate).expect("the window that is due");
        }
    }
}

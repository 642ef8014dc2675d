//! The results of one drive, for the summary that `gyronet demo` prints and for its page.

mod learnt;
mod page;
mod trajectory;
mod tunnel;

use crate::drive::stream::Drive;
use crate::evaluate::rates::Rates;
use crate::evaluate::report::DriveErrors;
use serde_json::Value;

pub use learnt::Learnt;
pub use trajectory::{Path, Trajectories};
pub use tunnel::Tunnel;

#[derive(Debug)]
pub struct Demo<'a> {
    pub drive: &'a Drive<'a>,
    pub simulated: bool,
    pub rates: &'a Rates,
    pub errors: Option<&'a DriveErrors>,
    /// The path of the vehicle by each method, where the drive has wheels.
    pub trajectories: Option<Trajectories>,
    pub tunnel: Option<&'a Tunnel>,
    pub learnt: &'a Learnt,
    pub frames: u64,
}

impl Demo<'_> {
    pub fn summary(&self) -> Value {
        let mut json = serde_json::json!({
            "name": self.drive.name(),
            "simulated": self.simulated,
            "seconds": self.drive.facts.seconds(),
            "samples": self.drive.facts.rows,
            "missing": self.drive.facts.missing,
            "over_best_classical": self.errors.and_then(|errors| errors.over_best_classical),
            "methods": self.errors.map(|errors| &errors.methods),
            "paths": self.trajectories.as_ref().map(|trajectories| &trajectories.paths),
            // As `gyronet evaluate --outage` has it.
            "outage": self.tunnel.map(|tunnel| &tunnel.outages.outage),
            "frames": self.frames,
        });
        json.as_object_mut().into_iter().for_each(|results| results.retain(|_, value| !value.is_null()));
        json
    }

    pub fn page(&self) -> String {
        page::page(self)
    }
}

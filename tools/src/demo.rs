//! The results of one drive, for the summary that `gyronet demo` prints and for its page.

mod page;
mod sent;
mod trajectory;
mod tunnel;

use crate::drive::stream::Drive;
use crate::evaluate::methods::PerMethod;
use crate::evaluate::outage_table::ByLength;
use crate::evaluate::rates::Rates;
use crate::evaluate::report::{Comparisons, DriveErrors, Row};
use serde::Serialize;

pub use sent::write_log;
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
    /// The tunnels, where the drive has courses.
    pub tunnel: Option<&'a Tunnel>,
    /// Messages of the whole drive.
    pub frames: u64,
}

#[derive(Debug, Serialize)]
pub struct Summary<'a> {
    name: &'a str,
    simulated: bool,
    seconds: f64,
    samples: usize,
    missing: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    over_best_classical: Option<Comparisons>,
    #[serde(skip_serializing_if = "Option::is_none")]
    methods: Option<&'a PerMethod<Row>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    paths: Option<&'a [Path]>,
    /// As `gyronet evaluate --outage` has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    outage: Option<&'a ByLength>,
    frames: u64,
}

impl<'a> Demo<'a> {
    /// Computes the results that the rates do not contain.
    pub fn new(
        drive: &'a Drive<'a>,
        simulated: bool,
        rates: &'a Rates,
        errors: Option<&'a DriveErrors>,
        tunnel: Option<&'a Tunnel>,
        frames: u64,
    ) -> Self {
        Self {
            drive,
            simulated,
            rates,
            errors,
            trajectories: Trajectories::new(drive, rates),
            tunnel,
            frames,
        }
    }

    pub fn summary(&self) -> Summary<'_> {
        Summary {
            name: self.drive.name(),
            simulated: self.simulated,
            seconds: self.drive.facts.seconds(),
            samples: self.drive.facts.rows,
            missing: self.drive.facts.missing,
            over_best_classical: self.errors.and_then(|errors| errors.over_best_classical),
            methods: self.errors.map(|errors| &errors.methods),
            outage: self.tunnel.map(|tunnel| &tunnel.outages.outage),
            paths: self.trajectories.as_ref().map(|trajectories| trajectories.paths.as_slice()),
            frames: self.frames,
        }
    }

    pub fn page(&self) -> String {
        page::page(self)
    }
}

//! The tunnels of a drive: GNSS is hidden for a minute, now and then, and each method goes on without it.

use crate::drive::error::DataError;
use crate::drive::stream::Drive;
use crate::drive::word;
use crate::evaluate::methods::Method;
use crate::evaluate::outage_table::{Figures, Outages};
use crate::evaluate::{outage, outage_chart};
use gyronet::model::WindowNetwork;
use gyronet::pipeline::PipelineConfig;
use std::fmt;

/// Length of a tunnel, s.
const SECONDS: usize = 60;
/// Length of a drive up to which every start is taken, s; of longer drives as many.
const ALL_S: f64 = 1_800.0;
/// Fewest starts whose worst says something.
const FOR_WORST: usize = 20;
/// The rows of the table; ours is the last one.
const ROWS: [Method; 4] = [Method::STATIC_ZERO_RATE, Method::EKF, Method::NO_MODEL, Method::DELAYED];

#[derive(Debug, Clone, PartialEq)]
pub struct Tunnel {
    pub outages: Outages,
    /// The command for all starts of the drive, if these are fewer.
    pub command: Option<String>,
    /// The median tunnel, as an SVG.
    pub picture: String,
}

impl Tunnel {
    /// Runs the tunnels with a start every so many seconds; `None` if the drive has too little course or reference for
    /// one.
    pub fn new(
        drive: &Drive<'_>,
        network: &mut dyn WindowNetwork,
        every_s: usize,
    ) -> Result<Option<Self>, DataError> {
        if !drive.rows()?.any(|row| row.is_ok_and(|row| row.heading.is_some())) {
            return Ok(None);
        }
        let fewer = (drive.facts.seconds() / ALL_S).ceil() as usize;
        let (found, _) =
            outage::run(drive, network, &[SECONDS], every_s * fewer, PipelineConfig::DEFAULT, || {})?;
        let outages = Outages::new(drive.name(), &[SECONDS], std::iter::once(found.as_slice()));
        let Some([(median, which), _]) =
            outage_chart::typical(found.iter()).filter(|_| !outages.outage[&SECONDS].is_empty())
        else {
            return Ok(None);
        };
        let command = (fewer > 1)
            .then(|| format!("cargo gyronet evaluate {} --outage {SECONDS}", word(drive.path.as_ref())));
        let points = outage::trace(drive, network, median, PipelineConfig::DEFAULT)?;
        let picture = outage_chart::svg(drive.name(), &which, median, &points);
        Ok(Some(Self { outages, command, picture }))
    }

    fn row(&self, method: Method) -> Option<&Figures> {
        self.outages.outage.get(&SECONDS)?.get(method.key)
    }

    #[must_use]
    pub fn title(&self) -> String {
        let starts = self.row(Method::DELAYED).map_or(0, |figures| figures.starts);
        format!("{SECONDS} s without GNSS, {starts} start{}", if starts == 1 { "" } else { "s" })
    }

    /// Returns the name of each method, and its median and worst error of heading and position.
    pub fn rows(&self) -> impl Iterator<Item = [String; 5]> {
        ROWS.into_iter().filter_map(|method| {
            let Figures { heading_deg, position_m, starts, .. } = self.row(method)?;
            let figure =
                |known: Option<f64>| known.map_or_else(|| "-".to_owned(), |known| format!("{known:.2}"));
            let [heading, position] = [Some(heading_deg), position_m.as_ref()].map(|spread| {
                let worst = spread.map(|spread| spread.worst).filter(|_| *starts >= FOR_WORST);
                [spread.map(|spread| spread.median), worst].map(figure)
            });
            let name = if method == Method::DELAYED { "gyronet" } else { method.name };
            let ([heading, worst], [position, farthest]) = (heading, position);
            Some([name.to_owned(), heading, worst, position, farthest])
        })
    }
}

impl fmt::Display for Tunnel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let title = format!("{} (median, worst)", self.title());
        writeln!(f, "{title:<47}{:>15}{:>16}", "heading, deg", "position, m")?;
        for [name, heading, worst, position, farthest] in self.rows() {
            writeln!(f, "  {name:<45}{heading:>7}{worst:>8}{position:>8}{farthest:>8}")?;
        }
        self.command.iter().try_for_each(|command| writeln!(f, "  All starts: {command}"))
    }
}

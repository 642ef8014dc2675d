//! The tunnels of a drive: GNSS is hidden for a minute, now and then, and each method goes on without it.

use crate::drive::error::DataError;
use crate::drive::stream::Drive;
use crate::evaluate::methods::Method;
use crate::evaluate::outage;
use crate::evaluate::outage_chart;
use crate::evaluate::outage_table::{Figures, Outages, Spread};
use gyronet::model::WindowNetwork;
use std::fmt;

/// Length of a tunnel, and the time from one entrance to the next, s.
const SECONDS: usize = 60;
const EVERY_S: usize = 100;
/// The rows of the table; ours is the last one.
const ROWS: [Method; 4] = [Method::STATIC_ZERO_RATE, Method::EKF, Method::NO_MODEL, Method::DELAYED];

#[derive(Debug, Clone, PartialEq)]
pub struct Tunnel {
    pub outages: Outages,
    /// The median tunnel, as an SVG.
    pub picture: String,
}

impl Tunnel {
    /// Runs the tunnels; `None` if the drive has too little course or reference for one.
    pub fn new(drive: &Drive<'_>, network: &mut dyn WindowNetwork) -> Result<Option<Self>, DataError> {
        if !drive.rows()?.any(|row| row.is_ok_and(|row| row.heading.is_some())) {
            return Ok(None);
        }
        let (found, _) = outage::run(drive, network, &[SECONDS], EVERY_S, || {})?;
        let outages = Outages::new(drive.name(), std::iter::once(found.as_slice()));
        let Some([(median, which), _]) =
            outage_chart::typical(found.iter()).filter(|_| !outages.outage.is_empty())
        else {
            return Ok(None);
        };
        let points = outage::trace(drive, network, median)?;
        Ok(Some(Self { picture: outage_chart::svg(drive.name(), &which, median, &points), outages }))
    }

    fn row(&self, method: Method) -> Option<&Figures> {
        self.outages.outage.get(&SECONDS)?.get(method.key)
    }

    /// Returns how much of the best other row's median error ours has.
    #[must_use]
    pub fn over_best(&self) -> Option<f64> {
        let others = ROWS.iter().filter(|method| **method != Method::DELAYED && **method != Method::NO_MODEL);
        let best =
            others.filter_map(|method| Some(self.row(*method)?.heading_deg.median)).min_by(f64::total_cmp)?;
        Some(self.row(Method::DELAYED)?.heading_deg.median / best)
    }
}

impl fmt::Display for Tunnel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let starts = self.row(Method::DELAYED).map_or(0, |figures| figures.starts);
        let starts = if starts == 1 { "1 start".to_owned() } else { format!("{starts} starts") };
        let title = format!("{SECONDS} s without GNSS, {starts} (median, worst)");
        writeln!(f, "{title:<47}{:>15}{:>16}", "heading, deg", "position, m")?;
        for method in ROWS {
            let Some(Figures { heading_deg, position_m, .. }) = self.row(method) else { continue };
            let two = |spread: &Spread| format!("{:.2}{:>8.2}", spread.median, spread.worst);
            let name = if method == Method::DELAYED { "gyronet" } else { method.name };
            let position = position_m.as_ref().map_or_else(|| "-".to_owned(), two);
            writeln!(f, "  {name:<45}{:>15}{position:>16}", two(heading_deg))?;
        }
        Ok(())
    }
}

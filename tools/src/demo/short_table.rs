//! Prints the heading errors that matter most, in degrees; `gyronet evaluate` prints all of them.

use crate::evaluate::methods::Method;
use crate::evaluate::report::DriveErrors;
use std::fmt;

/// The table of a drive: the gyro alone, static initialisation, the best classical method, and both rates that the board
/// sends.
#[derive(Debug, Clone, Copy)]
pub struct ShortTable<'a>(pub &'a DriveErrors);

impl fmt::Display for ShortTable<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let errors = self.0;
        let is_best = |method: &Method| {
            errors.over_best_classical.is_some_and(|ours| ours.default.best_classical == method.key)
        };
        let best = Method::CLASSICAL.into_iter().filter(is_best);
        writeln!(f, "{:<50}{:>9}{:>9}{:>19}", "heading error, deg", "in 1 s", "in 60 s", "whole drive, RMS")?;
        for method in [Method::RAW, Method::STATIC].into_iter().filter(|method| !is_best(method)).chain(best)
        {
            let note = if is_best(&method) { " (best classical method)" } else { "" };
            self.row(f, method, &format!("{}{note}", method.name))?;
        }
        for method in [Method::LIVE, Method::DELAYED] {
            let delay = errors.methods[method].cost.delay_ms;
            self.row(f, method, &format!("gyronet, {} ({delay} ms delay)", method.name))?;
        }
        Ok(())
    }
}

impl ShortTable<'_> {
    fn row(&self, f: &mut fmt::Formatter<'_>, method: Method, name: &str) -> fmt::Result {
        let error = self.0.methods[method].error;
        let degrees = |rad: Option<f64>, decimals: usize| {
            rad.map_or_else(|| "-".into(), |rad| format!("{:.decimals$}", rad.to_degrees()))
        };
        let [in_1s, in_60s, rms] =
            [degrees(error.mean_1s_rad, 4), degrees(error.mean_60s_rad, 2), degrees(error.rms_rad, 2)];
        writeln!(f, "  {name:<48}{in_1s:>9}{in_60s:>9}{rms:>19}")
    }
}

//! The table of the situations.

use super::judge::Outcome;
use super::known;
use super::list::Situation;

pub const HEADING: &str = "situation                                        vehicle  seconds  good  in 1 sigma  \
    worst second  worst span  what is wrong";

/// A line of the table; the worst errors are in sigma.
pub fn line(situation: &Situation, vehicle: &str, outcome: &Outcome) -> String {
    let broken: Vec<String> = outcome.broken().into_iter().map(|(_, text)| text).collect();
    let known = known::owner(situation.name).filter(|_| !broken.is_empty());
    format!(
        "{:48} {vehicle:7} {:8} {:3.0} % {:9.0} % {:13.1} {:11.1}  {}{}\n",
        situation.name,
        outcome.seconds,
        100.0 * outcome.good as f64 / outcome.seconds as f64,
        100.0 * outcome.inside as f64 / outcome.good.max(1) as f64,
        4.0 * outcome.second.ratio,
        4.0 * outcome.span.ratio,
        known.map_or(String::new(), |owner| format!("(known, {owner}) ")),
        broken.join("; "),
    )
}

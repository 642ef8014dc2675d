//! The table of the situations.

use super::judge::Outcome;

pub const HEADING: &str = "situation                                        vehicle  seconds  good  in 1 sigma: straight, \
    turning  worst second    span  minute  what is wrong";

/// A line of the table; the worst errors are in sigma.
pub fn line(situation: &str, vehicle: &str, outcome: &Outcome) -> String {
    let broken: Vec<String> = outcome.broken().into_iter().map(|(_, text)| text).collect();
    let [straight, turning] = outcome.inside;
    format!(
        "{situation:48} {vehicle:7} {:8} {:3.0} % {:19.0} % {:6.0} % {:13.1} {:7.1} {:7.1}  {}\n",
        outcome.seconds,
        100.0 * outcome.good as f64 / outcome.seconds as f64,
        straight.percent(),
        turning.percent(),
        4.0 * outcome.second.ratio,
        4.0 * outcome.span.ratio,
        4.0 * outcome.minute.ratio,
        broken.join("; "),
    )
}

//! Formats the newest values as text and as JSON.

use super::{Counts, Monitor, State};
use gyronet::can::yaw::Faults;
use std::fmt;

/// The fault bits and their names.
const FAULTS: [(Faults, &str); 8] = [
    (Faults::GAP, "gap"),
    (Faults::CLIPPED, "clipped"),
    (Faults::STUCK, "stuck"),
    (Faults::IMPLAUSIBLE, "implausible"),
    (Faults::LATE, "late"),
    (Faults::STORED, "stored"),
    (Faults::WHEELS, "wheels"),
    (Faults::BUS, "bus"),
];

fn fault_names(faults: Faults) -> String {
    let present = FAULTS.iter().filter(|(fault, _)| faults.0 & fault.0 != 0).map(|(_, name)| *name);
    let names: Vec<&str> = present.collect();
    if names.is_empty() { "none".into() } else { names.join("+") }
}

/// Formats a number with fixed decimals, or a dash.
fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".into(), |value| format!("{value:.decimals$}"))
}

/// Rounds a value by way of text: the product of a code and its scale would print with all binary digits.
fn rounded(value: Option<f64>, decimals: usize) -> Option<f64> {
    value.and_then(|value| format!("{value:.decimals$}").parse().ok())
}

fn values(state: &State) -> serde_json::Value {
    let (source, quality) = judgement(state);
    serde_json::json!({
        "rate_deg_per_s": rounded(state.rate, 6), "yaw_deg": rounded(state.yaw, 8),
        "source": source, "quality": quality, "faults": fault_names(state.faults),
        "correction_deg_per_s": rounded(state.correction, 4), "sigma_deg_per_s": rounded(state.sigma, 5),
        "latency_ms": rounded(state.latency, 1),
    })
}

fn judgement(state: &State) -> (String, String) {
    let Some((source, quality)) = state.judgement else { return ("-".into(), "-".into()) };
    (format!("{source:?}"), format!("{quality:?}").to_lowercase())
}

impl Monitor {
    /// Returns the newest values, those of a fibre-optic gyro too, and all counts as JSON; unknown values
    /// are null.
    pub fn json(&self, time: f64) -> serde_json::Value {
        let Counts { frames, foreign, lost, repeated, out_of_sequence, damaged, unreadable } = self.counts;
        let mut all = values(&self.state);
        for (name, value) in [
            ("time_s", rounded(Some(time), 6).into()),
            ("drop_in_deg_per_s", rounded(self.drop_in, 3).into()),
            ("fog", self.fog.as_ref().map(values).into()),
            ("frames", frames.into()),
            ("foreign", foreign.into()),
            ("lost", lost.into()),
            ("repeated", repeated.into()),
            ("out_of_sequence", out_of_sequence.into()),
            ("damaged", damaged.into()),
            ("unreadable", unreadable.into()),
        ] {
            all[name] = value;
        }
        all
    }

    /// Returns the newest values as one line of readable text.
    pub fn line(&self, time: f64) -> String {
        let (source, quality) = judgement(&self.state);
        let Counts { lost, repeated, out_of_sequence, damaged, unreadable, .. } = self.counts;
        format!(
            "{time:.1} s: rate {} deg/s, yaw {} deg, {source}, {quality}, faults {}, {} frames/s, lost {lost}, \
             repeated {repeated}, out of sequence {out_of_sequence}, damaged {damaged}, unreadable {unreadable}",
            number(self.state.rate, 6),
            number(self.state.yaw, 6),
            fault_names(self.state.faults),
            number(self.frames_per_second, 1),
        )
    }
}

/// Writes a line for a terminal: name, value, and unit or remark.
fn row(
    f: &mut fmt::Formatter<'_>,
    name: &str,
    value: impl fmt::Display,
    more: impl fmt::Display,
) -> fmt::Result {
    writeln!(f, "{name:<16}{value:>14}{more}")
}

/// Writes the rate, the yaw, the source and the faults of a set.
fn rows(f: &mut fmt::Formatter<'_>, state: &State) -> fmt::Result {
    let (source, quality) = judgement(state);
    row(f, "yaw rate", number(state.rate, 6), " deg/s")?;
    row(f, "yaw", number(state.yaw, 6), " deg")?;
    row(f, "source", source, format_args!(", {quality}"))?;
    row(f, "faults", fault_names(state.faults), "")
}

/// Writes the newest values and all counts as lines for a terminal.
impl fmt::Display for Monitor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let State { correction, sigma, latency, .. } = self.state;
        let Counts { frames, foreign, lost, repeated, out_of_sequence, damaged, unreadable } = self.counts;
        rows(f, &self.state)?;
        row(f, "expected error", number(sigma, 5), " deg/s")?;
        row(f, "correction", number(correction, 4), " deg/s")?;
        row(f, "latency", number(latency, 1), " ms")?;
        row(f, "drop-in rate", number(self.drop_in, 3), " deg/s")?;
        let pace = number(self.frames_per_second, 1);
        row(f, "messages", frames, format_args!(", {foreign} of others, {pace} a second"))?;
        row(f, "lost", lost, format_args!(", repeated {repeated}, out of sequence {out_of_sequence}"))?;
        row(f, "damaged", damaged, format_args!(", unreadable lines {unreadable}"))?;
        self.fog.as_ref().map_or(Ok(()), |fog| {
            writeln!(f, "fibre-optic gyro")?;
            rows(f, fog)
        })
    }
}

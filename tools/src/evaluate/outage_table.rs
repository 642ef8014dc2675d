//! The errors of many outages, as a table and as JSON: median, 90 % and worst of each method.

use super::methods::Method;
use super::outage::{AFTER_S, Outage};
use super::outage_path::METHODS;
use super::report::FAILED;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    pub median: f64,
    pub p90: f64,
    pub worst: f64,
}

impl Spread {
    pub fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.collect();
        values.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| values.get((share * (values.len() as f64 - 1.0)).round() as usize).copied();
        Some(Self { median: at(0.5)?, p90: at(0.9)?, worst: at(1.0)? })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// Drives with a start, and all their starts.
    pub drives: usize,
    pub starts: usize,
    pub heading_deg: Spread,
    /// Starts before which a rest had shown the bias, and the errors after these alone.
    pub rested_starts: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rested_heading_deg: Option<Spread>,
    /// What the heading moves the end of the path by wheels or GNSS speed, m, and the same in % of the distance, of a metre at least.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_m: Option<Spread>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_percent: Option<Spread>,
    /// Share of the starts whose error is inside the one that the board expects; of its own rate, over whole minutes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inside: Option<f64>,
}

impl Figures {
    /// Median, 90 % and worst of heading, position and its share of the distance, as far as they are known.
    fn columns(&self) -> Vec<f64> {
        let spreads = [Some(self.heading_deg), self.position_m, self.position_percent].into_iter().flatten();
        spreads.flat_map(|Spread { median, p90, worst }| [median, p90, worst]).collect()
    }
}

/// The methods that a user has without gyronet.
const CLASSICAL: [Method; 4] = [Method::STATIC, Method::STATIC_ZERO_RATE, Method::VQF, Method::EKF];

pub type ByLength = BTreeMap<usize, BTreeMap<&'static str, Figures>>;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outages {
    pub set: String,
    /// After 60 s with a course.
    pub outage: ByLength,
    pub outage_after_20_s: ByLength,
}

impl Outages {
    /// Sums up the outages of these lengths of each drive.
    pub fn new<'a>(set: &str, lengths: &[usize], drives: impl Iterator<Item = &'a [Outage]> + Clone) -> Self {
        let [outage, outage_after_20_s] = AFTER_S.map(|after| {
            let mut lengths: ByLength = lengths.iter().map(|length| (*length, BTreeMap::new())).collect();
            for (length, methods) in &mut lengths {
                let is_of = |one: &&Outage| one.seconds == *length && one.driven_s >= after as f64;
                let chosen = drives.clone().flatten().filter(is_of);
                let with_one = drives.clone().filter(|drive| drive.iter().any(|one| is_of(&one))).count();
                for (k, method) in METHODS.iter().enumerate() {
                    let moved = chosen.clone().filter_map(|one| one.position);
                    let heading = |one: &Outage| one.heading[k].to_degrees();
                    let heading_deg = Spread::of(chosen.clone().map(heading));
                    let rested = chosen.clone().filter(|one| one.is_rested);
                    methods.extend(heading_deg.map(|heading_deg| {
                        let figures = Figures {
                            drives: with_one,
                            starts: chosen.clone().count(),
                            heading_deg,
                            rested_starts: rested.clone().count(),
                            rested_heading_deg: Spread::of(rested.map(heading)),
                            position_m: Spread::of(moved.clone().map(|(_, ends)| ends[k])),
                            position_percent: Spread::of(
                                moved.map(|(way, ends)| 100.0 * ends[k] / way.max(1.0)),
                            ),
                            inside: (*method == Method::DELAYED).then(|| inside(chosen.clone(), k)).flatten(),
                        };
                        (method.key, figures)
                    }));
                }
            }
            lengths
        });
        Self { set: set.to_owned(), outage, outage_after_20_s }
    }
}

/// Returns the share of outages whose error is inside the expected one; `None` without one.
fn inside<'a>(outages: impl Iterator<Item = &'a Outage>, method: usize) -> Option<f64> {
    let inside: Vec<bool> =
        outages.filter_map(|one| one.expected.map(|expected| one.heading[method] <= expected)).collect();
    (!inside.is_empty()).then(|| inside.iter().filter(|is| **is).count() as f64 / inside.len() as f64)
}

impl fmt::Display for Outages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (after, lengths) in AFTER_S.iter().zip([&self.outage, &self.outage_after_20_s]) {
            for (length, methods) in lengths {
                let Some(Figures { drives, starts, .. }) = methods.values().next() else {
                    writeln!(
                        f,
                        "{}: {length} s without GNSS after {after} s with it: no start; it needs {after} s with a course \
                         every 2 s, then {length} s, and a reference at both ends",
                        self.set
                    )?;
                    continue;
                };
                let [drives, starts] = [(drives, "drive"), (starts, "start")]
                    .map(|(count, noun)| format!("{count} {noun}{}", if *count == 1 { "" } else { "s" }));
                writeln!(
                    f,
                    "{}, {drives}: {length} s without GNSS after {after} s with it, {starts}",
                    self.set
                )?;
                let wheels = methods.values().any(|figures| figures.position_m.is_some());
                let position = if wheels { "position, m" } else { "position: no speed" };
                let percent = if wheels { "% of the distance" } else { "" };
                let head = format!(
                    "  {:<26}{:>25}{position:>25}{percent:>25}",
                    "median, 90 %, worst", "heading, deg"
                );
                writeln!(f, "{}", head.trim_end())?;
                let median = |method: Method| Some(methods.get(method.key)?.heading_deg.median);
                let has_failed = |method| median(method) > median(Method::STATIC).map(|still| FAILED * still);
                let mut best: Option<Vec<f64>> = None;
                for method in METHODS {
                    let Some(figures) = methods.get(method.key) else { continue };
                    let mark = if has_failed(method) { " ?" } else { "" };
                    let columns = figures.columns();
                    write_row(f, &format!("{}{mark}", method.name), &columns, figures.starts)?;
                    if CLASSICAL.contains(&method) {
                        let least = best.get_or_insert_with(|| columns.clone());
                        least.iter_mut().zip(columns).for_each(|(least, own)| *least = least.min(own));
                    }
                    if method == Method::EKF {
                        write_row(
                            f,
                            "best of these by column",
                            best.as_deref().unwrap_or(&[]),
                            figures.starts,
                        )?;
                    }
                }
                if METHODS.into_iter().any(has_failed) {
                    writeln!(f, "  ? failed: {FAILED} times static initialisation's median error")?;
                }
                if let Some(inside) = methods.get(Method::DELAYED.key).and_then(|figures| figures.inside) {
                    writeln!(
                        f,
                        "  gyronet's error is inside the one that it expects (0x1A3) at {:.0} % of the starts",
                        100.0 * inside
                    )?;
                }
                write_rested(f, methods)?;
            }
        }
        Ok(())
    }
}

fn write_row(f: &mut fmt::Formatter<'_>, name: &str, columns: &[f64], starts: usize) -> fmt::Result {
    write!(f, "  {name:<26}")?;
    for spread in columns.chunks(3) {
        let [median, p90, worst] = [0, 1, 2].map(|at| spread.get(at).copied().unwrap_or_default());
        // Of fewer starts it is the worst one.
        let p90 = if starts < 10 { "-".into() } else { format!("{p90:.2}") };
        write!(f, "{median:>9.2}{p90:>8}{worst:>8.2}")?;
    }
    writeln!(f)
}

/// Says at how many starts the methods that need a rest had none, and how the others went.
fn write_rested(f: &mut fmt::Formatter<'_>, methods: &BTreeMap<&'static str, Figures>) -> fmt::Result {
    let Some(Figures { starts, rested_starts, .. }) = methods.values().next() else { return Ok(()) };
    if rested_starts == starts {
        return Ok(());
    }
    writeln!(
        f,
        "  no rest had shown a bias before {} of {starts} starts: static, zero-rate updates and VQF get the gyro's rate there",
        starts - rested_starts
    )?;
    for method in [Method::STATIC_ZERO_RATE, Method::EKF, Method::DELAYED] {
        if let Some(Spread { median, p90, worst }) =
            methods.get(method.key).and_then(|figures| figures.rested_heading_deg)
        {
            let name = format!("{}, at the other {rested_starts}", method.name);
            writeln!(f, "  {name:<42}{median:>9.2}{p90:>8.2}{worst:>8.2}")?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_length_has_its_starts() {
        let outage = |driven_s: f64, seconds, error: f64| Outage {
            driven_s,
            seconds,
            start_s: 0.0,
            is_rested: seconds == 60 && driven_s > 80.0,
            heading: std::array::from_fn(|k| error * (k + 1) as f64),
            position: (seconds == 30).then(|| (200.0, std::array::from_fn(|k| (6 - k) as f64))),
            expected: (seconds == 60 && driven_s > 80.0).then_some(7.0 * error).or(Some(0.0)),
        };
        let all =
            [outage(30.0, 60, 0.3), outage(70.0, 60, 0.1), outage(90.0, 60, 0.2), outage(90.0, 30, 0.4)];
        let table = Outages::new("x", &[30, 60, 90], [&all[..1], &all[1..], &[]].into_iter());
        let of = |lengths: &ByLength, length: usize| lengths[&length]["static"];
        assert_eq!((of(&table.outage, 60).starts, of(&table.outage, 30).starts), (2, 1));
        assert_eq!((of(&table.outage, 60).drives, of(&table.outage_after_20_s, 60).drives), (1, 2));
        assert_eq!(of(&table.outage_after_20_s, 60).starts, 3);
        let text = table.to_string();
        assert!(text.starts_with("x, 1 drive: 30 s without GNSS after 60 s with it, 1 start\n"), "{text}");
        assert!(text.contains("position: no speed"), "{text}");
        for share in ["(0x1A3) at 50 % of the starts", "(0x1A3) at 33 % of the starts"] {
            assert_eq!(text.matches(share).count(), 1, "of two and of three starts one: {text}");
        }
        let columns = [22.92, 3.0, 1.5].map(|value| format!("{value:9.2}       -{value:8.2}")).concat();
        assert!(text.contains(&format!("  best of these by column   {columns}\n")), "{text}");
        assert!(
            text.contains("x: 90 s without GNSS after 60 s with it: no start; it needs 60 s with"),
            "{text}"
        );
        // The errors of two starts have no 90 %, and no method fails but one of ten times the first one's error.
        assert!(text.contains("  static initialisation         11.46       -   11.46\n"), "{text}");
        assert!(!text.contains('?'), "{text}");
        let failing = Outage { heading: [0.1, 0.1, 1.1, 0.1, 0.1, 0.1], ..outage(70.0, 60, 0.1) };
        let text = Outages::new("x", &[60], std::iter::once(&[failing][..])).to_string();
        assert!(text.contains("VQF filter ?") && text.matches("? failed: 10 times").count() == 2, "{text}");
        assert!(text.contains("  no rest had shown a bias before 1 of 1 start"), "{text}");
        let text = table.to_string();
        assert!(text.contains("  no rest had shown a bias before 1 of 2 starts: static"), "{text}");
        assert!(text.contains("  static, zero-rate updates, at the other 1     22.92"), "{text}");
        let heading = of(&table.outage_after_20_s, 60).heading_deg;
        assert!((heading.median - 0.2f64.to_degrees()).abs() < 1e-9, "{heading:?}");
        assert!((heading.worst - 0.3f64.to_degrees()).abs() < 1e-9, "{heading:?}");
    }
}

//! This module plots the runs with a single fault in two panels: the time until a receiver detects each kind of
//! fault, and how far yaw has moved by then.

use super::Run;
use super::fault::Kind;
use crate::plot::svg::{Axis, COLORS, Color, Figure, Marks, Panel, PlotError, Stroke};

const SIZE: (u32, u32) = (1200, 660);
const DETECTED: Color = COLORS[0];
const NAMED: Color = COLORS[4];
const UNDETECTED: Color = COLORS[1];
/// A panel shows about this many dots of a kind; more would overlap.
const DOTS: usize = 250;
/// Fractional part of the golden ratio: its multiples spread dots of one value evenly.
const GOLDEN: f64 = 0.618_034;

/// Plots the runs with a single fault.
///
/// # Errors
/// [`PlotError`] if the plotting library fails.
pub fn svg(runs: &[Run]) -> Result<String, PlotError> {
    let single: Vec<&Run> = runs.iter().filter(|run| run.faults.len() == 1).collect();
    let title = format!(
        "{} runs with one fault: reported (blue), on the named list (orange), undetected (red)",
        single.len()
    );
    let reported = |run: &Run| run.outcome()?.reported_after.map(|s| (1e3 * s).max(1.0));
    let moved = |run: &Run| run.outcome().map(|outcome| outcome.moved_limits.max(1e-3));
    let moved_label = "moved in a second before that, over the limit";
    let panels = vec![
        panel("reported after, ms", (0.8, 1.2e4), dots(&single, reported), None),
        panel(moved_label, (8e-4, 1e4), dots(&single, moved), Some(1.0)),
    ];
    Figure { title: &title, size: SIZE, side_by_side: true, legend: Vec::new(), panels }.svg()
}

/// Returns the runs of each kind that have a value, as value and height; the largest is always included.
fn dots(runs: &[&Run], value: impl Fn(&Run) -> Option<f64>) -> Vec<(f64, f64, Color)> {
    let of_kind = Kind::ALL.iter().enumerate().flat_map(|(height, wanted)| {
        let own = runs.iter().filter(|run| run.faults[0].kind == *wanted);
        let all: Vec<(f64, Color)> = own.filter_map(|run| Some((value(run)?, color(run)))).collect();
        let step = all.len().div_ceil(DOTS).max(1);
        let most = all.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0));
        let drawn: Vec<_> = all.into_iter().step_by(step).chain(most).collect();
        drawn.into_iter().map(move |(value, color)| (value, height as f64, color))
    });
    of_kind.collect()
}

fn color(run: &Run) -> Color {
    if run.is_failure() {
        UNDETECTED
    } else if run.exception().is_some() {
        NAMED
    } else {
        DETECTED
    }
}

/// Returns a panel with the kinds of faults one below the other and the values on a logarithmic axis.
fn panel(
    label: &'static str,
    (low, high): (f64, f64),
    dots: Vec<(f64, f64, Color)>,
    limit: Option<f64>,
) -> Panel<'static> {
    let bottom = Kind::ALL.len() as f64 - 0.5;
    // Dots of one value are spread across the kind's row.
    let beside = |n: usize| 0.6 * ((n as f64 * GOLDEN) % 1.0) - 0.3;
    let dots = dots.into_iter().enumerate();
    let dots = dots.map(|(n, (value, kind, color))| (value.min(high).log10(), kind + beside(n), color));
    let line = |limit: f64| {
        Marks::Line(Stroke::solid(UNDETECTED, 1), vec![(limit.log10(), -0.5), (limit.log10(), bottom)])
    };
    let ends = (low.log10(), high.log10());
    Panel {
        x: Axis { ticks: (ends.1 - ends.0) as usize + 1, format: &power_of_ten, ..Axis::new(label, ends) },
        y: Axis { ticks: Kind::ALL.len(), format: &kind_name, room: 118, ..Axis::new("", (bottom, -0.5)) },
        series: limit.map(line).into_iter().chain([Marks::Dots(dots.collect())]).collect(),
    }
}

fn power_of_ten(exponent: &f64) -> String {
    let value = 10f64.powf(*exponent);
    if value < 1.0 { format!("{value:.3}") } else { format!("{value:.0}") }
}

fn kind_name(height: &f64) -> String {
    let kind = Kind::ALL.get(height.round().max(0.0) as usize);
    kind.filter(|_| (height - height.round()).abs() < 0.01).map_or("", |kind| kind.name()).to_owned()
}

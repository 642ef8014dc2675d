//! This module draws temperature, bias, sigma and heading error of the drive on the motorway.

use super::State;
use crate::plot::svg::{Axis, COLORS, Figure, Marks, Panel, PlotError, Stroke};

const SIZE: (u32, u32) = (1000, 900);
/// Seconds that are averaged to one point.
const AVERAGED: usize = 30;

/// Draws the states.
///
/// # Errors
/// [`PlotError`], if the plotting library fails.
pub fn svg(states: &[State]) -> Result<String, PlotError> {
    let learned = Stroke::solid(COLORS[0], 2);
    let without = Stroke::solid(COLORS[1], 2);
    let minutes = |state: &State| state.seconds / 60.0;
    let line = |stroke: Stroke, of: fn(&State) -> f64| {
        let mean = |states: &[State]| states.iter().map(of).sum::<f64>() / states.len() as f64;
        let points = states.chunks(AVERAGED).map(|states| (minutes(&states[0]), mean(states)));
        Marks::Line(stroke, points.collect())
    };
    let panel = |label, curves: Vec<Marks>| {
        let values = curves.iter().flat_map(|marks| match marks {
            Marks::Line(_, points) => points.as_slice(),
            Marks::Bars(..) | Marks::Dots(_) => &[],
        });
        let (low, high) =
            values.fold((f64::MAX, f64::MIN), |(low, high), (_, y)| (low.min(*y), high.max(*y)));
        let edge = 0.05 * (high - low).max(1e-3);
        let ends = [states.first(), states.last()].map(|state| state.map_or(0.0, minutes));
        Panel {
            x: Axis::new("since the start, min", (ends[0], ends[1])),
            y: Axis::new(label, (low - edge, high + edge)),
            series: curves,
        }
    };
    let panels = vec![
        panel("temperature, deg C", vec![line(Stroke::TRUTH, |state| state.celsius)]),
        panel(
            "bias, deg/s",
            vec![
                line(without, |state| state.static_bias),
                line(learned, |state| state.curve_bias),
                line(Stroke::TRUTH, |state| state.true_bias),
            ],
        ),
        panel(
            "expected error, deg/h",
            vec![
                line(without, |state| 3_600.0 * state.static_sigma),
                line(learned, |state| 3_600.0 * state.curve_sigma),
            ],
        ),
        panel(
            "heading error, deg",
            vec![line(without, |state| state.static_error), line(learned, |state| state.curve_error)],
        ),
    ];
    let title = "Half an hour without a stop while the sensor warms up (simulated)";
    let legend = vec![
        ("truth".to_owned(), Stroke::TRUTH),
        ("static initialisation, zero-rate updates".to_owned(), without),
        ("with the bias curve".to_owned(), learned),
    ];
    Figure { title, size: SIZE, side_by_side: false, legend, panels }.svg()
}

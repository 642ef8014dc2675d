//! Draws one picture of a drive: the yaw of each method, and below it the error of each.

use crate::evaluate::methods::Method;
use crate::evaluate::metrics::integral;
use crate::evaluate::rates::Rates;
use crate::plot::curve::range;
use crate::plot::svg::{Axis, COLORS, Color, Figure, Marks, Panel, PlotError, Stroke};

/// The picture has this width and height, pixels.
const SIZE: (u32, u32) = (1200, 930);
/// The margin above and below the lines is this share of their extent.
const AIR: f64 = 0.06;
/// Lists the colours and widths of the methods. The wider line is drawn first, so that a line under another remains
/// visible.
const STYLES: [(Method, Color, u32); 5] = [
    (Method::RAW, COLORS[4], 2),
    (Method::STATIC, COLORS[0], 2),
    (Method::STATIC_ZERO_RATE, COLORS[3], 2),
    (Method::PROMPT, COLORS[6], 1),
    (Method::NAVIGATION, COLORS[1], 2),
];

/// Draws a drive as SVG.
pub fn svg(title: &str, rates: &Rates) -> Result<String, PlotError> {
    let points = |values: &[f64]| rates.seconds.iter().copied().zip(values.iter().copied()).collect();
    let degrees = |yaw: &[f64]| -> Vec<(f64, f64)> {
        points(&yaw.iter().map(|rad| rad.to_degrees()).collect::<Vec<f64>>())
    };
    let truth = rates.reference.as_deref().map(integral);
    let (mut legend, mut angles, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    // The corrected methods set the scale; a method that keeps its bias may leave it.
    let mut scale = Vec::new();
    for (method, color, width) in STYLES {
        let (yaw, stroke) = (integral(&rates.rates[method]), Stroke::solid(color, width));
        let mut label = method.name.to_owned();
        if let Some(truth) = &truth {
            let off: Vec<f64> = yaw.iter().zip(truth).map(|(yaw, truth)| 1e3 * (yaw - truth)).collect();
            label += &format!(": ends {:+.1} mrad off", off.last().copied().unwrap_or(0.0));
            errors.push(Marks::Line(stroke, points(&off)));
            if method != Method::RAW {
                scale.extend(off);
            }
        }
        legend.push((label, stroke));
        angles.push((stroke, degrees(&yaw)));
    }
    if let Some(truth) = &truth {
        legend.insert(0, ("reference".to_owned(), Stroke::TRUTH));
        angles.push((Stroke::TRUTH, degrees(truth)));
    }
    let ends = range(rates.seconds.iter().copied(), 0.0);
    let time = || Axis { ticks: 12, ..Axis::new("time, s", ends) };
    let height = range(angles.iter().flat_map(|(_, points)| points.iter().map(|point| point.1)), AIR);
    let angles = angles.into_iter().map(|(stroke, points)| Marks::Line(stroke, points)).collect();
    let mut panels = vec![Panel { x: time(), y: Axis::new("yaw, deg", height), series: angles }];
    if truth.is_some() {
        let scale = range(scale.into_iter(), AIR);
        panels.push(Panel { x: time(), y: Axis::new("yaw error, mrad", scale), series: errors });
    }
    Figure { title, size: SIZE, side_by_side: false, legend, panels }.svg()
}

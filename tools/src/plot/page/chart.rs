//! Writes charts that fill the width of the page. The curves stretch; the text does not.
//!
//! The curves are an SVG without a fixed aspect ratio; axes and names are HTML text beside the SVG. So the chart is
//! readable on a desktop and on a phone, and the script can zoom by changing the SVG's view box.

use super::escaped;
use crate::plot::curve::{range, thinned};
use std::fmt::Write;

/// Width and height of the SVG; coordinates are integers.
const SIDE: f64 = 10_000.0;
/// Approximate number of points of a curve: more than pixels, for zooming.
const POINTS: usize = 2_000;
/// Limits of the width over the height of a chart with the same scale on both axes.
const ASPECTS: (f64, f64) = (1.5, 2.6);

#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The class in the style sheet, which gives the colour.
    pub class: &'static str,
    pub label: String,
    /// The text after the name in the legend.
    pub note: String,
    /// The points in the units of the axes.
    pub points: Vec<(f64, f64)>,
    /// True if the axes must cover the whole curve; otherwise the curve may leave the chart.
    pub in_scale: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Chart<'a> {
    pub title: &'a str,
    /// The text after the title: the quantities and units of the axes.
    pub axes: &'a str,
    /// The range of the horizontal axis, a time; `None` for a map, whose axes have the same scale.
    pub time: Option<(f64, f64)>,
    /// The curves from back to front.
    pub curves: Vec<Curve>,
}

impl Chart<'_> {
    pub fn html(&self) -> String {
        let kind = if self.time.is_some() { "time" } else { "map" };
        let scaling = || self.curves.iter().filter(|curve| curve.in_scale);
        let across = || range(scaling().flat_map(|curve| curve.points.iter().map(|point| point.0)), 0.0);
        let mut x = self.time.unwrap_or_else(across);
        let mut y = range(scaling().flat_map(|curve| curve.points.iter().map(|point| point.1)), 0.06);
        let mut aspect = 1.0;
        if self.time.is_none() {
            (x, y, aspect) = same_scale(x, y);
        }
        let mut html = format!(
            "<figure class=\"chart {kind}\" data-range=\"{} {} {} {}\" style=\"--aspect:{aspect:.4}\">\n<figcaption><b>{}</b> <span>{}</span></figcaption>\n\
             <div class=\"legend\">",
            x.0,
            x.1,
            y.0,
            y.1,
            escaped(self.title),
            escaped(self.axes)
        );
        for Curve { class, label, note, .. } in &self.curves {
            let (label, note) = (escaped(label), escaped(note));
            // Writing to a string does not fail.
            let _ = write!(
                html,
                "<button type=\"button\" class=\"key {class}\" data-curve=\"{class}\" aria-pressed=\"true\">{label} \
                 <i>{note}</i></button>"
            );
        }
        html += "</div>\n<div class=\"plot\"><div class=\"x\">";
        for tick in ticks(x, 9) {
            let _ =
                write!(html, "<i style=\"left:{:.3}%\"><b>{}</b></i>", 100.0 * part(tick.at, x), tick.label);
        }
        html += "</div><div class=\"y\">";
        for tick in ticks(y, 6) {
            let _ = write!(
                html,
                "<i style=\"bottom:{:.3}%\"><b>{}</b></i>",
                100.0 * part(tick.at, y),
                tick.label
            );
        }
        let _ = write!(
            html,
            "</div>\n<svg viewBox=\"0 0 {SIDE} {SIDE}\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"{}\">\n",
            escaped(self.title)
        );
        for curve in &self.curves {
            let free = if curve.in_scale { "" } else { " free" };
            let _ = write!(html, "<polyline class=\"{}{free}\" points=\"", curve.class);
            for (k, point) in thinned(curve.points.iter().copied(), POINTS).enumerate() {
                let gap = if k == 0 { "" } else { " " };
                let across = SIDE * part(point.0, x);
                // A point far beyond the edge may be clamped.
                let down = (SIDE * (1.0 - part(point.1, y))).clamp(-9.0 * SIDE, 10.0 * SIDE);
                let _ = write!(html, "{gap}{across:.0},{down:.0}");
            }
            html += "\"/>\n";
        }
        html + "</svg></div>\n</figure>\n"
    }
}

/// Returns the position of a value on its axis, 0 to 1.
pub fn part(value: f64, (from, to): (f64, f64)) -> f64 {
    (value - from) / (to - from)
}

/// Widens both ranges to the same scale, and returns them with the ratio of width to height.
pub fn same_scale(x: (f64, f64), y: (f64, f64)) -> ((f64, f64), (f64, f64), f64) {
    let aspect = ((x.1 - x.0) / (y.1 - y.0)).clamp(ASPECTS.0, ASPECTS.1);
    let metres = 1.1 * (y.1 - y.0).max((x.1 - x.0) / aspect);
    let around = |(low, high): (f64, f64), half: f64| ((low + high) / 2.0 - half, (low + high) / 2.0 + half);
    (around(x, metres * aspect / 2.0), around(y, metres / 2.0), aspect)
}

pub struct Tick {
    pub at: f64,
    pub label: String,
}

/// Returns about `most` round numbers. The script has the same rule.
pub fn ticks((from, to): (f64, f64), most: u32) -> Vec<Tick> {
    let rough = (to - from) / f64::from(most);
    let power = 10f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|step| *step >= rough).unwrap_or(rough);
    let decimals = (-(step * 1.001).log10().floor()).max(0.0) as usize;
    let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
    let at = (first..=last).map(|k| k as f64 * step);
    at.map(|at| Tick { at, label: format!("{:.decimals$}", at + 0.0) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        let labels = |range, most| ticks(range, most).into_iter().map(|tick| tick.label).collect::<Vec<_>>();
        assert_eq!(labels((0.0, 10.0), 5), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels((-0.3, 0.31), 6), ["-0.2", "0.0", "0.2"]);
        assert_eq!(labels((3.0, 90.0), 9), ["10", "20", "30", "40", "50", "60", "70", "80", "90"]);
    }

    #[test]
    fn the_scale_is_that_of_the_curves_that_must_show() {
        let curve = |class, top: f64, in_scale| Curve {
            class,
            label: class.into(),
            note: String::new(),
            points: (0..=10).map(|k| (f64::from(k), top * f64::from(k))).collect(),
            in_scale,
        };
        let curves = vec![curve("raw", 1e6, false), curve("static", 1.0, true)];
        let html = Chart { title: "yaw", axes: "s, deg", time: Some((0.0, 10.0)), curves }.html();
        assert!(html.contains("<polyline class=\"raw free\""), "{html}");
        assert!(html.contains("10000,536\"/>"), "the end of the curve, below the air: {html}");
        assert!(!html.contains("1000000"), "kept near the edge: {html}");
    }

    #[test]
    fn a_metre_is_a_metre() {
        for (width, expected) in [(10.0, 1.5), (20.0, 2.0), (160.0, 2.6)] {
            let ((x0, x1), (y0, y1), aspect) = same_scale((0.0, width), (0.0, 10.0));
            assert!((aspect - expected).abs() < 1e-12 && ((x1 - x0) / (y1 - y0) - aspect).abs() < 1e-12);
            assert!(x0 < 0.0 && x1 > width && y0 < 0.0 && y1 > 10.0);
        }
    }
}

//! Curves as SVG: yaw over time, paths seen from above, times between stamps.

use crate::paper::sequence::Sequence;
use crate::plot::curve::{range, thinned};
use crate::plot::drive::PlotError;
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

const SIZE: (u32, u32) = (1000, 640);
const TITLE_HEIGHT: u32 = 46;
const LEGEND_ROW: u32 = 26;
/// Points of a curve, about one for each pixel.
const POINTS: usize = 1_000;
/// Around the curves.
const AIR: f64 = 0.05;
const FONT: &str = "sans-serif";
const GREY: RGBColor = RGBColor(90, 90, 90);
/// Colours that the colour-blind can tell apart (Okabe and Ito, 2008); black is the truth.
const COLORS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(150, 150, 150),
    RGBColor(120, 80, 30),
];

/// Dashes of the curves when the colours are used up: all of them once more with each.
const DASHES: [(u32, u32); 2] = [(12, 6), (3, 5)];

type Failure = DrawingAreaErrorKind<std::io::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A line of a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What it is.
    pub label: String,
    /// In the units of the axes.
    pub points: Vec<(f64, f64)>,
    /// Drawn in black.
    pub is_truth: bool,
}

/// How a curve is drawn.
struct Line {
    style: ShapeStyle,
    /// Dash and gap, pixels.
    dash: Option<(u32, u32)>,
}

impl Line {
    /// One for each, no two alike: solid ones, then all colours once more in dashes.
    fn distinct(curves: &[Curve]) -> Vec<Self> {
        let dashes = [None].into_iter().chain(DASHES.map(Some));
        let mut free = dashes.flat_map(|dash| COLORS.map(|color| (color, dash))).cycle();
        let mut line = |curve: &Curve| {
            if curve.is_truth {
                return Self { style: BLACK.stroke_width(3), dash: None };
            }
            let (color, dash) = free.next().unwrap_or((GREY, None));
            Self { style: color.stroke_width(2), dash }
        };
        curves.iter().map(&mut line).collect()
    }
}

/// What a figure shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Labels<'a> {
    /// Above it.
    pub title: &'a str,
    /// Below it.
    pub x: &'a str,
    /// To its left.
    pub y: &'a str,
    /// A metre is as long either way.
    pub same_scale: bool,
}

/// Curves over a common axis.
///
/// # Errors
/// [`PlotError`], when the library refuses.
pub fn curves(labels: Labels<'_>, curves: &[Curve]) -> Result<String, PlotError> {
    let mut svg = String::new();
    draw(&mut svg, labels, curves)?;
    Ok(svg)
}

/// Times between stamps of each file of a sequence, over the time: the least and the most of each
/// second. The paper's Fig. 11.
///
/// # Errors
/// [`PlotError`], when the library refuses.
pub fn stamps(sequence: &Sequence) -> Result<String, PlotError> {
    let mut svg = String::new();
    let simulated = if sequence.simulated.is_some() { " (simulated)" } else { "" };
    let title = format!("{}{simulated}: time between stamps, least and most of each second", sequence.name);
    draw_stamps(&mut svg, &title, sequence)?;
    Ok(svg)
}

fn draw(svg: &mut String, labels: Labels<'_>, curves: &[Curve]) -> Result<(), Failure> {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, body) = root.split_vertically(TITLE_HEIGHT);
    head.draw(&Text::new(labels.title.to_owned(), (20, 14), (FONT, 22).into_font()))?;
    let rows = curves.len().div_ceil(3) as u32;
    let (legend, body) = body.split_vertically(rows * LEGEND_ROW + 6);
    let lines: Vec<Line> = Line::distinct(curves);
    for (k, (curve, line)) in curves.iter().zip(&lines).enumerate() {
        let (x, y) = (30 + 320 * (k as i32 % 3), 4 + LEGEND_ROW as i32 * (k as i32 / 3));
        let key = [(x, y + 8), (x + 30, y + 8)];
        match line.dash {
            None => legend.draw(&PathElement::new(key, line.style))?,
            Some((dash, gap)) => legend.draw(&DashedPathElement::new(key, dash, gap, line.style))?,
        }
        legend.draw(&Text::new(curve.label.clone(), (x + 38, y), (FONT, 16).into_font()))?;
    }
    let mut x = range(curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.0)), AIR);
    let mut y = range(curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.1)), AIR);
    if labels.same_scale {
        (x, y) = square(x, y, body.dim_in_pixel());
    }
    let mut chart = ChartBuilder::on(&body)
        .margin_left(10)
        .margin_right(22)
        .margin_bottom(8)
        .x_label_area_size(44)
        .y_label_area_size(66)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    chart
        .configure_mesh()
        .x_desc(labels.x)
        .y_desc(labels.y)
        .max_light_lines(1)
        .light_line_style(RGBColor(244, 244, 244))
        .bold_line_style(RGBColor(222, 222, 222))
        .axis_style(GREY)
        .label_style((FONT, 14))
        .axis_desc_style((FONT, 16))
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .draw()?;
    for (curve, Line { style, dash }) in curves.iter().zip(lines) {
        let points = thinned(curve.points.iter().copied(), POINTS);
        match dash {
            None => chart.draw_series(LineSeries::new(points, style))?,
            Some((dash, gap)) => chart.draw_series(DashedLineSeries::new(points, dash, gap, style))?,
        };
    }
    root.present()
}

fn draw_stamps(svg: &mut String, title: &str, sequence: &Sequence) -> Result<(), Failure> {
    let root = SVGBackend::with_string(svg, (SIZE.0, 900)).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, body) = root.split_vertically(TITLE_HEIGHT);
    head.draw(&Text::new(title.to_owned(), (20, 14), (FONT, 20).into_font()))?;
    for (area, file) in body.split_evenly((4, 1)).iter().zip(&sequence.files) {
        let most = file.spreads.iter().map(|spread| spread.most_ms).fold(0.0, f64::max);
        panel(area, &file.file, 1.1 * most.max(1e-3), file.spreads.iter().map(|s| (s.least_ms, s.most_ms)))?;
    }
    root.present()
}

fn panel(
    area: &Area<'_>,
    name: &str,
    top: f64,
    spreads: impl ExactSizeIterator<Item = (f64, f64)>,
) -> Result<(), Failure> {
    let mut chart = ChartBuilder::on(area)
        .margin_left(10)
        .margin_right(22)
        .margin_top(4)
        .x_label_area_size(36)
        .y_label_area_size(66)
        .build_cartesian_2d(0.0..spreads.len().max(1) as f64, 0.0..top)?;
    chart
        .configure_mesh()
        .x_desc("time, s")
        .y_desc(format!("{name}, ms"))
        .max_light_lines(1)
        .bold_line_style(RGBColor(228, 228, 228))
        .axis_style(GREY)
        .label_style((FONT, 13))
        .axis_desc_style((FONT, 14))
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .draw()?;
    let bars = spreads.enumerate().map(|(second, (least, most))| {
        let x = second as f64 + 0.5;
        // A second whose stamps are all the same apart is a dot.
        PathElement::new([(x, least), (x, most.max(least + 0.01 * top))], COLORS[0].stroke_width(1))
    });
    chart.draw_series(bars)?;
    Ok(())
}

/// As few decimals as it needs, and at most two.
fn number(value: &f64) -> String {
    let text = format!("{:.2}", value + 0.0);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The wider of two ranges, so that both have the same length for a pixel.
fn square(x: (f64, f64), y: (f64, f64), (width, height): (u32, u32)) -> ((f64, f64), (f64, f64)) {
    let per_pixel = ((x.1 - x.0) / f64::from(width)).max((y.1 - y.0) / f64::from(height));
    let around = |(low, high): (f64, f64), pixels: u32| {
        let (middle, half) = ((low + high) / 2.0, per_pixel * f64::from(pixels) / 2.0);
        (middle - half, middle + half)
    };
    (around(x, width), around(y, height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_drawn_with_their_labels() {
        let curve = |label: &str, is_truth| Curve {
            label: label.into(),
            points: (0..5_000).map(|k| (f64::from(k), f64::from(k * k))).collect(),
            is_truth,
        };
        let labels = Labels { title: "a drive", x: "east, m", y: "north, m", same_scale: true };
        let svg = curves(labels, &[curve("truth", true), curve("gyro", false)]).unwrap();
        for word in ["<svg", "a drive", "truth", "gyro", "east, m"] {
            assert!(svg.contains(word), "{word}");
        }
        assert!(svg.len() < 100_000, "thinned: {}", svg.len());
    }

    #[test]
    fn no_two_curves_look_alike() {
        let curve = |k: u32| Curve {
            label: format!("method {k}"),
            points: vec![(0.0, f64::from(k)), (100.0, f64::from(k))],
            is_truth: false,
        };
        let labels = Labels { title: "", x: "", y: "", same_scale: false };
        let svg = curves(labels, &(0..10).map(curve).collect::<Vec<_>>()).unwrap();
        // Of two curves in the same colour one is in one piece, the other in dashes.
        let of_first_color = svg.matches("stroke=\"#0072B2\"").count();
        assert!(of_first_color > 8, "{of_first_color}");
    }

    #[test]
    fn numbers_of_an_axis() {
        assert_eq!([100.0, 0.5, 0.25, -3.0, 0.0].map(|v| number(&v)), ["100", "0.5", "0.25", "-3", "0"]);
    }

    #[test]
    fn a_metre_is_a_metre() {
        let ((x0, x1), (y0, y1)) = square((0.0, 100.0), (0.0, 10.0), (1000, 500));
        assert_eq!((x0, x1, y0, y1), (0.0, 100.0, -20.0, 30.0));
    }
}

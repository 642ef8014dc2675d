//! One picture of a drive: the yaw of each method, and below it what each is off by.

use crate::drive::DT;
use crate::evaluate::methods::{Method, Rates};
use crate::plot::curve::{range, thinned};
use plotters::coord::Shift;
use plotters::prelude::*;

/// Width and height, pixels.
const SIZE: (u32, u32) = (1200, 930);
const TITLE_HEIGHT: u32 = 56;
const LEGEND_HEIGHT: u32 = 92;
/// Points of a curve, about one for each pixel.
const POINTS: usize = 1_200;
const FONT: &str = "sans-serif";
const GREY: RGBColor = RGBColor(90, 90, 90);

/// Colours that the colour-blind can tell apart (Okabe and Ito, 2008), and line widths: the
/// wider is drawn first, so that one curve under another still shows.
const STYLES: [(Method, RGBColor, u32); 6] = [
    (Method::Raw, RGBColor(230, 159, 0), 2),
    (Method::Static, RGBColor(0, 114, 178), 2),
    (Method::Fir, RGBColor(204, 121, 167), 2),
    (Method::Prompt, RGBColor(150, 150, 150), 1),
    (Method::GyronetInt, RGBColor(86, 200, 160), 4),
    (Method::Default, RGBColor(190, 60, 0), 2),
];

/// What the plotting library says.
type Failure = DrawingAreaErrorKind<std::io::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The picture could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the picture: {0}")]
pub struct PlotError(#[from] Failure);

/// One line of a panel.
struct Curve {
    points: Vec<(f64, f64)>,
    color: RGBColor,
    width: u32,
}

/// Draws a drive as SVG.
///
/// # Errors
/// [`PlotError`], when the library refuses.
pub fn svg(title: &str, rates: &Rates) -> Result<String, PlotError> {
    let mut svg = String::new();
    draw(&mut svg, title, rates)?;
    Ok(svg)
}

fn draw(svg: &mut String, title: &str, rates: &Rates) -> Result<(), Failure> {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, body) = root.split_vertically(TITLE_HEIGHT);
    head.draw(&Text::new(title.to_owned(), (24, 18), (FONT, 26).into_font()))?;
    let (legend, body) = body.split_vertically(LEGEND_HEIGHT);

    let yaw = STYLES.map(|(method, ..)| integral(&rates.rates[method]));
    let truth = rates.reference.as_deref().map(integral);
    let curve = |values: &[f64], color, width| {
        let points = rates.seconds.iter().copied().zip(values.iter().copied());
        Curve { points: thinned(points, POINTS).collect(), color, width }
    };
    let curves = |values: &[Vec<f64>]| -> Vec<Curve> {
        let styled = values.iter().zip(STYLES);
        styled.map(|(values, (_, color, width))| curve(values, color, width)).collect()
    };
    let degrees = |values: &Vec<f64>| values.iter().map(|rad| rad.to_degrees()).collect::<Vec<f64>>();
    let mut angles = curves(&yaw.each_ref().map(degrees));
    let Some(truth) = truth else {
        draw_legend(&legend, &STYLES.map(|(method, ..)| method.name().to_owned()), false)?;
        let range = span(angles.iter());
        panel(&body, "yaw, deg", range, &angles, true)?;
        return root.present();
    };
    angles.push(curve(&degrees(&truth), BLACK, 2));

    let errors =
        yaw.map(|yaw| yaw.iter().zip(&truth).map(|(yaw, truth)| (yaw - truth) * 1e3).collect::<Vec<f64>>());
    let end = |error: &[f64]| error.last().copied().unwrap_or(0.0);
    let label = |k: usize| format!("{}: ends {:+.1} mrad off", STYLES[k].0.name(), end(&errors[k]));
    draw_legend(&legend, &std::array::from_fn(label), true)?;
    let (upper, lower) = body.split_vertically((SIZE.1 - TITLE_HEIGHT - LEGEND_HEIGHT) * 48 / 100);
    let range = span(angles.iter());
    panel(&upper, "yaw, deg", range, &angles, false)?;

    // The corrected methods set the scale; what still has its bias may run off it.
    let error_curves = curves(&errors);
    let corrected = error_curves.iter().zip(STYLES);
    let corrected = corrected.filter(|(_, (method, ..))| !matches!(method, Method::Raw | Method::Fir));
    let (bottom, top) = span(corrected.map(|(curve, _)| curve));
    let clipped: Vec<Curve> = error_curves
        .iter()
        .flat_map(|curve| {
            let &Curve { ref points, color, width } = curve;
            inside(points, bottom, top).into_iter().map(move |points| Curve { points, color, width })
        })
        .collect();
    panel(&lower, "yaw error, mrad", (bottom, top), &clipped, true)?;
    root.present()
}

fn panel(
    area: &Area<'_>,
    label: &str,
    (bottom, top): (f64, f64),
    curves: &[Curve],
    time_label: bool,
) -> Result<(), Failure> {
    let times = || curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.0));
    let (from, to) = (times().fold(f64::MAX, f64::min), times().fold(f64::MIN, f64::max));
    let mut chart = ChartBuilder::on(area)
        .margin_left(14)
        .margin_right(24)
        .margin_bottom(8)
        .x_label_area_size(if time_label { 48 } else { 28 })
        .y_label_area_size(74)
        .build_cartesian_2d(from..to, bottom..top)?;
    let height = |y: &f64| number(*y, top - bottom);
    let mut mesh = chart.configure_mesh();
    mesh.y_desc(label)
        .x_labels(12)
        .y_labels(8)
        .max_light_lines(1)
        .light_line_style(RGBColor(244, 244, 244))
        .bold_line_style(RGBColor(222, 222, 222))
        .axis_style(GREY)
        .label_style((FONT, 15))
        .axis_desc_style((FONT, 17))
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&height);
    if time_label {
        mesh.x_desc("time, s");
    }
    mesh.draw()?;
    for curve in curves {
        let style = curve.color.stroke_width(curve.width);
        chart.draw_series(LineSeries::new(curve.points.iter().copied(), style))?;
    }
    Ok(())
}

/// Rows of three, above the curves.
fn draw_legend(area: &Area<'_>, labels: &[String; STYLES.len()], truth: bool) -> Result<(), Failure> {
    let reference = (String::from("reference"), (BLACK, 2));
    let methods = labels.iter().cloned().zip(STYLES.map(|(_, color, width)| (color, width)));
    for (k, (label, (color, width))) in truth.then_some(reference).into_iter().chain(methods).enumerate() {
        let (x, y) = (88 + 370 * (k as i32 % 3), 8 + 28 * (k as i32 / 3));
        let line = [(x, y + 8), (x + 34, y + 8)];
        area.draw(&PathElement::new(line, color.stroke_width(width + 1)))?;
        area.draw(&Text::new(label, (x + 44, y), (FONT, 17).into_font()))?;
    }
    Ok(())
}

/// Angle after each sample, rad.
fn integral(rates: &[f64]) -> Vec<f64> {
    let mut angle = 0.0;
    rates
        .iter()
        .map(|rate| {
            angle += rate * DT;
            angle
        })
        .collect()
}

/// How high and low curves reach.
fn span<'a>(curves: impl Iterator<Item = &'a Curve>) -> (f64, f64) {
    range(curves.flat_map(|curve| curve.points.iter().map(|point| point.1)), 0.06)
}

/// The pieces of a curve between two heights, cut exactly at them.
fn inside(points: &[(f64, f64)], bottom: f64, top: f64) -> Vec<Vec<(f64, f64)>> {
    let is_inside = |y: f64| (bottom..=top).contains(&y);
    let mut pieces = vec![Vec::new()];
    for pair in points.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        let edge = if y0.max(y1) > top { top } else { bottom };
        let cut = (x0 + (x1 - x0) * (edge - y0) / (y1 - y0), edge);
        let piece: &mut Vec<_> = match pieces.last_mut() {
            Some(piece) => piece,
            None => break,
        };
        match (is_inside(y0), is_inside(y1)) {
            (true, true) => piece.extend([(x0, y0), (x1, y1)]),
            (true, false) => {
                piece.extend([(x0, y0), cut]);
                pieces.push(Vec::new());
            }
            (false, true) => piece.extend([cut, (x1, y1)]),
            (false, false) => {}
        }
    }
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

/// As many decimals as an axis of that span needs.
fn number(value: f64, span: f64) -> String {
    let decimals = if span < 1.0 {
        2
    } else if span < 8.0 {
        1
    } else {
        0
    };
    format!("{:.decimals$}", value + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_is_cut_at_the_edge_of_its_panel() {
        let points = [(0.0, 0.0), (1.0, 2.0), (2.0, 4.0), (3.0, 0.0)];
        let pieces = inside(&points, -1.0, 3.0);
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0].last(), Some(&(1.5, 3.0)));
        assert_eq!(pieces[1], [(2.25, 3.0), (3.0, 0.0)]);
    }
}

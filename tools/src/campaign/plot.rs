//! Two panels: how soon a receiver is told of each kind of fault, and how far yaw has moved by then.

use super::Run;
use super::fault::Kind;
use crate::plot::drive::PlotError;
use plotters::coord::Shift;
use plotters::prelude::*;

const SIZE: (u32, u32) = (1200, 660);
const TITLE_HEIGHT: u32 = 50;
const FONT: &str = "sans-serif";
const GREY: RGBColor = RGBColor(90, 90, 90);
const DETECTED: RGBColor = RGBColor(0, 114, 178);
const NAMED: RGBColor = RGBColor(230, 159, 0);
const UNDETECTED: RGBColor = RGBColor(213, 0, 0);
/// Dots of a kind in a panel: more do not tell more.
const DOTS: usize = 250;

type Failure = DrawingAreaErrorKind<std::io::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A run in a panel.
#[derive(Clone, Copy)]
struct Dot {
    kind: usize,
    value: f64,
    color: RGBColor,
}

/// Draws the runs of single faults.
///
/// # Errors
/// [`PlotError`], when the library refuses.
pub fn svg(runs: &[Run]) -> Result<String, PlotError> {
    let mut svg = String::new();
    draw(&mut svg, runs)?;
    Ok(svg)
}

fn draw(svg: &mut String, runs: &[Run]) -> Result<(), Failure> {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, body) = root.split_vertically(TITLE_HEIGHT);
    let single = || runs.iter().filter(|run| run.faults.len() == 1);
    let title = format!(
        "{} runs with one fault: told (blue), on the named list (orange), undetected (red)",
        single().count()
    );
    head.draw(&Text::new(title, (20, 16), (FONT, 20).into_font()))?;
    let (left, right) = body.split_horizontally(SIZE.0 / 2);
    let dots = |value: fn(&Run) -> Option<f64>| -> Vec<Dot> {
        let dots = Kind::ALL.iter().enumerate().flat_map(|(kind, wanted)| {
            let own = single().filter(|run| run.faults[0].kind == *wanted);
            let all: Vec<(f64, RGBColor)> = own.filter_map(|run| Some((value(run)?, color(run)))).collect();
            let step = all.len().div_ceil(DOTS).max(1);
            // The largest must be there, whatever is left out.
            let most = all.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0));
            let drawn: Vec<_> = all.into_iter().step_by(step).chain(most).collect();
            drawn.into_iter().map(move |(value, color)| Dot { kind, value, color })
        });
        dots.collect()
    };
    let told = dots(|run| run.outcome()?.told_after.map(|s| (1e3 * s).max(1.0)));
    let moved = dots(|run| run.outcome().map(|outcome| outcome.moved_limits.max(1e-3)));
    panel(&left, "told after, ms", (0.8, 1.2e4), &told, None)?;
    panel(&right, "moved in a second before that, over the limit", (8e-4, 1e4), &moved, Some(1.0))?;
    root.present()
}

fn color(run: &Run) -> RGBColor {
    if run.is_failure() {
        UNDETECTED
    } else if run.exception().is_some() {
        NAMED
    } else {
        DETECTED
    }
}

fn panel(
    area: &Area<'_>,
    label: &str,
    (low, high): (f64, f64),
    dots: &[Dot],
    limit: Option<f64>,
) -> Result<(), Failure> {
    let kinds = Kind::ALL.len() as f64;
    let mut chart = ChartBuilder::on(area)
        .margin_left(10)
        .margin_right(20)
        .margin_bottom(8)
        .x_label_area_size(44)
        .y_label_area_size(118)
        .build_cartesian_2d((low..high).log_scale(), (kinds - 0.5)..-0.5)?;
    chart
        .configure_mesh()
        .x_desc(label)
        .y_labels(Kind::ALL.len())
        .max_light_lines(0)
        .bold_line_style(RGBColor(228, 228, 228))
        .axis_style(GREY)
        .label_style((FONT, 14))
        .axis_desc_style((FONT, 16))
        .y_label_formatter(&|at| {
            let kind = Kind::ALL.get(at.round().max(0.0) as usize);
            kind.filter(|_| (at - at.round()).abs() < 0.01).map_or("", |kind| kind.name()).to_owned()
        })
        .x_label_formatter(&|value| if *value < 1.0 { format!("{value:.3}") } else { format!("{value:.0}") })
        .draw()?;
    if let Some(limit) = limit {
        let line = [(limit, -0.5), (limit, kinds - 0.5)];
        chart.draw_series(LineSeries::new(line, UNDETECTED.stroke_width(1)))?;
    }
    // Dots of one value lie beside each other.
    chart.draw_series(dots.iter().enumerate().map(|(n, dot)| {
        let beside = 0.6 * ((n as f64 * 0.618_034) % 1.0) - 0.3;
        Circle::new((dot.value.min(high), dot.kind as f64 + beside), 2, dot.color.mix(0.6).filled())
    }))?;
    Ok(())
}

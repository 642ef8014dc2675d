//! Draws figures as SVG: panels of lines, bars or dots under a title and a legend.
//!
//! The caller gives points, ranges and names. Lines are thinned to about one point per pixel, and cut at the edges of
//! their panel, because SVG would draw them beyond it.

use gyronet_tools::plot::curve::thinned;
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::Color as _;

/// The colour of a line, bar or dot.
pub type Color = RGBColor;
type Failure = DrawingAreaErrorKind<std::io::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// The reason why a figure cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the picture: {0}")]
pub struct PlotError(#[from] Failure);

const TITLE_HEIGHT: u32 = 46;
const LEGEND_ROW: u32 = 26;
const LEGEND_COLUMNS: usize = 3;
const FONT: &str = "sans-serif";
const GREY: Color = RGBColor(90, 90, 90);
/// Colours that the colour-blind can distinguish (Okabe and Ito, 2008).
pub const COLORS: [Color; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(150, 150, 150),
    RGBColor(120, 80, 30),
];
/// Dashes and gaps of lines once all colours are used, pixels.
const DASHES: [(u32, u32); 2] = [(12, 6), (3, 5)];

/// The colour, width and dashes of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stroke {
    color: Color,
    width: u32,
    dash: Option<(u32, u32)>,
}

impl Stroke {
    pub const TRUTH: Self = Self::solid(BLACK, 3);

    /// Returns a solid line of a width in pixels.
    pub const fn solid(color: Color, width: u32) -> Self {
        Self { color, width, dash: None }
    }

    /// Returns distinct strokes: all colours solid, then all dashed, then the same again.
    pub fn distinct() -> impl Iterator<Item = Self> {
        let dashes = [None].into_iter().chain(DASHES.map(Some));
        dashes.flat_map(|dash| COLORS.map(|color| Self { color, width: 2, dash })).cycle()
    }
}

/// The marks of one series.
#[derive(Debug, Clone, PartialEq)]
pub enum Marks {
    /// A line through points.
    Line(Stroke, Vec<(f64, f64)>),
    /// Vertical bars: x, low end, high end.
    Bars(Color, Vec<(f64, f64, f64)>),
    /// Dots, each of its own colour.
    Dots(Vec<(f64, f64, Color)>),
}

/// An axis of a panel.
pub struct Axis<'a> {
    /// The quantity and its unit.
    pub label: &'a str,
    /// The values at the ends; a reversed axis has the larger value first.
    pub range: (f64, f64),
    /// The approximate number of labels.
    pub ticks: usize,
    /// Formats the label of a value.
    pub format: &'a dyn Fn(&f64) -> String,
    /// The space for the labels, pixels.
    pub room: u32,
}

impl<'a> Axis<'a> {
    /// Returns an axis of plain numbers.
    pub fn new(label: &'a str, range: (f64, f64)) -> Self {
        Self { label, range, ticks: 10, format: &number, room: 66 }
    }
}

/// A coordinate system with its series.
pub struct Panel<'a> {
    /// The horizontal axis.
    pub x: Axis<'a>,
    /// The vertical axis.
    pub y: Axis<'a>,
    /// The series, from back to front.
    pub series: Vec<Marks>,
}

/// A figure of one or more panels.
pub struct Figure<'a> {
    /// The title above the panels.
    pub title: &'a str,
    /// Width and height of the figure, pixels.
    pub size: (u32, u32),
    /// Whether the panels are side by side; otherwise they are one below the other.
    pub side_by_side: bool,
    /// The name and stroke of each line.
    pub legend: Vec<(String, Stroke)>,
    pub panels: Vec<Panel<'a>>,
}

impl Figure<'_> {
    pub fn svg(&self) -> Result<String, PlotError> {
        let mut svg = String::new();
        self.draw(&mut svg)?;
        Ok(svg)
    }

    /// Widens the ranges of the only panel so that both axes have the same scale.
    pub fn square(&mut self) {
        let (width, height) = (self.size.0, self.size.1 - TITLE_HEIGHT - legend_height(self.legend.len()));
        for Panel { x, y, .. } in &mut self.panels {
            (x.range, y.range) = square(x.range, y.range, (width, height));
        }
    }

    fn draw(&self, svg: &mut String) -> Result<(), Failure> {
        let root = SVGBackend::with_string(svg, self.size).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, body) = root.split_vertically(TITLE_HEIGHT);
        head.draw(&Text::new(self.title.to_owned(), (20, 14), (FONT, 22).into_font()))?;
        let (legend, body) = body.split_vertically(legend_height(self.legend.len()));
        self.draw_legend(&legend)?;
        let count = self.panels.len();
        let areas = body.split_evenly(if self.side_by_side { (1, count) } else { (count, 1) });
        for (area, panel) in areas.iter().zip(&self.panels) {
            panel.draw(area)?;
        }
        root.present()
    }

    fn draw_legend(&self, area: &Area<'_>) -> Result<(), Failure> {
        let column = (self.size.0 as i32 - 40) / LEGEND_COLUMNS as i32;
        for (k, (label, stroke)) in self.legend.iter().enumerate() {
            let (row, place) = ((k / LEGEND_COLUMNS) as i32, (k % LEGEND_COLUMNS) as i32);
            let (x, y) = (30 + column * place, 4 + LEGEND_ROW as i32 * row);
            let (key, style) = ([(x, y + 8), (x + 30, y + 8)], stroke.color.stroke_width(stroke.width));
            match stroke.dash {
                None => area.draw(&PathElement::new(key, style))?,
                Some((dash, gap)) => area.draw(&DashedPathElement::new(key, dash, gap, style))?,
            }
            area.draw(&Text::new(label.clone(), (x + 38, y), (FONT, 16).into_font()))?;
        }
        Ok(())
    }
}

fn legend_height(labels: usize) -> u32 {
    if labels == 0 { 0 } else { labels.div_ceil(LEGEND_COLUMNS) as u32 * LEGEND_ROW + 6 }
}

impl Panel<'_> {
    fn draw(&self, area: &Area<'_>) -> Result<(), Failure> {
        let ((left, right), (bottom, top)) = (self.x.range, self.y.range);
        let mut chart = ChartBuilder::on(area)
            .margin_left(10)
            .margin_right(22)
            .margin_top(4)
            .margin_bottom(8)
            .x_label_area_size(44)
            .y_label_area_size(self.y.room)
            .build_cartesian_2d(left..right, bottom..top)?;
        chart
            .configure_mesh()
            .x_desc(self.x.label)
            .y_desc(self.y.label)
            .x_labels(self.x.ticks)
            .y_labels(self.y.ticks)
            .max_light_lines(1)
            .light_line_style(RGBColor(244, 244, 244))
            .bold_line_style(RGBColor(224, 224, 224))
            .axis_style(GREY)
            .label_style((FONT, 14))
            .axis_desc_style((FONT, 16))
            .x_label_formatter(&self.x.format)
            .y_label_formatter(&self.y.format)
            .draw()?;
        let pixels = area.dim_in_pixel().0 as usize;
        for marks in &self.series {
            match marks {
                Marks::Line(Stroke { color, width, dash }, points) => {
                    let style = color.stroke_width(*width);
                    let points: Vec<(f64, f64)> = thinned(points.iter().copied(), pixels).collect();
                    for piece in inside(&points, bottom, top) {
                        match *dash {
                            None => chart.draw_series(LineSeries::new(piece, style))?,
                            Some((dash, gap)) => {
                                chart.draw_series(DashedLineSeries::new(piece, dash, gap, style))?
                            }
                        };
                    }
                }
                Marks::Bars(color, bars) => {
                    let bar = |&(x, low, high): &(f64, f64, f64)| {
                        PathElement::new([(x, low), (x, high)], color.stroke_width(1))
                    };
                    chart.draw_series(bars.iter().map(bar))?;
                }
                Marks::Dots(dots) => {
                    let dot =
                        |&(x, y, color): &(f64, f64, Color)| Circle::new((x, y), 2, color.mix(0.6).filled());
                    chart.draw_series(dots.iter().map(dot))?;
                }
            }
        }
        Ok(())
    }
}

/// Widens one of two ranges, so that a pixel has the same length on both axes.
fn square(x: (f64, f64), y: (f64, f64), (width, height): (u32, u32)) -> ((f64, f64), (f64, f64)) {
    let per_pixel = ((x.1 - x.0) / f64::from(width)).max((y.1 - y.0) / f64::from(height));
    let around = |(low, high): (f64, f64), pixels: u32| {
        let (middle, half) = ((low + high) / 2.0, per_pixel * f64::from(pixels) / 2.0);
        (middle - half, middle + half)
    };
    (around(x, width), around(y, height))
}

/// Returns the pieces of a line between two values of y, cut exactly there.
fn inside(points: &[(f64, f64)], bottom: f64, top: f64) -> Vec<Vec<(f64, f64)>> {
    let (bottom, top) = (bottom.min(top), bottom.max(top));
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
        if piece.is_empty() && is_inside(y0) {
            piece.push((x0, y0));
        }
        match (is_inside(y0), is_inside(y1)) {
            (true, true) => piece.push((x1, y1)),
            (true, false) => {
                piece.push(cut);
                pieces.push(Vec::new());
            }
            (false, true) => piece.extend([cut, (x1, y1)]),
            (false, false) => {}
        }
    }
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

/// Formats a number with at most two decimals, without trailing zeros.
pub(crate) fn number(value: &f64) -> String {
    let text = format!("{:.2}", value + 0.0);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(series: Vec<Marks>, legend: Vec<(String, Stroke)>) -> String {
        let panel = Panel { x: Axis::new("east, m", (0.0, 5e3)), y: Axis::new("", (0.0, 25e6)), series };
        let figure =
            Figure { title: "a drive", size: (1000, 640), side_by_side: false, legend, panels: vec![panel] };
        figure.svg().unwrap()
    }

    #[test]
    fn lines_are_thinned_and_drawn_under_title_and_legend() {
        let points = (0..5_000).map(|k| (f64::from(k), f64::from(k * k))).collect();
        let svg = figure(vec![Marks::Line(Stroke::TRUTH, points)], vec![("truth".into(), Stroke::TRUTH)]);
        for word in ["<svg", "a drive", "truth", "east, m"] {
            assert!(svg.contains(word), "{word}");
        }
        assert!(svg.len() < 100_000, "thinned: {}", svg.len());
    }

    #[test]
    fn no_two_lines_look_alike() {
        let level = |(k, stroke)| Marks::Line(stroke, vec![(0.0, f64::from(k)), (5e3, f64::from(k))]);
        let svg = figure((0..10).zip(Stroke::distinct()).map(level).collect(), Vec::new());
        // Of two lines in the same colour one is in one piece, the other in dashes.
        let of_first_color = svg.matches("stroke=\"#0072B2\"").count();
        assert!(of_first_color > 8, "{of_first_color}");
    }

    #[test]
    fn a_line_is_cut_at_the_edge_of_its_panel() {
        let points = [(0.0, 0.0), (1.0, 2.0), (2.0, 4.0), (3.0, 0.0)];
        let pieces = inside(&points, -1.0, 3.0);
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0].last(), Some(&(1.5, 3.0)));
        assert_eq!(pieces[1], [(2.25, 3.0), (3.0, 0.0)]);
    }

    #[test]
    fn a_metre_is_a_metre() {
        let ((x0, x1), (y0, y1)) = square((0.0, 100.0), (0.0, 10.0), (1000, 500));
        assert_eq!((x0, x1, y0, y1), (0.0, 100.0, -20.0, 30.0));
    }

    #[test]
    fn numbers_of_an_axis_have_few_decimals() {
        assert_eq!([100.0, 0.5, 0.25, -3.0, 0.0].map(|v| number(&v)), ["100", "0.5", "0.25", "-3", "0"]);
    }
}

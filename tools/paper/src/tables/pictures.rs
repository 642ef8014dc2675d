//! Draws the paper's figures 6, 7, 9, 10 and 11 for a sequence.

use super::results::{Path, SequenceErrors};
use crate::sequence::Sequence;
use crate::simulate::Layout;
use crate::svg::{Axis, COLORS, Figure, Marks, Panel, PlotError, Stroke};
use gyronet_tools::drive::DT;
use gyronet_tools::evaluate::methods::{Gyro, Method};
use gyronet_tools::plot::curve::range;

/// Width and height of a picture, pixels.
const SIZE: (u32, u32) = (1000, 640);
/// Margin around the lines, as a share of their extent.
const AIR: f64 = 0.05;

/// A curve: the method's name (`None` for the truth) and the points.
type Curve<'a> = (Option<&'a str>, Vec<(f64, f64)>);

/// Holds the labels of a figure with one panel.
struct Labels<'a> {
    title: &'a str,
    x: &'a str,
    y: &'a str,
    /// Says whether both axes have the same scale.
    same_scale: bool,
}

/// Holds a picture of a sequence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Suffix of the file's name, which tells the content.
    pub kind: &'static str,
    /// Caption, with the corresponding figure of the paper.
    pub caption: String,
    pub svg: String,
}

pub fn draw(sequence: &Sequence, errors: &SequenceErrors, paths: &[Path]) -> Result<Vec<Picture>, PlotError> {
    let simulated = if errors.simulated { " (simulated)" } else { "" };
    let name = format!("{}{simulated}", errors.name);
    // The raw gyro with its bias and the wheels' turn need a scale on which the other curves would not be visible.
    let in_scale =
        |path: &&Path| path.method.is_none_or(|method| ![Method::RAW, Method::WHEELS].contains(&method));
    let of = |gyro: Gyro| {
        let is_wanted = move |path: &&Path| {
            path.method.is_none_or(|method| method.gyro == gyro || method.gyro == Gyro::Given)
        };
        paths.iter().filter(is_wanted).filter(in_scale).collect::<Vec<&Path>>()
    };
    let start = sequence.seconds() - errors.seconds;
    let time = |k: usize| start + k as f64 * DT;
    let truth = paths.first().map_or(&[][..], |path| path.yaw.as_slice());

    let mut pictures = Vec::new();
    let mut add = |kind, figure: &str, labels: Labels<'_>, curves: Vec<Curve<'_>>| {
        let svg = draw_curves(&labels, curves)?;
        pictures.push(Picture { kind, caption: format!("{} ({figure})", labels.title), svg });
        Ok::<(), PlotError>(())
    };
    let title = format!("{name}: yaw");
    let labels = Labels { title: &title, x: "time, s", y: "yaw, deg", same_scale: false };
    let curves = paths
        .iter()
        .map(|path| curve(path, path.yaw.iter().enumerate().map(|(k, yaw)| (time(k), yaw.to_degrees()))));
    add("yaw", "as the paper's Fig. 6", labels, curves.collect())?;

    let title = format!("{name}: yaw error");
    let labels = Labels { title: &title, x: "time, s", y: "yaw error, mrad", same_scale: false };
    let corrected = paths.iter().filter(|path| path.method.is_some()).filter(in_scale);
    let curves = corrected.map(|path| {
        let errors = path.yaw.iter().zip(truth).enumerate();
        curve(path, errors.map(|(k, (yaw, truth))| (time(k), (yaw - truth) * 1e3)))
    });
    add("yaw-error", "not in the paper", labels, curves.collect())?;

    let above = |path: &&Path| curve(path, path.points.iter().map(|[x, y]| (*x, *y)));
    let title = format!("{name}: MEMS gyro with odometry");
    let labels = Labels { title: &title, x: "east, m", y: "north, m", same_scale: true };
    add("mems-path", "as the paper's Fig. 7", labels, of(Gyro::Mems).iter().map(above).collect())?;
    let title = format!("{name}: fibre-optic gyro with odometry");
    let labels = Labels { title: &title, x: "east, m", y: "north, m", same_scale: true };
    let figure = match errors.layout {
        Layout::Kaist => "as the paper's Fig. 9",
        Layout::Nclt => "as the paper's Fig. 10",
    };
    add("fog-path", figure, labels, of(Gyro::Fog).iter().map(above).collect())?;
    let caption = format!("{name}: time between stamps (as the paper's Fig. 11)");
    pictures.push(Picture { kind: "stamps", caption, svg: stamps(sequence)? });
    Ok(pictures)
}

fn curve(path: &Path, points: impl Iterator<Item = (f64, f64)>) -> Curve<'static> {
    (path.method.map(|method| method.name), points.collect())
}

fn draw_curves(labels: &Labels<'_>, curves: Vec<Curve<'_>>) -> Result<String, PlotError> {
    let mut free = Stroke::distinct();
    let of = |axis: fn(&(f64, f64)) -> f64| {
        range(curves.iter().flat_map(|(_, points)| points.iter().map(axis)), AIR)
    };
    let (x, y) = (Axis::new(labels.x, of(|point| point.0)), Axis::new(labels.y, of(|point| point.1)));
    let (mut legend, mut series) = (Vec::new(), Vec::new());
    for (label, points) in curves {
        let stroke = label.and_then(|_| free.next()).unwrap_or(Stroke::TRUTH);
        legend.push((label.unwrap_or("truth").to_owned(), stroke));
        series.push(Marks::Line(stroke, points));
    }
    let panels = vec![Panel { x, y, series }];
    let mut figure = Figure { title: labels.title, size: SIZE, side_by_side: false, legend, panels };
    if labels.same_scale {
        figure.square();
    }
    figure.svg()
}

/// Plots the time between the stamps of each file: the smallest and the largest of each second.
pub fn stamps(sequence: &Sequence) -> Result<String, PlotError> {
    let simulated = if sequence.simulated.is_some() { " (simulated)" } else { "" };
    let title = format!("{}{simulated}: time between stamps, least and most of each second", sequence.name);
    let names = sequence.files.each_ref().map(|file| format!("{}, ms", file.file));
    let panels = sequence.files.iter().zip(&names).map(|(file, name)| {
        let top = 1.1 * file.spreads.iter().map(|spread| spread.most_ms).fold(0.0, f64::max).max(1e-3);
        let bars = file.spreads.iter().enumerate().map(|(second, spread)| {
            // A second with equally spaced stamps is drawn as a dot.
            (second as f64 + 0.5, spread.least_ms, spread.most_ms.max(spread.least_ms + 0.01 * top))
        });
        Panel {
            x: Axis::new("time, s", (0.0, file.spreads.len().max(1) as f64)),
            y: Axis::new(name, (0.0, top)),
            series: vec![Marks::Bars(COLORS[0], bars.collect())],
        }
    });
    let (size, panels) = ((SIZE.0, 900), panels.collect());
    Figure { title: &title, size, side_by_side: false, legend: Vec::new(), panels }.svg()
}

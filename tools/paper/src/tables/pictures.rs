//! Draws the paper's figures 6, 7, 9, 10 and 11 for a sequence.

use super::results::{Path, SequenceErrors};
use crate::sequence::Sequence;
use crate::simulate::Layout;
use gyronet_tools::drive::DT;
use gyronet_tools::evaluate::methods::{Gyro, Method};
use gyronet_tools::plot::page::chart::{Chart, Curve};

/// Colours of the curves, by the page's style sheet; the truth has its own.
const CLASSES: [&str; 8] = ["c1", "c2", "c3", "c4", "c5", "c6", "c7", "c8"];
const TRUTH: &str = "reference";

/// Returns the sequence's charts, each with the figure of the paper that it corresponds to.
pub fn draw(sequence: &Sequence, errors: &SequenceErrors, paths: &[Path]) -> Vec<String> {
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
    let all: Vec<&Path> = paths.iter().collect();
    let corrected: Vec<&Path> = all.iter().copied().filter(|p| p.method.is_some()).filter(in_scale).collect();
    let yaw = |path: &Path| path.yaw.iter().enumerate().map(|(k, yaw)| (time(k), yaw.to_degrees())).collect();
    let off = |path: &Path| {
        let both = path.yaw.iter().zip(truth).enumerate();
        both.map(|(k, (yaw, truth))| (time(k), (yaw - truth) * 1e3)).collect()
    };
    let above = |path: &Path| path.points.iter().map(|[x, y]| (*x, *y)).collect();
    let figure = match errors.layout {
        Layout::Kaist => "as the paper's Fig. 9",
        Layout::Nclt => "as the paper's Fig. 10",
    };
    let draw = |what: &str, axes: &str, same_scale: bool, curves: Vec<Curve>| {
        Chart { title: &format!("{name}: {what}"), axes, same_scale, curves }.html()
    };
    let map = "east, north, m";
    let mems = format!("{map} (as the paper's Fig. 7)");
    let fog = format!("{map} ({figure})");
    let mut charts = vec![
        draw("yaw", "s, deg (as the paper's Fig. 6)", false, curves(&all, yaw)),
        draw("yaw error", "s, mrad (not in the paper)", false, curves(&corrected, off)),
        draw("MEMS gyro with odometry", &mems, true, curves(&of(Gyro::Mems), above)),
        draw("fibre-optic gyro with odometry", &fog, true, curves(&of(Gyro::Fog), above)),
    ];
    charts.extend(sequence.files.iter().map(|file| {
        let seconds =
            || file.spreads.iter().enumerate().map(|(second, spread)| (second as f64 + 0.5, spread));
        let limits = [
            ("least of each second", seconds().map(|(at, spread)| (at, spread.least_ms)).collect()),
            ("most", seconds().map(|(at, spread)| (at, spread.most_ms)).collect()),
        ];
        let curves =
            limits.into_iter().zip(CLASSES).map(|((label, points), class)| curve(class, label, points));
        let what = format!("time between stamps of {}", file.file);
        draw(&what, "s, ms (as the paper's Fig. 11)", false, curves.collect())
    }));
    charts
}

fn curves(paths: &[&Path], points: impl Fn(&Path) -> Vec<(f64, f64)>) -> Vec<Curve> {
    let mut free = CLASSES.into_iter().cycle();
    let curves = paths.iter().map(|path| match path.method {
        Some(method) => curve(free.next().unwrap_or(TRUTH), method.name, points(path)),
        None => curve(TRUTH, "truth", points(path)),
    });
    curves.collect()
}

fn curve(class: &'static str, label: &str, points: Vec<(f64, f64)>) -> Curve {
    Curve { class, label: label.to_owned(), note: String::new(), points, in_scale: true }
}

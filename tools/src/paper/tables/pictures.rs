//! The paper's figures 6, 7, 9, 10 and 11 for a sequence.

use super::methods::{FIR, Gyro, RAW};
use super::results::{Path, SequenceErrors};
use crate::drive::DT;
use crate::paper::sequence::Sequence;
use crate::plot::drive::PlotError;
use crate::plot::figures::{self, Curve, Labels};
use crate::simulate::layout::Layout;

/// A picture of a sequence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// For the name of its file.
    pub kind: &'static str,
    /// What it shows, and which of the paper's figures it is like.
    pub caption: String,
    /// The picture.
    pub svg: String,
}

/// All pictures of a sequence.
///
/// # Errors
/// [`PlotError`], when the library refuses.
pub fn draw(sequence: &Sequence, errors: &SequenceErrors, paths: &[Path]) -> Result<Vec<Picture>, PlotError> {
    let simulated = if errors.simulated { " (simulated)" } else { "" };
    let name = format!("{}{simulated}", errors.name);
    // A gyro with its bias runs off any scale that shows the others.
    let in_scale = |path: &&Path| path.method.is_none_or(|method| method != RAW && method != FIR);
    let of = |gyro: Gyro| {
        let is_wanted = move |path: &&Path| path.method.is_none_or(|method| method.gyro == gyro);
        paths.iter().filter(is_wanted).filter(in_scale).collect::<Vec<&Path>>()
    };
    let start = sequence.seconds() - errors.seconds;
    let time = |k: usize| start + k as f64 * DT;
    let truth = paths.first().map_or(&[][..], |path| path.yaw.as_slice());

    let mut pictures = Vec::new();
    let mut add = |kind, figure: &str, labels: Labels<'_>, curves: Vec<Curve>| {
        let svg = figures::curves(labels, &curves)?;
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
    pictures.push(Picture { kind: "stamps", caption, svg: figures::stamps(sequence)? });
    Ok(pictures)
}

fn curve(path: &Path, points: impl Iterator<Item = (f64, f64)>) -> Curve {
    let label = path.method.map_or("truth", |method| method.label).to_owned();
    Curve { label, points: points.collect(), is_truth: path.method.is_none() }
}

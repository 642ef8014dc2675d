//! Computes the path of the vehicle by each method, from its yaw rate and the speeds of the wheels.

use crate::drive::DT;
use crate::drive::stream::Drive;
use crate::drive::track::Track;
use crate::evaluate::angle::integral;
use crate::evaluate::methods::Method;
use crate::evaluate::rates::Rates;
use crate::evaluate::trajectory_error::{Alignment, Point, TrajectoryError};
use serde::Serialize;

const METHODS: [Method; 3] = [Method::RAW, Method::STATIC, Method::DELAYED];

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Path {
    /// The method, or `None` for the reference.
    #[serde(serialize_with = "key")]
    pub method: Option<Method>,
    /// The points, m, from where static initialisation ended, turned by right angles so that the path lies across a
    /// page.
    #[serde(skip)]
    pub points: Vec<Point>,
    /// Distance to the reference's path, RMS, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_m: Option<f64>,
}

fn key<S: serde::Serializer>(method: &Option<Method>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(method.map_or("reference", |method| method.key))
}

#[derive(Debug, Clone, PartialEq)]
pub struct Trajectories {
    /// The paths, the reference's first if there is one; the GNSS receiver's last.
    pub paths: Vec<Path>,
    /// The number of wheels that the speed is the mean of; 0 by GNSS.
    pub wheels: usize,
    pub metres: f64,
}

impl Trajectories {
    /// Computes the paths; `None` for a drive without speeds.
    pub fn new(drive: &Drive<'_>, rates: &Rates) -> Option<Self> {
        let ways: Vec<f64> = rates.speeds()?.iter().map(|speed| speed * DT).collect();
        let wheels = drive.speeds().map_or(0, |speeds| speeds.wheels());
        let path = |angles: &[f64]| {
            let mut track = Track::default();
            let step = |(way, angle): (&f64, &f64)| {
                track.step([*way; 2], angle - track.yaw);
                track.position
            };
            ways.iter().zip(angles).map(step).collect::<Vec<Point>>()
        };
        // Between two courses the delayed rate's heading goes on.
        let mut off = 0.0;
        let yaw = integral(&rates.rates[Method::DELAYED]);
        let truth = rates.truth().map(|truth| {
            let known = |(yaw, truth): (&f64, Option<f64>)| {
                off = truth.map_or(off, |truth| yaw - truth);
                yaw - off
            };
            path(&yaw.iter().zip(truth).map(known).collect::<Vec<f64>>())
        });
        let mut paths = Vec::new();
        for method in METHODS {
            let points = path(&integral(&rates.rates[method]));
            let error = truth.as_ref().and_then(|truth| TrajectoryError::new(&points, truth));
            paths.push(Path { method: Some(method), error_m: error.map(|error| error.rmse_m), points });
        }
        paths.splice(0..0, truth.map(|points| Path { method: None, points, error_m: None }));
        paths.extend(received(rates, &paths.first()?.points));
        lay_across(&mut paths);
        Some(Self { paths, wheels, metres: ways.iter().map(|way| way.abs()).sum() })
    }
}

/// The positions of the GNSS receiver, laid onto a path.
fn received(rates: &Rates, onto: &[Point]) -> Option<Path> {
    let places: Vec<Point> = rates.places.iter().map(|(_, place)| *place).collect();
    let there: Vec<Point> = rates.places.iter().map(|(sample, _)| onto[*sample]).collect();
    let laid = Alignment::new(&places, &there)?;
    let points = places.into_iter().map(|place| laid.apply(place)).collect();
    Some(Path { method: Some(Method::GNSS), points, error_m: None })
}

/// Turns all paths by the same right angles, so that the farthest point of the first one lies to the right.
fn lay_across(paths: &mut [Path]) {
    let Some(first) = paths.first() else { return };
    let reach =
        |turn: fn(Point) -> Point| first.points.iter().map(|point| turn(*point)[0]).fold(0.0, f64::max);
    let turns: [fn(Point) -> Point; 4] =
        [|[x, y]| [x, y], |[x, y]| [y, -x], |[x, y]| [-x, -y], |[x, y]| [-y, x]];
    let Some(turn) = turns.into_iter().max_by(|a, b| reach(*a).total_cmp(&reach(*b))) else { return };
    for point in paths.iter_mut().flat_map(|path| &mut path.points) {
        *point = turn(*point);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_turned_not_mirrored() {
        let points = vec![[0.0, 0.0], [1.0, -9.0], [3.0, -9.0]];
        let mut paths = [Path { method: None, points, error_m: None }];
        lay_across(&mut paths);
        // Left turns stay left turns.
        assert_eq!(paths[0].points, [[0.0, 0.0], [9.0, 1.0], [9.0, 3.0]]);
    }
}

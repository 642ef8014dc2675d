"""A drive by lwoi: from windows and trained processes to a pose every 10 ms.

There are four ways to run it. `odometry` moves on by wheels and fibre-optic gyro alone, level as it
starts; `constant` adds the mean error of the training's seconds, to show how much of the gain four
numbers have; `model` adds what the process expects of each second, roll and pitch left out; `filter`
starts with the true attitude and has each second corrected by the inertial sensor as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from .lwoi_filter import Filter, Measured, Motion
from .lwoi_motion import corrected, inertial_motion, odometry_motion, odometry_poses
from .lwoi_process import Errors
from .lwoi_sequence import PERIOD_NS, STEPS, Sequence

MODES = ("odometry", "constant", "model", "filter")
LEVEL = slice(3, 5)  # of a twist: roll and pitch
# The least deviations of the inertial sensor's rotation (rad), gain of velocity (m/s) and way (m): the fixed ones of
# lwoi's authors (of their two for the way the smaller). The process states less, but takes errors of successive
# seconds as independent: a gyro's bias is the same in all.
LEAST_STD = np.repeat([2 / 180, 0.1, 0.2], 3)


@dataclass(frozen=True)
class Expected:
    """The expected errors of a drive's odometry and inertial sensor, and the variance of the wheels' speed; `constant`
    and `mean_square` are of the odometry's errors in training (6)."""

    constant: np.ndarray
    mean_square: np.ndarray
    odometry: Errors
    inertial: Errors
    speed_variance: float

    def twists(self, mode: str) -> Errors:
        """The expected errors of the odometry in a mode, roll and pitch left out."""
        like = np.ones_like(self.odometry.mean)
        mean, variance = {
            "odometry": (0.0 * like, self.mean_square * like),
            "constant": (self.constant * like, (self.mean_square - self.constant**2) * like),
        }.get(mode, (self.odometry.mean.copy(), self.odometry.variance))
        mean[:, LEVEL] = 0.0
        return Errors(mean, variance)


@dataclass(frozen=True)
class Track:
    """A pose at each step, the errors' covariances (N + 1, 6, 6) at the edges, and the measurements refused."""

    attitude: Rotation
    position: np.ndarray
    covariance: np.ndarray
    refused: int


def run(sequence: Sequence, expected: Expected, mode: str) -> Track:
    """Runs a drive from its true first pose. Raises FilterError where the filter diverges."""
    attitude, position = sequence.attitude[0], sequence.position[0]
    if mode != "filter":
        attitude = Rotation.from_euler("z", attitude.as_euler("ZYX")[0])
    twists = expected.twists(mode)
    rotation, way = corrected(*odometry_motion(sequence.odometry), twists.mean)
    measured = inertial_motion(sequence.inertial) + expected.inertial.mean
    speeds = sequence.edge_speed
    state = Filter(attitude, position)
    attitudes, positions, covariances = [state.attitude.as_quat()[None]], [state.position[None]], [np.zeros((6, 6))]
    for k in range(len(sequence)):
        within = steps_within(sequence.odometry[k], twists.mean[k])
        attitudes.append((state.attitude * within[0]).as_quat())
        positions.append(state.position + state.attitude.apply(within[1]))
        state.move(Motion(rotation[k], way[k], np.diag(twists.variance[k])))
        if mode == "filter":
            spread = np.diag(np.maximum(expected.inertial.variance[k], LEAST_STD**2))
            state.update(Measured(measured[k], spread, (speeds[k], speeds[k + 1]), expected.speed_variance))
        attitudes[-1][-1], positions[-1][-1] = state.attitude.as_quat(), state.position
        covariances.append(state.covariance[:6, :6].copy())
    track = Rotation.from_quat(np.concatenate(attitudes)), np.concatenate(positions)
    return Track(*track, np.array(covariances), state.refused)


def steps_within(odometry: np.ndarray, twist: np.ndarray) -> tuple[Rotation, np.ndarray]:
    """The poses of a window's steps as seen from its beginning; its twist grows evenly."""
    turn, way = odometry_poses(odometry[None])
    turns = np.zeros((STEPS, 3))
    turns[:, 2] = turn[0, 1:]
    share = np.arange(1, STEPS + 1)[:, None] / STEPS
    return corrected(Rotation.from_rotvec(turns), np.pad(way[0, 1:], ((0, 0), (0, 1))), share * twist)


def write_tum(sequence: Sequence, track: Track, path: Path) -> None:
    """Writes the poses as `time x y z qx qy qz qw`, time in s (the stamps that are read are good to
    a microsecond) and places in the frame of the true poses."""
    with path.open("w") as file:
        for k, (place, turn) in enumerate(zip(track.position, track.attitude.as_quat())):
            whole, rest = divmod(round((sequence.start_ns + k * PERIOD_NS) / 1000), 10**6)
            numbers = " ".join(f"{number:.6f}" for number in place) + " " + " ".join(f"{q:.9f}" for q in turn)
            file.write(f"{whole}.{rest:06d} {numbers}\n")


def trajectory_error(estimate: np.ndarray, truth: np.ndarray, align: bool) -> float:
    """The RMS distance of places in the plane, m, after the best turn and shift if `align`."""
    estimate, truth = estimate[:, :2], truth[:, :2]
    if align:
        estimate, truth = estimate - estimate.mean(axis=0), truth - truth.mean(axis=0)
        cross = (estimate[:, 0] * truth[:, 1] - estimate[:, 1] * truth[:, 0]).sum()
        angle = np.arctan2(cross, (estimate * truth).sum())
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        estimate = estimate @ turn
    return float(np.sqrt(((estimate - truth) ** 2).sum(axis=1).mean()))


def consistency(sequence: Sequence, track: Track) -> float:
    """The squared error of place and heading in the plane by its covariance, mean over the edges after the first, a
    third of it: 1 where the filter knows how wrong it is."""
    attitude, position = track.attitude[sequence.edges], track.position[sequence.edges]
    turn = (sequence.attitude[sequence.edges] * attitude.inv()).as_rotvec()[:, 2:]
    error = np.concatenate([turn, (sequence.position[sequence.edges] - position)[:, :2]], axis=1)[1:]
    spread = track.covariance[1:, 2:5, 2:5]
    return float(np.einsum("ni,ni->n", error, np.linalg.solve(spread, error[..., None])[..., 0]).mean() / 3)

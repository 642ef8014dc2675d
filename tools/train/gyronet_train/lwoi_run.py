"""A drive by lwoi: from windows and trained processes to a pose every 10 ms.

There are four ways to run it. `odometry` moves on by wheels and fibre-optic gyro alone, level as it
starts; `constant` adds the mean error of the training's seconds, to show how much of the gain four
numbers have; `model` adds what the process expects of each second, roll and pitch left out; `filter`
starts with the true attitude and has each second corrected by the inertial sensor as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .lwoi_filter import Filter, Measured, Motion
from .lwoi_motion import corrected, inertial_motion, odometry_motion, odometry_poses
from .lwoi_process import Errors
from .sequence import STEPS, Sequence
from .trajectory import Track

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

"""Runs lwoi on a drive: from windows and trained processes to a pose every 10 ms.

There are four modes. `odometry` uses wheels and fibre-optic gyro alone and stays level. `constant` adds
the mean error over the training's seconds, to show how much of the gain four numbers give. `model` adds
the error that the process expects for each second, without roll and pitch. `filter` starts with the true
attitude, and also corrects each second by the inertial sensor.
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
# Least standard deviations of the inertial sensor's rotation (rad), velocity change (m/s) and displacement (m): the
# fixed values of lwoi's authors (the smaller of their two for the displacement). The process predicts less, but assumes
# that errors of successive seconds are independent, although a gyro's bias is the same in all.
LEAST_STD = np.repeat([2 / 180, 0.1, 0.2], 3)


@dataclass(frozen=True)
class Expected:
    """The expected errors of a drive's odometry and inertial sensor, and the variance of the wheels' speed. `constant`
    and `mean_square` are the mean and mean square of the odometry's errors in training (6)."""

    constant: np.ndarray
    mean_square: np.ndarray
    odometry: Errors
    inertial: Errors
    speed_variance: float

    def twists(self, mode: str) -> Errors:
        """Returns the expected errors of the odometry in a mode, without roll and pitch."""
        like = np.ones_like(self.odometry.mean)
        mean, variance = {
            "odometry": (0.0 * like, self.mean_square * like),
            "constant": (self.constant * like, (self.mean_square - self.constant**2) * like),
        }.get(mode, (self.odometry.mean.copy(), self.odometry.variance))
        mean[:, LEVEL] = 0.0
        return Errors(mean, variance)


def run(sequence: Sequence, expected: Expected, mode: str) -> Track:
    """Runs a drive from its true first pose. Raises FilterError if the filter diverges."""
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
    """Returns the poses of a window's steps relative to its beginning; the twist grows linearly."""
    turn, way = odometry_poses(odometry[None])
    turns = np.zeros((STEPS, 3))
    turns[:, 2] = turn[0, 1:]
    share = np.arange(1, STEPS + 1)[:, None] / STEPS
    return corrected(Rotation.from_rotvec(turns), np.pad(way[0, 1:], ((0, 0), (0, 1))), share * twist)

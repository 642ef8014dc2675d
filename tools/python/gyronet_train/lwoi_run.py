"""Runs lwoi on a drive: from windows and a trained process to a pose every 10 ms.

There are three modes, all level. `odometry` uses wheels and fibre-optic gyro alone. `constant` adds the mean
error over the training's seconds, to show how much of the gain four numbers give. `model` adds the error that
the process expects for each second, without roll and pitch.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .lwoi_motion import corrected, odometry_motion, odometry_poses
from .sequence import STEPS, Sequence
from .trajectory import Track

MODES = ("odometry", "constant", "model")
LEVEL = slice(3, 5)  # of a twist: roll and pitch


@dataclass(frozen=True)
class Expected:
    """The expected errors: the mean of the training's (6), and those of the drive's odometry (n, 6)."""

    constant: np.ndarray
    odometry: np.ndarray

    def twists(self, mode: str) -> np.ndarray:
        """Returns the expected errors of the odometry in a mode, without roll and pitch."""
        like = np.ones_like(self.odometry)
        mean = {"odometry": 0.0 * like, "constant": self.constant * like}.get(mode, self.odometry.copy())
        mean[:, LEVEL] = 0.0
        return mean


def run(sequence: Sequence, expected: Expected, mode: str) -> Track:
    """Runs a drive from its true first position and heading."""
    twists = expected.twists(mode)
    rotation, way = corrected(*odometry_motion(sequence.odometry), twists)
    attitude, position = Rotation.from_euler("z", sequence.attitude[0].as_euler("ZYX")[0]), sequence.position[0]
    attitudes, positions = [attitude.as_quat()[None]], [position[None]]
    for k in range(len(sequence)):
        within = steps_within(sequence.odometry[k], twists[k])
        attitudes.append((attitude * within[0]).as_quat())
        positions.append(position + attitude.apply(within[1]))
        position = position + attitude.apply(way[k])
        attitude = attitude * rotation[k]
        attitudes[-1][-1], positions[-1][-1] = attitude.as_quat(), position
    return Track(Rotation.from_quat(np.concatenate(attitudes)), np.concatenate(positions), 0)


def steps_within(odometry: np.ndarray, twist: np.ndarray) -> tuple[Rotation, np.ndarray]:
    """Returns the poses of a window's steps relative to its beginning; the twist grows linearly."""
    turn, way = odometry_poses(odometry[None])
    turns = np.zeros((STEPS, 3))
    turns[:, 2] = turn[0, 1:]
    share = np.arange(1, STEPS + 1)[:, None] / STEPS
    return corrected(Rotation.from_rotvec(turns), np.pad(way[0, 1:], ((0, 0), (0, 1))), share * twist)

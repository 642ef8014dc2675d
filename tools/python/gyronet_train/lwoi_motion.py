"""The motion in a second by odometry, and its errors.

Windows are independent of each other, so each function processes all windows of a drive at once. The errors
are what lwoi's process learns: the twist from odometry's pose to the true pose, translation first.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from .motion import left_jacobian
from .sequence import Sequence


def odometry_poses(odometry: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns turns (N, 101) and displacements (N, 101, 2) from the beginning of each window. A step moves, then
    turns."""
    way = odometry[:, :, :2].mean(axis=2)
    turn = np.concatenate([np.zeros((len(way), 1)), np.cumsum(odometry[:, :, 2], axis=1)], axis=1)
    steps = way[..., None] * np.stack([np.cos(turn[:, :-1]), np.sin(turn[:, :-1])], axis=-1)
    return turn, np.concatenate([np.zeros((len(way), 1, 2)), np.cumsum(steps, axis=1)], axis=1)


def odometry_motion(odometry: np.ndarray) -> tuple[Rotation, np.ndarray]:
    """Returns the pose at the end of each window relative to its beginning."""
    turn, way = odometry_poses(odometry)
    turns = np.zeros((len(turn), 3))
    turns[:, 2] = turn[:, -1]
    return Rotation.from_rotvec(turns), np.pad(way[:, -1], ((0, 0), (0, 1)))


def corrected(rotation: Rotation, way: np.ndarray, twist: np.ndarray) -> tuple[Rotation, np.ndarray]:
    """Moves poses on by twists (N, 6)."""
    moved = np.einsum("nij,nj->ni", left_jacobian(twist[:, 3:]), twist[:, :3])
    return rotation * Rotation.from_rotvec(twist[:, 3:]), way + rotation.apply(moved)


def odometry_errors(sequence: Sequence) -> np.ndarray:
    """Returns the twists (N, 6) from odometry's motion in each window to the true motion."""
    rotation, way = odometry_motion(sequence.odometry)
    attitude, position = sequence.attitude[sequence.edges], sequence.position[sequence.edges]
    moved = attitude[:-1].inv().apply(np.diff(position, axis=0))
    turn = (rotation.inv() * attitude[:-1].inv() * attitude[1:]).as_rotvec()
    ahead = rotation.inv().apply(moved - way)
    return np.concatenate([np.linalg.solve(left_jacobian(turn), ahead[..., None])[..., 0], turn], axis=1)

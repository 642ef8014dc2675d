"""The motion in a second by odometry and by the inertial sensor, and the errors of both.

Windows are independent of each other, so each function processes all windows of a drive at once. The
errors are what lwoi's processes learn: for odometry the twist from its pose to the true pose
(translation first), for the inertial sensor the differences of its preintegrated rotation, velocity
and displacement.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from .motion import GRAVITY, left_jacobian
from .sequence import DT, STEPS, Sequence

WINDOW_S = STEPS * DT


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


def inertial_motion(inertial: np.ndarray) -> np.ndarray:
    """Returns the rotation vector, velocity and displacement (N, 9) that the inertial sensor measures in each window,
    including gravity."""
    attitude = Rotation.identity(len(inertial))
    velocity, way = np.zeros((2, len(inertial), 3))
    for k in range(inertial.shape[1]):
        force = attitude.apply(inertial[:, k, 3:])
        way = way + velocity * DT + force * DT**2 / 2
        velocity = velocity + force * DT
        attitude = attitude * Rotation.from_rotvec(inertial[:, k, :3] * DT)
    return np.concatenate([attitude.as_rotvec(), velocity, way], axis=1)


def true_inertial_motion(sequence: Sequence) -> np.ndarray:
    """Returns what an ideal inertial sensor would measure along the true poses (N, 9)."""
    attitude, position = sequence.attitude[sequence.edges], sequence.position[sequence.edges]
    velocity = sequence.edge_velocity
    from_begin = attitude[:-1].inv()
    gained = np.diff(velocity, axis=0) - GRAVITY * WINDOW_S
    moved = np.diff(position, axis=0) - velocity[:-1] * WINDOW_S - GRAVITY * WINDOW_S**2 / 2
    turn = (from_begin * attitude[1:]).as_rotvec()
    return np.concatenate([turn, from_begin.apply(gained), from_begin.apply(moved)], axis=1)


def inertial_errors(sequence: Sequence) -> np.ndarray:
    """Returns what must be added to the inertial sensor's motion in each window (N, 9)."""
    return true_inertial_motion(sequence) - inertial_motion(sequence.inertial)

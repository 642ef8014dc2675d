"""What odometry and the inertial sensor say of a second's motion, and by how much they are wrong.

Windows are independent of each other, so each function takes all windows of a drive at once. The
errors are what lwoi's processes learn: those of odometry as the twist that leads from its pose to
the true one (translation first), those of the inertial sensor as differences of its preintegrated
rotation, velocity and way.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from .motion import GRAVITY, left_jacobian
from .sequence import DT, STEPS, Sequence

WINDOW_S = STEPS * DT


def odometry_poses(odometry: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turns (N, 101) and ways (N, 101, 2) of each window from its beginning: a step ahead, then its turn."""
    way = odometry[:, :, :2].mean(axis=2)
    turn = np.concatenate([np.zeros((len(way), 1)), np.cumsum(odometry[:, :, 2], axis=1)], axis=1)
    steps = way[..., None] * np.stack([np.cos(turn[:, :-1]), np.sin(turn[:, :-1])], axis=-1)
    return turn, np.concatenate([np.zeros((len(way), 1, 2)), np.cumsum(steps, axis=1)], axis=1)


def odometry_motion(odometry: np.ndarray) -> tuple[Rotation, np.ndarray]:
    """The pose at the end of each window as seen from its beginning."""
    turn, way = odometry_poses(odometry)
    turns = np.zeros((len(turn), 3))
    turns[:, 2] = turn[:, -1]
    return Rotation.from_rotvec(turns), np.pad(way[:, -1], ((0, 0), (0, 1)))


def corrected(rotation: Rotation, way: np.ndarray, twist: np.ndarray) -> tuple[Rotation, np.ndarray]:
    """Moves on from poses by twists (N, 6)."""
    moved = np.einsum("nij,nj->ni", left_jacobian(twist[:, 3:]), twist[:, :3])
    return rotation * Rotation.from_rotvec(twist[:, 3:]), way + rotation.apply(moved)


def odometry_errors(sequence: Sequence) -> np.ndarray:
    """The twists (N, 6) from odometry's motion of each window to the true one."""
    rotation, way = odometry_motion(sequence.odometry)
    attitude, position = sequence.attitude[sequence.edges], sequence.position[sequence.edges]
    moved = attitude[:-1].inv().apply(np.diff(position, axis=0))
    turn = (rotation.inv() * attitude[:-1].inv() * attitude[1:]).as_rotvec()
    ahead = rotation.inv().apply(moved - way)
    return np.concatenate([np.linalg.solve(left_jacobian(turn), ahead[..., None])[..., 0], turn], axis=1)


def inertial_motion(inertial: np.ndarray) -> np.ndarray:
    """The rotation vector, velocity and way (N, 9) that the inertial sensor measures in each window, gravity in it."""
    attitude = Rotation.identity(len(inertial))
    velocity, way = np.zeros((2, len(inertial), 3))
    for k in range(inertial.shape[1]):
        force = attitude.apply(inertial[:, k, 3:])
        way = way + velocity * DT + force * DT**2 / 2
        velocity = velocity + force * DT
        attitude = attitude * Rotation.from_rotvec(inertial[:, k, :3] * DT)
    return np.concatenate([attitude.as_rotvec(), velocity, way], axis=1)


def true_inertial_motion(sequence: Sequence) -> np.ndarray:
    """What the inertial sensor would measure of the true poses (N, 9)."""
    attitude, position = sequence.attitude[sequence.edges], sequence.position[sequence.edges]
    velocity = sequence.edge_velocity
    from_begin = attitude[:-1].inv()
    gained = np.diff(velocity, axis=0) - GRAVITY * WINDOW_S
    moved = np.diff(position, axis=0) - velocity[:-1] * WINDOW_S - GRAVITY * WINDOW_S**2 / 2
    turn = (from_begin * attitude[1:]).as_rotvec()
    return np.concatenate([turn, from_begin.apply(gained), from_begin.apply(moved)], axis=1)


def inertial_errors(sequence: Sequence) -> np.ndarray:
    """What must be added to the inertial sensor's motion of each window (N, 9)."""
    return true_inertial_motion(sequence) - inertial_motion(sequence.inertial)

"""Rotation vectors and gravity, for the filters of all rivals."""

import numpy as np

GRAVITY = np.array([0.0, 0.0, -9.80665])  # m/s^2
SMALL = 1e-4  # rad: below it, series are used instead of quotients
# The cross products of the axes: (x, y, z) @ CROSS is the flat matrix [[0, -z, y], [z, 0, -x], [-y, x, 0]].
CROSS = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]], float)


def skew(v: np.ndarray) -> np.ndarray:
    """Returns the matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    return (v @ CROSS).reshape(*v.shape, 3)


def left_jacobian(rotation: np.ndarray) -> np.ndarray:
    """Returns the left Jacobians (..., 3, 3) of rotation vectors (..., 3); they map twists to displacements."""
    angle = np.sqrt((rotation * rotation).sum(axis=-1))[..., None, None]
    safe = np.where(angle < SMALL, 1.0, angle)
    first = np.where(angle < SMALL, 0.5 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    second = np.where(angle < SMALL, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    cross = skew(rotation)
    return np.eye(3) + first * cross + second * cross @ cross


def exponential(rotation: np.ndarray) -> np.ndarray:
    """Returns the rotation matrices (..., 3, 3) of rotation vectors (..., 3)."""
    return np.eye(3) + skew(rotation) @ left_jacobian(rotation)

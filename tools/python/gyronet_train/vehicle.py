"""The mounting of the sensor, from the vehicle file of a drive (`DRIVE.toml` beside `DRIVE.csv`).

Training rotates the rows of a drive into the vehicle's axes, as every command of `gyronet` does.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ANGLES = ("roll_deg", "pitch_deg", "yaw_deg")


@dataclass(frozen=True)
class Mounting:
    """The rotation that the rows of a drive still need, and the text of the vehicle file."""

    rotation: np.ndarray
    text: bytes

    def turn(self, vectors: np.ndarray) -> np.ndarray:
        """Rotates vectors (T, 3) from the sensor's axes to the vehicle's."""
        return vectors @ self.rotation.T


def read_mounting(drive: Path) -> Mounting:
    """Reads the vehicle file beside a drive; without one, the rows are in the vehicle's axes. Raises ValueError."""
    path = drive.with_suffix(".toml")
    text = path.read_bytes() if path.is_file() else b""
    try:
        mounting = tomllib.loads(text.decode()).get("mounting", {})
        applied = mounting.get("applied", False)
        angles = np.array([float(mounting.get(name, 0.0)) for name in ANGLES])
    except (ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: not a valid vehicle file: {error}") from error
    if not (abs(angles) <= 360).all():
        raise ValueError(f"{path}: the angles of mounting must be at most 360 degrees")
    if applied or not angles.any():
        return Mounting(np.eye(3), b"")
    (sr, sp, sy), (cr, cp, cy) = np.sin(np.deg2rad(angles)), np.cos(np.deg2rad(angles))
    rotation = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return Mounting(np.array(rotation), text)

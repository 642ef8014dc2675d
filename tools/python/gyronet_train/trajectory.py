"""Trajectories that a rival estimates: their representation, their errors and their files."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from .sequence import PERIOD_NS, Sequence


class FilterError(ValueError):
    """A filter has diverged. The text says when and why."""


@dataclass(frozen=True)
class Track:
    """A pose at each step, and the number of refused measurements."""

    attitude: Rotation
    position: np.ndarray
    refused: int


def write_tum(sequence: Sequence, track: Track, path: Path) -> None:
    """Writes the poses as `time x y z qx qy qz qw`, with the time in s (rounded to a microsecond, the resolution of the
    input) and positions in the frame of the true poses."""
    with path.open("w") as file:
        for k, (place, turn) in enumerate(zip(track.position, track.attitude.as_quat())):
            whole, rest = divmod(round((sequence.start_ns + k * PERIOD_NS) / 1000), 10**6)
            numbers = " ".join(f"{number:.6f}" for number in place) + " " + " ".join(f"{q:.9f}" for q in turn)
            file.write(f"{whole}.{rest:06d} {numbers}\n")


def trajectory_error(estimate: np.ndarray, truth: np.ndarray, align: bool) -> float:
    """Returns the RMS distance of positions in the plane, m; with `align`, after the best rotation and shift."""
    estimate, truth = estimate[:, :2], truth[:, :2]
    if align:
        estimate, truth = estimate - estimate.mean(axis=0), truth - truth.mean(axis=0)
        cross = (estimate[:, 0] * truth[:, 1] - estimate[:, 1] * truth[:, 0]).sum()
        angle = np.arctan2(cross, (estimate * truth).sum())
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        estimate = estimate @ turn
    return float(np.sqrt(((estimate - truth) ** 2).sum(axis=1).mean()))

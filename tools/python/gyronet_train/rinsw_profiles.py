"""The four motion profiles of RINS-W, computed from the true poses, and the scores of a detector.

The true poses give the labels for training and report. They are smoothed over 11 steps (Savitzky and
Golay), before and after differentiation.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from .sequence import DT, Sequence

PROFILES = ("velocity", "rotation", "lateral", "vertical")
VELOCITY, ROTATION, LATERAL, VERTICAL = range(4)  # columns of labels and detections: the motion is zero
SMOOTH = 11  # steps


@dataclass(frozen=True)
class Limits:
    """Below these a motion counts as zero: speed, angular rate, lateral and vertical velocity."""

    velocity: float = 0.004  # m/s
    rotation: float = 0.001  # rad/s: the best of 0.005, 0.002 and 0.001 on training sequences with true profiles
    lateral: float = 0.1  # m/s
    vertical: float = 0.1  # m/s


def label(sequence: Sequence, limits: Limits = Limits()) -> np.ndarray:
    """Returns which profiles are true in each step of a sequence (N * 100, 4), of type bool."""
    position = savgol_filter(sequence.position, SMOOTH, 1, axis=0)
    velocity = savgol_filter(np.diff(position, axis=0) / DT, SMOOTH, 0, axis=0)
    turns = (sequence.attitude[:-1].inv() * sequence.attitude[1:]).as_rotvec()
    rate = savgol_filter(turns / DT, SMOOTH, 0, axis=0)
    in_body = sequence.attitude[:-1].inv().apply(velocity)
    return np.stack(
        [
            np.linalg.norm(velocity, axis=1) < limits.velocity,
            np.linalg.norm(rate, axis=1) < limits.rotation,
            abs(in_body[:, 1]) < limits.lateral,
            abs(in_body[:, 2]) < limits.vertical,
        ],
        axis=1,
    )


def agreement(detected: np.ndarray, true: np.ndarray) -> dict[str, dict]:
    """Returns each profile's share of the steps, and the precision and recall of its detections (None if undefined)."""
    numbers = {}
    for k, profile in enumerate(PROFILES):
        both = (detected[:, k] & true[:, k]).sum()
        counts = {"precision": detected[:, k].sum(), "recall": true[:, k].sum()}
        rates = {name: round(float(both / count), 5) if count else None for name, count in counts.items()}
        numbers[profile] = {"share": round(float(true[:, k].mean()), 5), **rates}
    return numbers

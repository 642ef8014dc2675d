"""Runs RINS-W on a drive: from samples and detections to a pose every 10 ms.

There are four modes. `rinsw` uses the profiles that the four networks detect, as in the paper. `stops`
uses only the network for zero velocity, also for zero rotation, and always counts lateral and vertical
velocity as zero, like the program that the authors released later. `truth` uses the true profiles, to
show what better detectors would gain. `inertial` detects nothing.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from .rinsw_filter import Filter, Noise
from .rinsw_profiles import ROTATION, VELOCITY
from .seconds import STATIC_S
from .sequence import DT, Sequence
from .trajectory import Track

MODES = ("rinsw", "stops", "truth", "inertial")


def samples_of(sequence: Sequence) -> np.ndarray:
    """Returns a sequence's samples of the inertial sensor (N * 100, 6), with the windows concatenated."""
    return sequence.inertial.reshape(-1, sequence.inertial.shape[-1])


def gates(detected: np.ndarray, true: np.ndarray, mode: str) -> np.ndarray:
    """Returns the profiles (steps, 4) that the filter uses in a mode."""
    if mode == "stops":
        chosen = np.ones_like(detected)
        chosen[:, VELOCITY] = chosen[:, ROTATION] = detected[:, VELOCITY]
        return chosen
    return {"rinsw": detected, "truth": true, "inertial": np.zeros_like(detected)}[mode]


def run(sequence: Sequence, detected: np.ndarray, noise: Noise = Noise()) -> Track:
    """Runs a drive from its true first position and heading. Raises FilterError if the filter diverges.

    The first three seconds, at standstill, give bias, roll and pitch; the pose is constant in them.
    """
    samples, standing = samples_of(sequence), int(STATIC_S / DT)
    state = Filter(sequence.attitude[0].as_matrix(), noise)
    state.start(samples[:standing])
    attitudes, positions = [state.attitude], [state.position]
    for k, (sample, gate) in enumerate(zip(samples, detected), start=1):
        if k > standing:
            state.move(sample, gate)
            state.measure(sample, gate)
        attitudes.append(state.attitude)
        positions.append(state.position)
    attitude = Rotation.from_matrix(np.array(attitudes))
    return Track(attitude, sequence.position[0] + np.array(positions), state.refused)

"""Sequences in the layout of KAIST Urban: windows of one second on a 100 Hz grid, and the true poses.

The grid begins at the first row of the inertial sensor at which all other files have begun, as in
`gyronet-paper tables`, and has whole seconds only. Distances and turns are interpolated as sums, so that no
increment is lost or counted twice; the inertial sensor's values are means over a step. The gyro's mean
over the first three seconds, at standstill, is subtracted from the gyro.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from .seconds import STATIC_S, kaist_files

STEPS = 100  # per window
DT = 0.01  # s
PERIOD_NS = 10_000_000
MAX_GAP_NS = 100_000_000  # a longer one between two rows of a file is a gap
LEAST = 5  # fewest windows of a piece between two gaps: the detectors of RINS-W train on four
STANDING_M = 0.01  # largest distance that the wheels may roll while the gyro's mean is taken


class SequenceError(ValueError):
    """A sequence cannot be used. The text names the folder and the reason."""


@dataclass(frozen=True)
class Sequence:
    """One drive of N windows. Lengths are in m, angles in rad; the true poses are at the N * 100 + 1 steps."""

    name: str
    sha256: str
    start_ns: int
    odometry: np.ndarray  # (N, 100, 3): distances of the left and the right wheel, turn by the fibre-optic gyro
    inertial: np.ndarray  # (N, 100, 6): gyro, accelerometer
    attitude: Rotation
    position: np.ndarray  # (N * 100 + 1, 3)
    whole: np.ndarray  # (N,): true if no file has a gap in the window

    def __len__(self) -> int:
        return len(self.odometry)

    def part(self, begin: int, end: int) -> "Sequence":
        """Returns the windows from `begin` to `end`."""
        windows, steps = slice(begin, end), slice(begin * STEPS, end * STEPS + 1)
        return replace(
            self,
            start_ns=self.start_ns + begin * STEPS * PERIOD_NS,
            odometry=self.odometry[windows],
            inertial=self.inertial[windows],
            attitude=self.attitude[steps],
            position=self.position[steps],
            whole=self.whole[windows],
        )

    def pieces(self) -> list["Sequence"]:
        """Returns the pieces between gaps, for training."""
        inside = np.concatenate([[0], self.whole.astype(int), [0]])
        edges = np.flatnonzero(np.diff(inside)).reshape(-1, 2)
        return [self.part(begin, end) for begin, end in edges if end - begin >= LEAST]

    @property
    def edges(self) -> slice:
        """Returns the steps at which windows begin and end."""
        return slice(None, None, STEPS)


def load_sequence(folder: Path) -> Sequence:
    """Reads a folder in the KAIST Urban layout. Raises SequenceError with the reason."""
    try:
        return read(folder)
    except (OSError, ValueError) as error:
        raise SequenceError(f"{folder}: {error}") from error


def load_pieces(folders: list[Path]) -> list[Sequence]:
    """Reads folders in the KAIST Urban layout, in pieces between gaps. Raises SequenceError with the reason."""
    pieces = [piece for folder in folders for piece in load_sequence(folder).pieces()]
    if not pieces:
        raise SequenceError(f"no piece of {LEAST} s without a gap in {', '.join(map(str, folders))}")
    return pieces


def read(folder: Path) -> Sequence:
    """Reads the four files and the encoder's calibration, and resamples them to the grid."""
    files, scale, digest = kaist_files(folder)
    imu, fog, encoder, pose = files
    latest = max(t[0, 0] for t in files)
    start = imu[np.searchsorted(imu[:, 0], latest), 0]
    count = int((min(t[-1, 0] for t in files) - start) // 10**9)
    if count < STATIC_S + 1:
        raise SequenceError(f"its files have {count} s in common, but at least {STATIC_S + 1:.0f} s are needed")
    grid = np.arange(count * STEPS + 1) * DT

    def on_grid(times: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.interp(grid, (times - start) / 1e9, values)

    wheels = [np.diff(on_grid(encoder[:, 0], encoder[:, 1 + k] * scale[k])) for k in range(2)]
    turns = np.diff(on_grid(fog[:, 0], np.cumsum(fog[:, 3])))
    samples = np.stack([on_grid(imu[:, 0], imu[:, k]) for k in range(8, 14)], axis=1)
    inertial = (samples[1:] + samples[:-1]) / 2
    standing = int(STATIC_S / DT)
    if abs(wheels[0][:standing].sum() + wheels[1][:standing].sum()) > 2 * STANDING_M:
        raise SequenceError(f"the vehicle moves in the first {STATIC_S:.0f} s, in which the gyro's mean is taken")
    inertial[:, :3] -= inertial[:standing, :3].mean(axis=0)
    whole = np.ones(count, bool)
    for times in (table[:, 0] for table in files):
        for gap in np.flatnonzero(np.diff(times) > MAX_GAP_NS):
            first, last = ((times[gap : gap + 2] - start) // 10**9).astype(int)
            whole[max(first, 0) : max(last + 1, 0)] = False
    matrices = pose[:, [1, 2, 3, 5, 6, 7, 9, 10, 11]].reshape(-1, 3, 3)
    times = (pose[:, 0] - start) / 1e9
    return Sequence(
        name=folder.name,
        sha256=digest.hexdigest(),
        start_ns=int(start),
        odometry=np.stack([*wheels, turns], axis=1).reshape(count, STEPS, 3),
        inertial=inertial.reshape(count, STEPS, 6),
        attitude=Slerp(times, Rotation.from_matrix(matrices))(np.clip(grid, times[0], times[-1])),
        position=np.stack([on_grid(pose[:, 0], pose[:, k]) for k in (4, 8, 12)], axis=1),
        whole=whole,
    )

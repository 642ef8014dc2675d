"""Drives as input of FoGNet: one row of nine features per second, and the true turn.

Increments (gyro, wheels) are summed over a second, the inertial sensor is averaged. The mean of its gyro
over the first three seconds, at standstill, is subtracted.
"""

import hashlib
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .recordings import read_table

STEPS = 60  # per window
FOG = 8  # column of the gyro increment
STATIC_S = 3.0
RATE_HZ = 100
DRIVE = ("t_s", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z", "left_m", "right_m", "fog_rad", "ref_gyr_z")


@dataclass(frozen=True)
class Seconds:
    """One drive: features (T, 9) in float64, and the true yaw change of each second (T,) in rad."""

    name: str
    sha256: str
    features: np.ndarray
    turn: np.ndarray


def window_rows(end: int, padding: str) -> np.ndarray | None:
    """Returns the rows of the window that ends with row `end - 1`, oldest first.

    If there are fewer than 60 rows (Fig. 8 of the paper), `repeat` repeats the existing rows in their
    order, and `none` gives no window.
    """
    rows = np.arange(end - STEPS, end)
    if end >= STEPS:
        return rows
    return rows % end if padding == "repeat" else None


def kaist_files(folder: Path):
    """Reads the four files of a sequence in the KAIST Urban layout (IMU, fibre-optic gyro, encoders, pose), the
    encoders' scale, and the hash of the files."""
    digest = hashlib.sha256()
    sensors = folder / "sensor_data"
    imu = table(sensors / "xsens_imu.csv", 17, digest)
    fog = table(sensors / "fog.csv", 4, digest)
    encoder = table(sensors / "encoder.csv", 3, digest)
    pose = table(folder / "global_pose.csv", 13, digest)
    scale = encoder_scale(folder / "calibration" / "EncoderParameter.txt")
    return (imu, fog, encoder, pose), scale, digest


def load_grid(path: Path, rates: Path | None = None) -> list[Seconds]:
    """Reads a drive that `gyronet-paper import` wrote: the pieces of whole seconds between its gaps, counted
    from its first row. If `rates` is given, the delayed rates of `gyronet replay --csv` replace the fibre-optic
    gyro: the paper's pseudo-FoG. Raises ValueError with the reason."""
    table, vehicle, digest = read_table(path, DRIVE)
    values = np.stack([table[name] for name in DRIVE], axis=1)
    values[:, 1:4], values[:, 4:7] = vehicle.turn(values[:, 1:4]), vehicle.turn(values[:, 4:7])
    row = np.round((values[:, 0] - values[0, 0]) * RATE_HZ).astype(int)
    second = row // RATE_HZ
    if rates:
        values[:, 9] = turns(rates, values[0, 0], row)
    values[:, 4:7] -= values[second < STATIC_S, 4:7].mean(axis=0)
    values[:, 10] /= RATE_HZ
    whole = np.flatnonzero(np.bincount(second) == RATE_HZ)
    rows = values[np.isin(second, whole)].reshape(-1, RATE_HZ, len(DRIVE))
    features = np.concatenate([rows[:, :, 1:7].mean(axis=1), rows[:, :, 7:10].sum(axis=1)], axis=1)
    turn = rows[:, :, 10].sum(axis=1)
    edges = [0, *np.flatnonzero(np.diff(whole) > 1) + 1, len(whole)]
    return [
        Seconds(path.stem, digest, features[begin:end], turn[begin:end])
        for begin, end in zip(edges, edges[1:])
    ]


def turns(path: Path, start: float, row: np.ndarray) -> np.ndarray:
    """Returns the turns of a drive's rows by the rates that `gyronet replay --csv` wrote. Before the first rate the
    turns are zero, since the vehicle stands."""
    sent = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="ascii")
    at = np.round((sent["t_s"] - start) * RATE_HZ).astype(int)
    if not np.isin(at, row).all():
        raise ValueError(f"{path}: has rates at times at which the drive has no rows")
    turn = np.zeros(row[-1] + 1)
    turn[at] = np.nan_to_num(sent["delayed"]) / RATE_HZ
    return turn[row]


def table(path: Path, columns: int, digest) -> np.ndarray:
    """Reads a CSV of that many columns. Stamps of 1.5e18 ns are rounded to 256 ns, which is precise enough here. Rows
    that are not finite or repeat a stamp are left out and counted."""
    digest.update(path.read_bytes())
    try:
        values = np.loadtxt(path, delimiter=",", dtype=np.float64, ndmin=2)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if values.shape[1] != columns:
        raise ValueError(f"{path}: must have {columns} columns")
    lines = np.arange(len(values)) + 1
    finite = np.isfinite(values).all(axis=1)
    values, lines = values[finite], lines[finite]
    new = np.diff(values[:, 0], prepend=-np.inf) != 0
    left_out = int((~finite).sum() + (~new).sum())
    if left_out:
        print(f"{path}: {left_out} rows left out, not finite or with a repeated time stamp", file=sys.stderr)
    values, lines = values[new], lines[new]
    backwards = np.flatnonzero(np.diff(values[:, 0]) < 0)
    if len(backwards):
        raise ValueError(f"{path}: line {lines[backwards[0] + 1]}: time goes backwards")
    if len(values) == 0:
        raise ValueError(f"{path}: holds no samples")
    return values


def encoder_scale(path: Path) -> list[float]:
    """Returns metres per count of the left and the right wheel."""
    entries = {}
    for line in path.read_text().splitlines():
        words = line.split()
        if len(words) > 2 and words[0] == "Encoder":
            entries[words[1]] = words[-1]
    try:
        resolution = float(entries["resolution:"])
        return [float(entries[side]) * np.pi / resolution for side in ("left", "right")]
    except (KeyError, ValueError) as error:
        raise ValueError(f"{path}: no encoder resolution or wheel diameter") from error

"""Reads drive CSV files and cuts them into the windows of the network.

A drive is sampled at 100 Hz and stands still for the first three seconds. The
gyro's mean over those seconds is subtracted from the gyro, in rad/s (static
initialisation); the accelerometer is unchanged, in m/s^2. Both are rotated by
the mounting in the vehicle file beside the drive.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gyronet.refused import Refused
from gyronet.vehicle import Vehicle

RATE_HZ = 100
STATIC_SAMPLES = 3 * RATE_HZ
LEAST_SAMPLES = STATIC_SAMPLES + 2 * RATE_HZ  # shorter pieces between two gaps are left out
WINDOW = 10
STRIDE = 5  # samples between the beginnings of windows, as the firmware runs them
COLUMNS = ("t_s", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z", "ref_gyr_z")


@dataclass(frozen=True)
class Drive:
    """One drive: features (T, 6) = specific force xyz, angular rate xyz; gyro error (T,), the label."""

    name: str
    sha256: str
    features: np.ndarray
    gyro_error: np.ndarray
    reference_rate: np.ndarray


def load_drive(path: Path) -> Drive:
    """Reads one CSV without gaps. Raises ValueError with the file's name and the reason."""
    drives = load_pieces(path)
    if len(drives) > 1:
        raise ValueError(f"{path}: must be an unbroken 100 Hz recording of more than 3 s")
    return drives[0]


def load_pieces(path: Path) -> list[Drive]:
    """Reads the pieces of one CSV between its gaps; all have the static initialisation of the first. Raises ValueError
    with the file's name and the reason."""
    table, vehicle, digest = read_table(path, COLUMNS)
    values = np.stack([table[name] for name in COLUMNS], axis=1)
    broken = np.flatnonzero(abs(np.diff(values[:, 0]) - 1 / RATE_HZ) > 1e-3) + 1
    pieces = np.split(np.arange(len(values)), broken)
    if len(pieces[0]) <= STATIC_SAMPLES:
        raise ValueError(f"{path}: must be an unbroken 100 Hz recording of more than 3 s")
    force, gyro, reference = vehicle.turn(values[:, 1:4]), vehicle.turn(values[:, 4:7]), values[:, 7]
    gyro = gyro - gyro[:STATIC_SAMPLES].mean(axis=0)
    kept = [rows for rows in pieces if len(rows) >= LEAST_SAMPLES] if len(pieces) > 1 else pieces
    if not kept:
        raise ValueError(f"{path}: no piece of {LEAST_SAMPLES / RATE_HZ:.0f} s without a gap")
    return [
        Drive(
            name=path.stem,
            sha256=digest,
            features=np.concatenate([force[rows], gyro[rows]], axis=1).astype(np.float32),
            gyro_error=(gyro[rows, 2] - reference[rows]).astype(np.float32),
            reference_rate=reference[rows].astype(np.float32),
        )
        for rows in kept
    ]


def vehicle_of(drive: Path) -> tuple[Vehicle, bytes]:
    """Reads the vehicle file beside a drive, and its text if its mounting turns the rows; without one, the rows are in the
    vehicle's axes. Raises ValueError."""
    path = drive.with_suffix(".toml")
    try:
        vehicle = Vehicle.read(path) if path.is_file() else Vehicle()
    except Refused as error:
        raise ValueError(str(error)) from None
    return vehicle, path.read_bytes() if any(vehicle.mounting.values()) else b""


def read_table(path: Path, columns: tuple[str, ...]) -> tuple[np.ndarray, Vehicle, str]:
    """Reads the rows of one CSV, its vehicle, and the hash of both. Rows at the ends without a reference rate, if that is
    one of the columns, are left out. Raises ValueError if one of the columns does not have a number in every row."""
    vehicle, text = vehicle_of(path)
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=np.float64)
    missing = [name for name in columns if name not in (table.dtype.names or ())]
    if missing:
        raise ValueError(f"{path}: missing columns {', '.join(missing)}")
    first = 0
    if "ref_gyr_z" in columns and (known := np.flatnonzero(np.isfinite(table["ref_gyr_z"]))).size:
        first = known[0]
        table = table[first : known[-1] + 1]
    unknown = ~np.isfinite(np.stack([table[name] for name in columns], axis=1)).all(axis=1)
    if unknown.any():
        raise ValueError(f"{path}: line {first + np.argmax(unknown) + 2}: a value is empty or not a number")
    return table, vehicle, hashlib.sha256(path.read_bytes() + text).hexdigest()


def find_drive(folder: Path, name: str) -> Path:
    """Returns the path of the drive of that name, or of the only one whose name contains it. Raises ValueError."""
    name = name.removesuffix(".csv")
    if (folder / f"{name}.csv").is_file():
        return folder / f"{name}.csv"
    found = sorted(path for path in folder.glob("*.csv") if name in path.stem)
    if len(found) != 1:
        names = ", ".join(path.stem for path in found) or "no drive"
        raise ValueError(f"{folder}: {names} matching the name {name}")
    return found[0]


def windows(series: np.ndarray, length: int = WINDOW) -> np.ndarray:
    """Returns all windows of a series, one from each sample: (T, ...) -> (T-length+1, length, ...)."""
    view = np.lib.stride_tricks.sliding_window_view(series, length, axis=0)
    return np.moveaxis(view, -1, 1)


def overlap_mean(estimates: np.ndarray, length: int) -> np.ndarray:
    """Returns the mean of each sample's estimates from windows (W, WINDOW) STRIDE apart; 0 if no window covers the sample."""
    total, count = np.zeros(length), np.zeros(length)
    for k in range(WINDOW):
        samples = np.arange(len(estimates)) * STRIDE + k
        total[samples] += estimates[:, k]
        count[samples] += 1
    return total / np.maximum(count, 1)


def mean_1s_error(rate_error: np.ndarray) -> float:
    """Returns the mean |yaw error| over consecutive, non-overlapping 1 s windows after the static phase, rad."""
    error = rate_error[STATIC_SAMPLES:]
    whole = len(error) // RATE_HZ * RATE_HZ
    return float(np.abs(error[:whole].reshape(-1, RATE_HZ).sum(axis=1) / RATE_HZ).mean())

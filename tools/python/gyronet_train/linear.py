"""python -m gyronet_train.linear DATA --out FOLDER: fit the shipped model, a filter of eleven taps around a sample.

It removes from the yaw gyro the unit's mounting (roll and pitch rate), its gain, and noise (differences of neighbouring
gyro and accelerometer samples). A difference of neighbours is zero for a constant input, so the accelerometer's level and
a constant error do not contribute (`PARTS`). The fit minimises the absolute error of the yaw change over any second, the
number that the tools print. Mounting and gain of the training unit are fitted beside the rest and left out: they belong
to the unit, and the board or `gyronet calibrate` finds those of another.
"""

import argparse
import datetime
import json
import statistics
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from .recordings import (
    RATE_HZ,
    STATIC_SAMPLES,
    STRIDE,
    WINDOW,
    Drive,
    find_drive,
    load_drive,
    mean_1s_error,
    overlap_mean,
    windows,
)

REACH = 5
FEATURES = 6
ROLL, PITCH, YAW = 3, 4, 5
TAPS = 2 * REACH + 1
RIDGE = 1e-6
ITERATIONS = 30
SMALLEST_ERROR = 1e-6  # rad: below it an absolute error counts as a squared one
STEP = 5  # samples between the beginnings of the seconds that are fitted
GYRO_GRID, FORCE_GRID = 2.0**-22, 2.0**-28  # steps of weights whose sums float32 holds exactly


def level(feature: int) -> np.ndarray:
    """Returns a filter (1, TAPS, FEATURES) that is the sample itself."""
    taps = np.zeros((1, TAPS, FEATURES))
    taps[0, REACH, feature] = 1.0
    return taps


def differences(feature: int) -> np.ndarray:
    """Returns the filters that are differences of two neighbouring samples."""
    taps = np.zeros((TAPS - 1, TAPS, FEATURES))
    for k in range(TAPS - 1):
        taps[k, k, feature], taps[k, k + 1, feature] = -1.0, 1.0
    return taps


PARTS = {
    "mounting": np.concatenate([level(ROLL), level(PITCH)]),
    "low pass": differences(YAW),
    "accelerometer": np.concatenate([differences(axis) for axis in range(3)]),
    "gain": level(YAW),
}
SHIPPED = ("low pass", "accelerometer")
UNIT = ("mounting", "gain")


def seconds(series: np.ndarray) -> np.ndarray:
    """Integrates over seconds that begin STEP samples apart: (T, ...) -> (S, ...)."""
    total = np.concatenate([np.zeros_like(series[:1]), np.cumsum(series, axis=0)])
    return (total[RATE_HZ:] - total[:-RATE_HZ])[::STEP] / RATE_HZ


def neighbours(drive: Drive) -> np.ndarray:
    """Returns each sample with REACH neighbours on both sides, the ends repeated: (T, TAPS, FEATURES)."""
    padded = np.pad(drive.features.astype(np.float64), ((REACH, REACH), (0, 0)), mode="edge")
    return windows(padded, TAPS)


def sums(drive: Drive, basis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns for each second the output of every filter of the basis, and the gyro's error."""
    inputs = np.tensordot(neighbours(drive), basis, axes=([1, 2], [1, 2]))
    return seconds(inputs[STATIC_SAMPLES:]), seconds(drive.gyro_error[STATIC_SAMPLES:].astype(np.float64))


def fit(drives: list[tuple[np.ndarray, np.ndarray]], basis: np.ndarray, kept: int) -> np.ndarray:
    """Returns the combination of the basis with the least absolute errors on some drives' sums, of its first `kept` filters
    and of all: (2, TAPS, FEATURES)."""
    inputs, errors = (np.concatenate(part) for part in zip(*drives))
    size = np.sqrt((inputs**2).mean(axis=0))
    inputs = inputs / size
    weight = np.ones(len(errors))
    for _ in range(ITERATIONS):
        weighted = inputs * weight[:, None] / weight.sum()
        normal = weighted.T @ inputs + RIDGE * np.eye(len(size))
        solution = np.linalg.solve(normal, weighted.T @ errors)
        weight = 1 / np.maximum(abs(errors - inputs @ solution), SMALLEST_ERROR)
    part = solution / size
    return np.stack([np.tensordot(part[:upto], basis[:upto], axes=1) for upto in (kept, len(basis))])


def on_grid(taps: np.ndarray) -> np.ndarray:
    """Rounds the running sums of each feature's taps, so that taps whose sum is zero still sum to exactly zero."""
    grid = np.array([FORCE_GRID] * 3 + [GYRO_GRID] * 3)
    running = np.round(np.cumsum(taps, axis=-2) / grid) * grid
    return np.diff(running, axis=-2, prepend=0.0)


def rows(taps: np.ndarray) -> np.ndarray:
    """Returns the outputs of a window (WINDOW, WINDOW, FEATURES) whose mean over overlapping windows is the filter.

    A sample is estimated at index k of one window and at index k + STRIDE of the previous window; the mean of both is
    the filter's output. A tap that only one of the windows covers has twice its weight there. The taps that both
    windows cover compensate for this, so that the taps of each row have the filter's sum.
    """
    outputs = np.zeros((WINDOW, WINDOW, FEATURES))
    for k in range(STRIDE):
        ahead, behind = np.zeros_like(taps), np.zeros_like(taps)
        shared = slice(REACH - k, REACH - k + WINDOW - STRIDE)
        ahead[shared.stop :] = 2 * taps[shared.stop :]
        behind[: shared.start] = 2 * taps[: shared.start]
        missing = taps.sum(axis=0) - ahead.sum(axis=0) - taps[shared].sum(axis=0)
        ahead[shared] = taps[shared] + missing / (WINDOW - STRIDE)
        behind[shared] = taps[shared] - missing / (WINDOW - STRIDE)
        # The window begins k samples before this sample.
        place(outputs[k], ahead, k)
        place(outputs[k + STRIDE], behind, k + STRIDE)
    return on_grid(outputs)


def place(row: np.ndarray, taps: np.ndarray, k: int) -> None:
    """Writes the taps around sample k into a window's row (WINDOW, FEATURES)."""
    for tap in range(TAPS):
        if 0 <= k + tap - REACH < WINDOW:
            row[k + tap - REACH] = taps[tap]


def corrections(outputs: np.ndarray, drive: Drive) -> np.ndarray:
    """Returns the outputs (W, WINDOW) of the windows STRIDE apart."""
    return np.tensordot(windows(drive.features)[::STRIDE].astype(np.float64), outputs, axes=([1, 2], [1, 2]))


def ratio(corrected: np.ndarray, drive: Drive) -> float:
    """Returns the 1 s error with the mean of overlapping windows' corrections, over static initialisation's."""
    error = drive.gyro_error - overlap_mean(corrected, len(drive.gyro_error))
    return mean_1s_error(error) / mean_1s_error(drive.gyro_error)


def leave_one_out(drives: list[Drive], basis: np.ndarray, kept: int) -> dict:
    """Returns mean and standard deviation over drives of the ratio, with the filter of the other drives."""
    made = [sums(drive, basis) for drive in drives]
    ratios = []
    for k, drive in enumerate(drives):
        fitted = fit(made[:k] + made[k + 1 :], basis, kept)
        ratios.append([ratio(corrections(rows(taps), drive), drive) for taps in fitted])
    names = ("ratio", "ratio with the unit's part")
    return {n: [round(statistics.mean(v), 4), round(statistics.stdev(v), 4)] for n, v in zip(names, zip(*ratios))}


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train.linear", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of drives")
    parser.add_argument("--out", type=Path, required=True, help="folder for the .safetensors file")
    parser.add_argument("--stem", default="default", help="name of the file")
    parser.add_argument("--train", nargs="+", default=["02", "03", "04", "06", "07", "08"], metavar="NN")
    parser.add_argument("--parts", nargs="+", default=SHIPPED, choices=list(PARTS), help="parts of the filter")
    return parser.parse_args()


def main() -> None:
    args = arguments()
    drives = [load_drive(find_drive(args.data, n)) for n in args.train]
    # The filters of the parts, then those of the unit.
    basis = np.concatenate([PARTS[part] for part in dict.fromkeys([*args.parts, *UNIT])])
    kept = sum(len(PARTS[part]) for part in args.parts)
    found = leave_one_out(drives, basis, kept) if len(drives) > 2 else {}
    for name, (mean, deviation) in found.items():
        print(f"{name}: {mean:.3f}, standard deviation over drives {deviation:.3f}")
    part, _ = fit([sums(drive, basis) for drive in drives], basis, kept)
    features = np.concatenate([drive.features for drive in drives])
    tensors = {
        "input_mean": features.mean(axis=0),
        "input_std": features.std(axis=0),
        "linear.weight": rows(part).reshape(WINDOW, -1).astype(np.float32),
    }
    provenance = {
        "network": "gyronet",
        "parts": list(args.parts),
        "train": [drive.name for drive in drives],
        "sha256": {drive.name: drive.sha256 for drive in drives},
        "leave_one_out": found,
        "date": datetime.date.today().isoformat(),
    }
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / f"{args.stem}.safetensors"
    save_file(tensors, path, metadata={"provenance": json.dumps(provenance, sort_keys=True)})
    print(path)


if __name__ == "__main__":
    main()

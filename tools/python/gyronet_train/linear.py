"""python -m gyronet_train.linear DATA --out FOLDER: fit the linear part of a window model to a folder of drives.

The linear part is a filter of eleven taps around a sample. It removes from the yaw gyro the unit's mounting
(roll and pitch rate), its gain, and noise (differences of neighbouring gyro and accelerometer samples). A
difference of neighbours is zero for a constant input, so the accelerometer's level and a constant error do
not contribute (`PARTS`).

The fit minimises the absolute error of the yaw change over any second, the number that the tools print. For
the report, each drive is predicted by the filter of the other drives: mean and standard deviation of the
error over static initialisation's, as the parts are added. The written filter is fitted to all drives. Only
numpy and safetensors are needed.
"""

from __future__ import annotations

import argparse
import datetime
import json
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from .recordings import RATE_HZ, STATIC_SAMPLES, WINDOW, Drive, find_drive, load_drive, mean_1s_error, windows

STRIDE = 5
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


def fit(drives: list[tuple[np.ndarray, np.ndarray]], basis: np.ndarray) -> np.ndarray:
    """Returns the combination of the basis (TAPS, FEATURES) with the least absolute errors on some drives' sums."""
    inputs, errors = (np.concatenate(part) for part in zip(*drives))
    size = np.sqrt((inputs**2).mean(axis=0))
    inputs = inputs / size
    weight = np.ones(len(errors))
    for _ in range(ITERATIONS):
        weighted = inputs * weight[:, None] / weight.sum()
        normal = weighted.T @ inputs + RIDGE * np.eye(len(size))
        solution = np.linalg.solve(normal, weighted.T @ errors)
        weight = 1 / np.maximum(abs(errors - inputs @ solution), SMALLEST_ERROR)
    return np.tensordot(solution / size, basis, axes=1)


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


def rate_error(outputs: np.ndarray, drive: Drive) -> np.ndarray:
    """Returns the error (T,) of the rate that is corrected by the mean of overlapping windows."""
    total, count = np.zeros(len(drive.gyro_error)), np.zeros(len(drive.gyro_error))
    estimates = corrections(outputs, drive)
    for k in range(WINDOW):
        samples = np.arange(len(estimates)) * STRIDE + k
        total[samples] += estimates[:, k]
        count[samples] += 1
    return drive.gyro_error - total / np.maximum(count, 1)


def ratio(outputs: np.ndarray, drive: Drive) -> float:
    """Returns the 1 s error over static initialisation's."""
    return mean_1s_error(rate_error(outputs, drive)) / mean_1s_error(drive.gyro_error)


def leave_one_out(drives: list[Drive], basis: np.ndarray) -> list[float]:
    """Returns the ratio of each drive with the filter of the others."""
    made = [sums(drive, basis) for drive in drives]
    others = (made[:k] + made[k + 1 :] for k in range(len(drives)))
    return [ratio(rows(fit(rest, basis)), drive) for rest, drive in zip(others, drives)]


def window_error(outputs: np.ndarray, drives: list[Drive]) -> float:
    """Returns the mean |error| of a window's mean corrected rate, rad/s, after the static phase."""
    from_static = slice(STATIC_SAMPLES // STRIDE, None)
    errors = [
        (windows(d.gyro_error)[::STRIDE] - corrections(outputs, d)).mean(axis=1)[from_static] for d in drives
    ]
    return float(abs(np.concatenate(errors)).mean())


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train.linear", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of drives")
    parser.add_argument("--out", type=Path, required=True, help="folder for the .safetensors file")
    parser.add_argument("--stem", default="linear_window", help="name of the file")
    parser.add_argument("--train", nargs="+", default=["02", "03", "04", "06", "07", "08"], metavar="NN")
    return parser.parse_args()


def trained(paths: list[Path]) -> tuple[list[Drive], np.ndarray, float, dict]:
    """Fits the filter; returns drives, outputs of a window, expected error in rad/s and report."""
    drives = [load_drive(path) for path in paths]
    print("1 s error over static initialisation's, each drive with the filter of the others: mean, standard deviation")
    report = {}
    for count in range(1, len(PARTS) + 1):
        names = " + ".join(list(PARTS)[:count])
        basis = np.concatenate(list(PARTS.values())[:count])
        report[names] = tell(f"{names}, {len(basis)} numbers", leave_one_out(drives, basis))
    basis = np.concatenate(list(PARTS.values()))
    taps = fit([sums(drive, basis) for drive in drives], basis)
    outputs = rows(taps)
    roll, pitch, gain = taps.sum(axis=0)[[ROLL, PITCH, YAW]]
    print(f"mounting {roll:+.5f} of roll rate, {pitch:+.5f} of pitch rate; gain {gain:+.5f}")
    return drives, outputs, window_error(outputs, drives), report


def tell(what: str, ratios: list[float]) -> list[float]:
    """Prints the ratios of all drives; returns their mean and standard deviation."""
    found = [round(float(np.mean(ratios)), 4), round(float(np.std(ratios, ddof=1)), 4)]
    print(f"  {what}: {found[0]:.3f} {found[1]:.3f} ({' '.join(f'{ratio:.3f}' for ratio in ratios)})")
    return found


def main() -> None:
    args = arguments()
    drives, outputs, scale, report = trained([find_drive(args.data, n) for n in args.train])
    features = np.concatenate([drive.features for drive in drives])
    tensors = {
        "input_mean": features.mean(axis=0),
        "input_std": features.std(axis=0),
        "output_scale": np.array([scale]),
        "linear.weight": outputs.reshape(WINDOW, WINDOW * FEATURES),
    }
    provenance = {
        "network": "gyronet",
        "parts": "linear",
        "reference": "ref_gyr_z",
        "train": [drive.name for drive in drives],
        "sha256": {drive.name: drive.sha256 for drive in drives},
        "leave_one_out_to_static": report,
        "date": datetime.date.today().isoformat(),
    }
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / f"{args.stem}.safetensors"
    metadata = {"provenance": json.dumps(provenance, sort_keys=True)}
    save_file({name: np.ascontiguousarray(t, np.float32) for name, t in tensors.items()}, path, metadata)
    print(path)


if __name__ == "__main__":
    main()

"""Training the linear part on drives whose only reference is a course (`ref_yaw`), by turns over ten seconds.

A GNSS course is noisy from one second to the next, so the gyro's heading less the course is averaged by medians over
blocks of 10 s. The fit uses the change from one block to the next: for each span (S,) an error in rad, and for each
part (S, K) its contribution in rad. A constant is fitted for each drive.

Only the shares of roll, pitch and yaw rate are fitted: mounting and gain. The difference of two neighbouring samples
sums to almost nothing over ten seconds, so a course cannot show the low pass. A drive has about ten spans, but a
network needs a thousand windows, so no network is trained. The fit is ridge least squares with a prior sigma of PRIOR
for each share; a share that the drives do not show is zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .recordings import RATE_HZ, STATIC_SAMPLES, read_table

BLOCK = 10 * RATE_HZ
LEAST_KNOWN = 3  # fewest courses of a block for a median
LARGEST_SIGMA = 0.1  # rad: a course that is less certain (`ref_yaw_sigma`) is not used
JUMP = 0.2  # rad: a span that differs by more from its drive's typical one is left out
PLAUSIBLE = 0.5  # rad in 10 s: a course that differs more from the gyro has the wrong sign or is of another drive
LEAST_SPANS = 3
LEAST_TURN = np.pi / 2  # rad, all spans of a drive together
PRIOR = np.array([0.02, 0.02, 0.02])  # rad/rad: 1.1 deg of mounting, 2 % of gain
SHOWN = PRIOR / 2  # a share with a larger standard deviation is left at zero
ROUNDS = 10
INPUTS = ("t_s", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z")


@dataclass(frozen=True)
class CourseDrive:
    """The spans of one drive: turns about three axes (S, 3) and the error of static initialisation's turn (S,), rad."""

    name: str
    sha256: str
    features: np.ndarray
    turns: np.ndarray
    errors: np.ndarray
    left_out: int


def load_course_drive(path: Path, noise_deg: float | None = None) -> CourseDrive:
    """Reads one CSV. With `noise_deg` the course is simulated from `ref_gyr_z`. Raises ValueError with the file's name
    and the reason why its course cannot be used."""
    table, mounting, digest = read_table(path, INPUTS if noise_deg is None else (*INPUTS, "ref_gyr_z"))
    if noise_deg is None and "ref_yaw" not in table.dtype.names:
        raise ValueError(f"{path}: neither ref_gyr_z nor ref_yaw to train on")
    time = table["t_s"]
    if len(time) <= STATIC_SAMPLES or (abs(np.diff(time) - 1 / RATE_HZ) > 1e-3).any():
        raise ValueError(f"{path}: must be an unbroken 100 Hz recording of more than 3 s")
    force, gyro = (mounting.turn(np.stack([table[f"{kind}_{axis}"] for axis in "xyz"], axis=1)) for kind in ("acc", "gyr"))
    gyro = gyro - gyro[:STATIC_SAMPLES].mean(axis=0)
    if noise_deg is not None:
        random = np.random.default_rng(list(path.stem.encode()))
        course = simulate_course(table["ref_gyr_z"], np.radians(noise_deg), random)
    else:
        course = table["ref_yaw"].copy()
    if noise_deg is None and "ref_yaw_sigma" in table.dtype.names:
        course[table["ref_yaw_sigma"] > LARGEST_SIGMA] = np.nan
    turns, errors = spans(gyro[STATIC_SAMPLES:], course[STATIC_SAMPLES:])
    if len(errors) < LEAST_SPANS:
        raise ValueError(f"{path}: the course is known in {len(errors)} spans of 10 s, but {LEAST_SPANS} are needed")
    typical = np.median(errors)
    if np.median(abs(errors)) > PLAUSIBLE:
        off = f"ref_yaw disagrees with gyr_z by {np.median(abs(errors)):.2f} rad in 10 s"
        raise ValueError(f"{path}: {off}: wrong sign, another drive, or no rest in the first 3 s")
    kept = abs(errors - typical) <= JUMP
    if kept.mean() < 0.75:
        raise ValueError(f"{path}: the course jumps by more than {JUMP} rad in {(~kept).sum()} of {len(kept)} spans of 10 s")
    turned = abs(turns[kept, 2]).sum()
    if turned < LEAST_TURN:
        raise ValueError(f"{path}: turns by {np.degrees(turned):.0f} degrees, but {np.degrees(LEAST_TURN):.0f} are needed")
    features = np.concatenate([force, gyro], axis=1).astype(np.float32)
    return CourseDrive(path.stem, digest, features, turns[kept], errors[kept], int((~kept).sum()))


def simulate_course(rate: np.ndarray, noise: float, random: np.random.Generator) -> np.ndarray:
    """Simulates the course (T,) in rad of a 1 Hz receiver with this noise (rad), for a yaw rate (T,) in rad/s."""
    course = np.full(len(rate), np.nan)
    measured = np.cumsum(rate)[::RATE_HZ] / RATE_HZ
    course[::RATE_HZ] = measured + random.normal(0, noise, len(measured))
    return course


def spans(gyro: np.ndarray, course: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the turns (S, 3) and the yaw error (S,) between neighbouring blocks with a known course, in rad. `gyro`
    (T, 3) is in rad/s; `course` (T,) is in rad, NaN where unknown."""
    turned = np.cumsum(gyro, axis=0) / RATE_HZ
    known = np.flatnonzero(np.isfinite(course))
    off = np.unwrap(turned[known, 2] - course[known])
    blocks = []
    for begin in range(0, len(course), BLOCK):
        inside = slice(*np.searchsorted(known, [begin, begin + BLOCK]))
        enough = inside.stop - inside.start >= LEAST_KNOWN
        blocks.append([*turned[known[inside]].mean(axis=0), np.median(off[inside])] if enough else [np.nan] * 4)
    between = np.diff(np.array(blocks).reshape(-1, 4), axis=0)
    between = between[np.isfinite(between[:, 3])]
    return between[:, :3], between[:, 3]


def fit(drives: list[CourseDrive]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the shares of roll, pitch and yaw rate (3,) to subtract from the yaw rate, and their standard deviations.
    A share that the drives do not show is zero."""
    inputs = np.concatenate([drive.turns - drive.turns.mean(axis=0) for drive in drives])
    errors = np.concatenate([drive.errors - drive.errors.mean() for drive in drives])
    free = max(len(errors) - len(drives) - inputs.shape[1], 1)
    shares = np.zeros(inputs.shape[1])
    for _ in range(ROUNDS):
        variance = max(((errors - inputs @ shares) ** 2).sum() / free, 1e-18)
        covariance = np.linalg.inv(inputs.T @ inputs / variance + np.diag(PRIOR**-2))
        shares = covariance @ inputs.T @ errors / variance
    sigmas = np.sqrt(np.diag(covariance))
    return np.where(sigmas < SHOWN, shares, 0.0), sigmas


def ratio(shares: np.ndarray, drive: CourseDrive) -> float:
    """Returns the error of the turn in 10 s over static initialisation's; both contain the noise of the course."""
    return float(abs(drive.errors - drive.turns @ shares).mean() / abs(drive.errors).mean())


def leave_one_out(drives: list[CourseDrive]) -> list[float]:
    """Returns the ratio of each drive with the shares of the others."""
    return [ratio(fit(drives[:k] + drives[k + 1 :])[0], drive) for k, drive in enumerate(drives)]


def window_error(shares: np.ndarray, drives: list[CourseDrive]) -> float:
    """Returns an upper bound of the mean |error| of a window's mean rate, rad/s: the remaining error of a span, if the
    errors of its hundred windows of 0.1 s are independent. It contains the noise of the course, so the stated error is
    cautious."""
    return float(np.mean([abs(drive.errors - drive.turns @ shares).mean() for drive in drives]))

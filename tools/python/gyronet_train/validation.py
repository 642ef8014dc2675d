"""Errors of a network on a drive, run as in the firmware."""

from dataclasses import astuple, dataclass

import numpy as np
import torch

from .model import GyroNet
from .recordings import RATE_HZ, STATIC_SAMPLES, STRIDE, Drive, mean_1s_error, overlap_mean, windows


@dataclass(frozen=True)
class Validation:
    """Errors after the static phase, with overlapping windows STRIDE apart."""

    mean_1s_rad: float  # mean |yaw error| over consecutive 1 s windows: the number that the tools print
    any_1s_rad: float  # mean |yaw error| over all 1 s windows, one from each sample, which scatters less
    window_rad_per_sec: float  # mean |error| of the mean of a window's corrected rates


def validate_all(model: GyroNet, drives: list[Drive]) -> Validation:
    """Runs the network on some drives; returns the means of their errors, weighted by length."""
    errors = [astuple(validate(model, drive)) for drive in drives]
    return Validation(*np.average(errors, axis=0, weights=[len(d.gyro_error) for d in drives]).tolist())


@torch.no_grad()
def estimates(model: GyroNet, drive: Drive) -> np.ndarray:
    """Returns corrections (W, N) of the windows STRIDE apart."""
    x = torch.from_numpy(np.ascontiguousarray(windows(drive.features)[::STRIDE]))
    return torch.cat([model.eval()(part) for part in x.split(4096)]).numpy()


def validate(model: GyroNet, drive: Drive) -> Validation:
    """Runs the network on a drive; returns its errors."""
    output = estimates(model, drive)
    rate_error = drive.gyro_error - overlap_mean(output, len(drive.gyro_error))
    yaw_error = np.cumsum(np.append(0.0, rate_error[STATIC_SAMPLES:])) / RATE_HZ
    moving = slice(STATIC_SAMPLES // STRIDE, None)
    label = windows(drive.gyro_error)[::STRIDE].mean(axis=1)[moving]
    window_error = np.abs(output.mean(axis=1)[moving] - label)
    return Validation(
        mean_1s_rad=mean_1s_error(rate_error),
        any_1s_rad=float(np.abs(yaw_error[RATE_HZ:] - yaw_error[:-RATE_HZ]).mean()),
        window_rad_per_sec=float(window_error.mean()),
    )

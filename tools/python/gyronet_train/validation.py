"""Errors of a network on a drive, run as in the firmware."""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
import torch

from .model import GyroNet
from .recordings import RATE_HZ, STATIC_SAMPLES, STRIDE, Drive, mean_1s_error, overlap_mean, windows


@dataclass(frozen=True)
class Validation:
    """Errors after the static phase, with overlapping windows STRIDE apart."""

    mean_1s_rad: float
    """Mean |yaw error| over consecutive 1 s windows: the number that the tools print."""
    any_1s_rad: float
    """Mean |yaw error| over all 1 s windows, one from each sample, which scatters less."""
    window_rad_per_sec: float
    """Mean |error| of the mean of a window's corrected rates."""
    scale_ratio: float
    """The window error over the scale that the network gives, on average: 1 if the scale is calibrated."""
    log_loss: float
    """Mean Laplace log loss of the windows' errors, scale in rad/s."""


def validate_all(model: GyroNet, drives: list[Drive]) -> Validation:
    """Runs the network on some drives; returns the means of their errors, weighted by length."""
    errors = [astuple(validate(model, drive)) for drive in drives]
    return Validation(*np.average(errors, axis=0, weights=[len(d.gyro_error) for d in drives]).tolist())


@torch.no_grad()
def corrections(model: GyroNet, features: np.ndarray) -> tuple[torch.Tensor, torch.Tensor]:
    """Returns outputs (W, N) and scales (W,) of the windows STRIDE apart."""
    model.eval()
    return model(torch.from_numpy(np.ascontiguousarray(windows(features)[::STRIDE])))


def validate(model: GyroNet, drive: Drive) -> Validation:
    """Runs the network on a drive; returns its errors."""
    output, scale = corrections(model, drive.features)
    rate_error = drive.gyro_error - overlap_mean(output.numpy(), len(drive.gyro_error))
    yaw_error = np.cumsum(np.append(0.0, rate_error[STATIC_SAMPLES:])) / RATE_HZ
    moving = slice(STATIC_SAMPLES // STRIDE, None)
    label = windows(drive.gyro_error)[::STRIDE].mean(axis=1)[moving]
    window_error = np.abs(output.numpy().mean(axis=1)[moving] - label)
    scale = scale.numpy()[moving]
    return Validation(
        mean_1s_rad=mean_1s_error(rate_error),
        any_1s_rad=float(np.abs(yaw_error[RATE_HZ:] - yaw_error[:-RATE_HZ]).mean()),
        window_rad_per_sec=float(window_error.mean()),
        scale_ratio=float((window_error / scale).mean()),
        log_loss=float((window_error / scale + np.log(scale)).mean()),
    )

"""Fits only the output row of the scale; the other weights of the network stay unchanged.

The log of the scale is the mean over a window's steps of the last layer's second row, so it is linear
in the mean of the layer below. With the likelihood of loss.py the problem is convex, and a small ridge
makes the solution unique: it needs no seed and no epochs, and does not depend on the previous row.
"""

from __future__ import annotations

import numpy as np
import torch

from .model import GyroNet
from .recordings import STATIC_SAMPLES, Drive, windows

RIDGE = 1e-4
ITERATIONS = 200
BATCH = 4096


def fit_scale(model: GyroNet, drives: list[Drive]) -> None:
    """Replaces the scale's row by the best one on the drives, without their static phase."""
    inputs, errors = map(torch.cat, zip(*[statistics(model, drive) for drive in drives]))
    row = torch.zeros(inputs.shape[1], dtype=torch.float64, requires_grad=True)
    bias = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    optimiser = torch.optim.LBFGS([row, bias], max_iter=ITERATIONS, line_search_fn="strong_wolfe")

    def loss() -> torch.Tensor:
        optimiser.zero_grad()
        log_scale = inputs @ row + bias
        value = (errors * torch.exp(-log_scale) + log_scale).mean() + RIDGE * (row**2).sum()
        value.backward()
        return value

    optimiser.step(loss)
    with torch.no_grad():
        model.fc.weight[1] = row
        model.fc.bias[1] = bias[0]


@torch.no_grad()
def statistics(model: GyroNet, drive: Drive) -> tuple[torch.Tensor, torch.Tensor]:
    """Returns for each window the mean over its steps of the last layer's input (W, 120), and the |error| of its mean
    corrected rate in units of the output's scale (W,)."""
    model.eval()
    x = torch.from_numpy(np.ascontiguousarray(windows(drive.features)[STATIC_SAMPLES:]))
    label = torch.from_numpy(np.ascontiguousarray(windows(drive.gyro_error)[STATIC_SAMPLES:]))
    means, errors = [], []
    for part, truth in zip(x.split(BATCH), label.split(BATCH), strict=True):
        outputs = model.layers(part)
        means.append(outputs["layer2"].mean(1))
        errors.append((outputs["gyro_error"] - truth).mean(1).abs() / model.output_scale)
    return torch.cat(means).double(), torch.cat(errors).double()

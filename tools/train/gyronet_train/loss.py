"""The loss: gyro error by sample and as an angle, and how far off it is said to be."""

from __future__ import annotations

import math

import torch

from .spans import cut, overlapped

SCALE_WEIGHT = 0.1


def span_loss(
    correction: torch.Tensor, scale: torch.Tensor, gyro_error: torch.Tensor, unit: float
) -> torch.Tensor:
    """Loss of spans, in units of `unit` rad/s.

    `correction` (S, k, N) and `scale` (S, k) are the network's, `gyro_error` (S, L) is the label.
    Three absolute errors count: each window's, sample by sample; that of the overlap's mean; and
    that of its integral over the span, times the root of its samples so that it weighs as much
    where the errors are independent. The scale is trained by the likelihood of the windows' mean
    errors, which are not trained by it: a window may not get away with being unsure.
    """
    error = correction - cut(gyro_error)
    # The label of an overlapped sample is the same in both windows.
    overlap = overlapped(error)
    angle = overlap.mean(1).abs().mean() * math.sqrt(overlap.shape[1])
    absolute = error.abs().mean() + overlap.abs().mean() + angle
    mean_error = error.detach().mean(2).abs()
    likelihood = (mean_error / scale + torch.log(scale / unit)).mean()
    return absolute / unit + SCALE_WEIGHT * likelihood

"""The loss: gyro error by sample and as an angle, and how far off it is said to be."""

from __future__ import annotations

import math

import torch

from .spans import cut, overlapped

OVERLAP_WEIGHT = 0.3
ANGLE_WEIGHT = 0.1
SCALE_WEIGHT = 0.1


def span_loss(
    correction: torch.Tensor, scale: torch.Tensor, gyro_error: torch.Tensor, unit: float
) -> torch.Tensor:
    """Loss of spans, in units of `unit` rad/s.

    `correction` (S, k, N) and `scale` (S, k) are the network's, `gyro_error` (S, L) is the label.
    Absolute errors count: each window's, sample by sample; in spans of more than one window also
    that of the overlap's mean, and that of its integral over the span, times the root of its samples
    so that it is as large where the errors are independent. The integral weighs little: its label is mostly the drift of gyro
    and reference, which no window can tell, and with a weight of one the validation drive's 1 s
    error was larger. The scale is trained by the likelihood of the windows' mean
    errors, which are not trained by it: a window may not get away with being unsure.
    """
    error = correction - cut(gyro_error)
    absolute = error.abs().mean()
    if error.shape[1] > 1:
        # The label of an overlapped sample is the same in both windows.
        overlap = overlapped(error)
        angle = overlap.mean(1).abs().mean() * math.sqrt(overlap.shape[1])
        absolute = absolute + OVERLAP_WEIGHT * overlap.abs().mean() + ANGLE_WEIGHT * angle
    mean_error = error.detach().mean(2).abs()
    likelihood = (mean_error / scale + torch.log(scale / unit)).mean()
    return absolute / unit + SCALE_WEIGHT * likelihood

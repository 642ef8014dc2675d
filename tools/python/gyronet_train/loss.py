"""The loss: gyro error by sample and as an angle, and the likelihood of the stated scale."""

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
    """Returns the loss of spans, in units of `unit` rad/s.

    `correction` (S, k, N) and `scale` (S, k) are outputs of the network, `gyro_error` (S, L) is the label.
    The loss sums absolute errors: of each window, sample by sample, and in spans of more than one window
    also of the overlap's mean and of its integral over the span. The integral is multiplied by the root of
    the number of samples, so that it is as large as the others if errors are independent. It has a small
    weight: its label is mostly the drift of gyro and reference, which a window cannot show, and with a
    weight of one the 1 s error on the validation drive was larger. The scale is trained by the likelihood
    of the windows' mean errors. These errors are detached, so that a window cannot lower the loss by a
    large scale instead of a better correction.
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

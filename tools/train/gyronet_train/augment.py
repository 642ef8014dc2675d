"""Turns that the training drives did not make.

A network trained on what a few drives happened to contain takes an unusual turn for a gyro
error. So half of the windows get a yaw rate added, the same to gyro and reference: the label,
their difference, stays. The lateral acceleration that goes with it at some speed, and a bit of
braking or accelerating, are added too.
"""

from __future__ import annotations

import torch

SHARE = 0.5
YAW_RATE_STD = 0.3  # rad/s
SPEED_MAX = 15.0  # m/s
LATERAL_MAX = 4.0  # m/s^2: what a car on tyres does without sliding
LONGITUDINAL_STD = 0.7  # m/s^2
LONGITUDINAL, LATERAL, YAW_RATE = 0, 1, 5


def turn(x: torch.Tensor) -> torch.Tensor:
    """Windows (B, N, 6) with a turn added to some of them, constant over the 0.1 s."""
    chosen = (torch.rand(len(x)) < SHARE).float()
    yaw_rate = torch.randn(len(x)) * YAW_RATE_STD
    lateral = (yaw_rate * torch.rand(len(x)) * SPEED_MAX).clamp(-LATERAL_MAX, LATERAL_MAX)
    added = torch.zeros(len(x), 1, x.shape[2])
    added[:, 0, YAW_RATE] = chosen * yaw_rate
    added[:, 0, LATERAL] = chosen * lateral
    added[:, 0, LONGITUDINAL] = chosen * torch.randn(len(x)) * LONGITUDINAL_STD
    return x + added

"""Turns that the training drives lack, added to the inputs.

A network that is trained on a few drives mistakes an unusual turn for a gyro error. So a yaw rate is added to half of
the windows, the same to gyro and reference, which does not change their difference, the label. The matching lateral
acceleration at a random speed and a random longitudinal acceleration are also added.
"""

import torch

TURN_SHARE = 0.5
YAW_RATE_STD = 0.3  # rad/s
SPEED_MAX = 15.0  # m/s
LATERAL_MAX = 4.0  # m/s^2: largest value for a car without sliding
LONGITUDINAL_STD = 0.7  # m/s^2
LONGITUDINAL, LATERAL, YAW_RATE = 0, 1, 5


def turn(x: torch.Tensor) -> torch.Tensor:
    """Adds a turn that is constant over the window to some of the windows (B, WINDOW, 6)."""
    chosen = (torch.rand(len(x)) < TURN_SHARE).float()
    yaw_rate = torch.randn(len(x)) * YAW_RATE_STD
    lateral = (yaw_rate * torch.rand(len(x)) * SPEED_MAX).clamp(-LATERAL_MAX, LATERAL_MAX)
    added = torch.zeros(len(x), 1, x.shape[2])
    added[:, 0, YAW_RATE] = chosen * yaw_rate
    added[:, 0, LATERAL] = chosen * lateral
    added[:, 0, LONGITUDINAL] = chosen * torch.randn(len(x)) * LONGITUDINAL_STD
    return x + added

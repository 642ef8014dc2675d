"""Augmentation with motions and sensors that the training drives lack: turns, and other units of the part.

Both change the inputs of a span but not its label, so that the network learns what is not a gyro error.

Turns: a network that is trained on a few drives mistakes an unusual turn for a gyro error. So a yaw rate
is added to half of the spans, the same to gyro and reference, which does not change their difference, the
label. The matching lateral acceleration at a random speed and a random longitudinal acceleration are also
added.

Other units: the gyro has a gain error and a remaining bias after static initialisation, a slightly
different mounting, and noise of its own. A window of 0.1 s cannot show the effect on the yaw rate (1 % of
gain is 1 % of the yaw rate), but the learnt correction must not depend on it. The changes are small,
because the network also learns the mounting of the training car's sensor (its yaw axis measures 3 % of
the pitch rate) from rates that large changes would hide. A run with 0.5 deg/s and 2 deg had a 1 s error
on the validation drive that was a fifth larger, but it differed in other settings too, so the cause is
unknown.
"""

from __future__ import annotations

import torch

TURN_SHARE = 0.5
YAW_RATE_STD = 0.3  # rad/s
SPEED_MAX = 15.0  # m/s
LATERAL_MAX = 4.0  # m/s^2: largest value for a car without sliding
LONGITUDINAL_STD = 0.7  # m/s^2
LONGITUDINAL, LATERAL, YAW_RATE = 0, 1, 5

UNIT_SHARE = 0.5
BIAS_STD = 0.0005  # rad/s, each gyro axis: the drift in minutes
GAIN_STD = 0.01  # each gyro axis
MOUNTING_STD = 0.009  # rad, about each axis: 0.5 deg
NOISE_STD = 0.0005  # rad/s, each gyro sample


def turn(x: torch.Tensor) -> torch.Tensor:
    """Adds a turn that is constant over the span to some of the spans (S, L, 6)."""
    chosen = (torch.rand(len(x)) < TURN_SHARE).float()
    yaw_rate = torch.randn(len(x)) * YAW_RATE_STD
    lateral = (yaw_rate * torch.rand(len(x)) * SPEED_MAX).clamp(-LATERAL_MAX, LATERAL_MAX)
    added = torch.zeros(len(x), 1, x.shape[2])
    added[:, 0, YAW_RATE] = chosen * yaw_rate
    added[:, 0, LATERAL] = chosen * lateral
    added[:, 0, LONGITUDINAL] = chosen * torch.randn(len(x)) * LONGITUDINAL_STD
    return x + added


def other_unit(x: torch.Tensor) -> torch.Tensor:
    """Changes some of the spans (S, L, 6) to those of another unit of the part."""
    chosen = (torch.rand(len(x), 1, 1) < UNIT_SHARE).float()
    force, rate = x.split(3, dim=2)
    mounting = rotation(chosen[:, :, 0] * torch.randn(len(x), 3) * MOUNTING_STD).transpose(1, 2)
    rate = rate * (1 + chosen * torch.randn(len(x), 1, 3) * GAIN_STD) @ mounting
    rate = rate + chosen * (torch.randn(len(x), 1, 3) * BIAS_STD + torch.randn_like(rate) * NOISE_STD)
    return torch.cat([force @ mounting, rate], dim=2)


def rotation(vector: torch.Tensor) -> torch.Tensor:
    """Returns the rotation matrices (S, 3, 3) of rotation vectors (S, 3) in rad."""
    x, y, z = vector.unbind(1)
    zero = torch.zeros_like(x)
    skew = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=1).view(-1, 3, 3)
    return torch.matrix_exp(skew)

"""What the training drives did not hold: turns, and other units of the same part.

Both change the inputs of a span and leave its label, so that the network learns what is no gyro
error. A turn: a network trained on what a few drives happened to contain takes an unusual one for
a gyro error. So half of the spans get a yaw rate added, the same to gyro and reference: the label,
their difference, stays. The lateral acceleration that goes with it at some speed, and a bit of
braking or accelerating, are added too.

Another unit: its gyro is off by a gain and by what static initialisation leaves of its bias, it is
mounted a little turned, and it adds noise of its own. What that does to the yaw rate cannot be told
from a window of 0.1 s (1 % of gain is 1 % of the yaw rate, whatever the network sees), but the
correction learnt must not move by it. The changes are small, for part of what is learnt is how the
training car's sensor is mounted (its yaw axis sees 3 % of the pitch rate), and the rates that tell it
could be drowned. A run with 0.5 deg/s and 2 deg had a 1 s error on the validation drive that was a
fifth larger, but more than this was different in it: it does not say which change did that.
"""

from __future__ import annotations

import torch

TURN_SHARE = 0.5
YAW_RATE_STD = 0.3  # rad/s
SPEED_MAX = 15.0  # m/s
LATERAL_MAX = 4.0  # m/s^2: what a car on tyres does without sliding
LONGITUDINAL_STD = 0.7  # m/s^2
LONGITUDINAL, LATERAL, YAW_RATE = 0, 1, 5

UNIT_SHARE = 0.5
BIAS_STD = 0.0005  # rad/s, each gyro axis: what drifts in minutes
GAIN_STD = 0.01  # each gyro axis
MOUNTING_STD = 0.009  # rad, about each axis: 0.5 deg
NOISE_STD = 0.0005  # rad/s, each gyro sample


def turn(x: torch.Tensor) -> torch.Tensor:
    """Spans (S, L, 6) with a turn added to some of them, constant over the span."""
    chosen = (torch.rand(len(x)) < TURN_SHARE).float()
    yaw_rate = torch.randn(len(x)) * YAW_RATE_STD
    lateral = (yaw_rate * torch.rand(len(x)) * SPEED_MAX).clamp(-LATERAL_MAX, LATERAL_MAX)
    added = torch.zeros(len(x), 1, x.shape[2])
    added[:, 0, YAW_RATE] = chosen * yaw_rate
    added[:, 0, LATERAL] = chosen * lateral
    added[:, 0, LONGITUDINAL] = chosen * torch.randn(len(x)) * LONGITUDINAL_STD
    return x + added


def other_unit(x: torch.Tensor) -> torch.Tensor:
    """Spans (S, L, 6), some of them as another unit of the part would give them."""
    chosen = (torch.rand(len(x), 1, 1) < UNIT_SHARE).float()
    force, rate = x.split(3, dim=2)
    mounting = rotation(chosen[:, :, 0] * torch.randn(len(x), 3) * MOUNTING_STD).transpose(1, 2)
    rate = rate * (1 + chosen * torch.randn(len(x), 1, 3) * GAIN_STD) @ mounting
    rate = rate + chosen * (torch.randn(len(x), 1, 3) * BIAS_STD + torch.randn_like(rate) * NOISE_STD)
    return torch.cat([force @ mounting, rate], dim=2)


def rotation(vector: torch.Tensor) -> torch.Tensor:
    """Rotation matrices (S, 3, 3) of rotation vectors (S, 3) in rad."""
    x, y, z = vector.unbind(1)
    zero = torch.zeros_like(x)
    skew = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=1).view(-1, 3, 3)
    return torch.matrix_exp(skew)

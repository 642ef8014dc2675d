"""The loss of windows: the gyro error, sample by sample, and the likelihood of the stated scale."""

import torch

SCALE_WEIGHT = 0.1


def window_loss(error: torch.Tensor, scale: torch.Tensor, unit: float, correct: bool = True) -> torch.Tensor:
    """Returns the loss of windows by the errors (B, N) that remain and the stated scales (B), in units of `unit` rad/s.

    The scale is trained by the likelihood of the windows' mean errors. These are detached, so that a window cannot lower the
    loss by a large scale instead of a better correction. Without `correct` the scale alone is trained.
    """
    likelihood = (error.detach().mean(1).abs() / scale + torch.log(scale / unit)).mean()
    return SCALE_WEIGHT * likelihood + (error.abs().mean() / unit if correct else 0.0)

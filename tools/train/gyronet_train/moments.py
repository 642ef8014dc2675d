"""Means and standard deviations over drives, computed drive by drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from .recordings import Drive


@dataclass(frozen=True)
class Moments:
    """Sums over samples of the six features and the gyro error, and of their squares."""

    count: int
    total: list[float]
    squares: list[float]

    @classmethod
    def of(cls, drive: Drive) -> Moments:
        """Returns the sums of a drive."""
        values = np.concatenate([drive.features, drive.gyro_error[:, None]], axis=1).astype(float)
        return cls(len(values), values.sum(0).tolist(), (values**2).sum(0).tolist())

    @classmethod
    def added(cls, parts: list[Moments]) -> Moments:
        """Returns the sums of several drives together."""
        total, squares = (np.sum([getattr(p, name) for p in parts], axis=0).tolist() for name in ("total", "squares"))
        return cls(sum(p.count for p in parts), total, squares)

    def mean(self) -> torch.Tensor:
        """Returns the means of the features."""
        return torch.tensor(self.total[:-1]) / self.count

    def deviations(self) -> torch.Tensor:
        """Returns the standard deviations of the features, followed by that of the gyro error."""
        total, squares = np.array(self.total), np.array(self.squares)
        variance = (squares - total**2 / self.count) / (self.count - 1)
        return torch.from_numpy(np.sqrt(variance)).float()

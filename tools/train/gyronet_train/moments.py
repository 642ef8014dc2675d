"""Means and deviations of drives, added up drive by drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from .recordings import Drive


@dataclass(frozen=True)
class Moments:
    """Sums over samples: of the six features and the gyro error, and of their squares."""

    count: int
    total: list[float]
    squares: list[float]

    @classmethod
    def of(cls, drive: Drive) -> Moments:
        """Those of a drive."""
        values = np.concatenate([drive.features, drive.gyro_error[:, None]], axis=1).astype(float)
        return cls(len(values), values.sum(0).tolist(), (values**2).sum(0).tolist())

    @classmethod
    def added(cls, parts: list[Moments]) -> Moments:
        """Those of several drives."""
        total, squares = (np.sum([getattr(p, name) for p in parts], axis=0).tolist() for name in ("total", "squares"))
        return cls(sum(p.count for p in parts), total, squares)

    def mean(self) -> torch.Tensor:
        """Means of the features."""
        return torch.tensor(self.total[:-1]) / self.count

    def deviations(self) -> torch.Tensor:
        """Standard deviations of the features, and of the gyro error after them."""
        total, squares = np.array(self.total), np.array(self.squares)
        variance = (squares - total**2 / self.count) / (self.count - 1)
        return torch.from_numpy(np.sqrt(variance)).float()

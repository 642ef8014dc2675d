"""Spans of drives, each cut into windows STRIDE samples apart, as the firmware runs them.

A span of k windows has k - 1 stretches of STRIDE samples that two windows cover. The firmware uses the mean
of both windows there, so the loss is computed from it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch

from .recordings import WINDOW, Drive

STRIDE = 5


class Spans:
    """All spans of `windows` windows in some drives, one from each sample."""

    def __init__(self, drives: list[Drive], windows: int):
        self.names = {drive.name: drive.sha256 for drive in drives}
        self.windows = windows
        self.length = WINDOW + (windows - 1) * STRIDE
        features, gyro_error = (np.concatenate([getattr(d, name) for d in drives]) for name in ("features", "gyro_error"))
        self.mean = torch.from_numpy(features.mean(axis=0, dtype=float)).float()
        # Standard deviations of the features, followed by that of the gyro error.
        deviations = [values.std(axis=0, dtype=float, ddof=1) for values in (features, gyro_error)]
        self.deviations = torch.from_numpy(np.append(*deviations)).float()
        self.features, self.gyro_error = torch.from_numpy(features), torch.from_numpy(gyro_error)
        ends = np.cumsum([len(d.gyro_error) for d in drives])
        starts = [np.arange(end - len(d.gyro_error), end - self.length + 1) for d, end in zip(drives, ends)]
        self.starts = torch.from_numpy(np.concatenate(starts))

    def batches(self, windows: int) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        """Yields shuffled batches of about `windows` windows: features (S, L, 6), gyro error (S, L).

        One epoch has about as many windows as the drives have samples.
        """
        spans = windows // self.windows
        order = self.starts[torch.randperm(len(self.starts))]
        within = torch.arange(self.length)
        for chosen in order[: self.epoch(windows) * spans].view(-1, spans):
            rows = chosen[:, None] + within
            yield self.features[rows], self.gyro_error[rows]

    def epoch(self, windows: int) -> int:
        """Returns the number of batches of an epoch."""
        return len(self.starts) // (windows // self.windows * self.windows)


def cut(span: torch.Tensor) -> torch.Tensor:
    """Cuts spans into windows: (S, L, ...) -> (S, k, WINDOW, ...)."""
    return torch.stack(
        [span[:, at : at + WINDOW] for at in range(0, span.shape[1] - WINDOW + 1, STRIDE)], dim=1
    )


def overlapped(windows: torch.Tensor) -> torch.Tensor:
    """Averages both estimates of the samples that two windows cover: (S, k, WINDOW) -> (S, (k - 1) STRIDE)."""
    return ((windows[:, :-1, STRIDE:] + windows[:, 1:, :STRIDE]) / 2).flatten(1)

"""Training of one network with one seed.

As in the paper, training uses Adam with an initial rate of 0.0015 and mean absolute error over shuffled
windows of 0.1 s. Unlike in the paper, turns are added (augment.py), the rate follows one cycle, the
running mean of the weights is kept.

Random numbers are seeded in each epoch, from seed and epoch.
"""

import copy
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import torch
from tqdm import tqdm

from .augment import turn
from .model import GyroNet
from .recordings import WINDOW, Drive
from .validation import Validation, validate_all


@dataclass(frozen=True)
class Settings:
    """Settings of a training."""

    epochs: int  # passes, each with as many windows as the training drives have samples
    batch: int  # windows
    lr: float  # the largest learning rate
    turns: bool  # whether to add turns
    patience: int  # epochs without improvement after which training stops
    memory: float = 0.999  # decay of the running mean of the weights per batch


@dataclass(frozen=True)
class Epoch:
    """The result of an epoch."""

    epoch: int
    loss: float  # mean over the batches
    validation: Validation


@dataclass(frozen=True)
class Trained:
    """A trained network."""

    model: GyroNet
    validation: Validation
    epoch: int  # of these weights: the best on the validation drives
    seconds: float  # wall time
    epochs: list[Epoch]  # all that were run


class Windows:
    """All windows of some drives, one from each sample."""

    def __init__(self, drives: list[Drive]):
        self.names = {drive.name: drive.sha256 for drive in drives}
        features, gyro_error = (np.concatenate([getattr(d, name) for d in drives]) for name in ("features", "gyro_error"))
        self.mean = torch.from_numpy(features.mean(axis=0, dtype=float)).float()
        # Standard deviations of the features, followed by that of the gyro error.
        deviations = [values.std(axis=0, dtype=float, ddof=1) for values in (features, gyro_error)]
        self.deviations = torch.from_numpy(np.append(*deviations)).float()
        self.features, self.gyro_error = torch.from_numpy(features), torch.from_numpy(gyro_error)
        ends = np.cumsum([len(d.gyro_error) for d in drives])
        starts = [np.arange(end - len(d.gyro_error), end - WINDOW + 1) for d, end in zip(drives, ends)]
        self.starts = torch.from_numpy(np.concatenate(starts))

    def batches(self, size: int) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        """Yields the windows of an epoch in shuffled batches: features (B, WINDOW, 6), gyro error (B, WINDOW)."""
        order = self.starts[torch.randperm(len(self.starts))]
        for chosen in order[: self.epoch(size) * size].view(-1, size):
            rows = chosen[:, None] + torch.arange(WINDOW)
            yield self.features[rows], self.gyro_error[rows]

    def epoch(self, size: int) -> int:
        """Returns the number of batches of an epoch."""
        return len(self.starts) // size


def train(data: Windows, validation: list[Drive], settings: Settings, seed: int, on_epoch: Callable[[Epoch], None]) -> Trained:
    """Trains GyroNet; calls `on_epoch` after each epoch."""
    torch.manual_seed(seed)
    unit = data.deviations[-1].item()
    model = GyroNet(data.mean, data.deviations[:-1], unit)
    mean, best = copy.deepcopy(model), copy.deepcopy(model)
    optimiser = torch.optim.Adam(model.parameters(), lr=settings.lr)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, settings.lr, total_steps=data.epoch(settings.batch) * settings.epochs
    )
    epochs: list[Epoch] = []
    started = time.monotonic()
    while not finished(epochs, settings):
        epoch = len(epochs) + 1
        torch.manual_seed((seed << 32) + (epoch << 16))
        model.train()
        batches = tqdm(
            data.batches(settings.batch), f"epoch {epoch}/{settings.epochs}", data.epoch(settings.batch), disable=None
        )
        total = 0.0
        for x, gyro_error in batches:
            x = turn(x) if settings.turns else x
            loss = (model(x) - gyro_error).abs().mean() / unit
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
            total += loss.item()
            update_mean(mean, model, min(settings.memory, schedule.last_epoch / (schedule.last_epoch + 10)))
        epochs.append(Epoch(epoch, total / data.epoch(settings.batch), validate_all(mean, validation)))
        if best_of(epochs).epoch == epoch:
            best.load_state_dict(mean.state_dict())
        on_epoch(epochs[-1])
    chosen = best_of(epochs)
    return Trained(best, chosen.validation, chosen.epoch, time.monotonic() - started, epochs)


def best_of(epochs: list[Epoch]) -> Epoch:
    """Returns the epoch with the least error on the validation drives."""
    return min(epochs, key=lambda epoch: epoch.validation.any_1s_rad)


def finished(epochs: list[Epoch], settings: Settings) -> bool:
    """Returns whether all epochs are run, or the last `patience` epochs brought no improvement."""
    waited = len(epochs) - best_of(epochs).epoch if epochs else 0
    return len(epochs) >= settings.epochs or waited >= settings.patience


@torch.no_grad()
def update_mean(mean: GyroNet, model: GyroNet, memory: float) -> None:
    """Moves the running mean of the weights towards the weights."""
    for old, new in zip(mean.parameters(), model.parameters(), strict=True):
        old.lerp_(new, 1 - memory)

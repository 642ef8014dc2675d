"""Training of one network with one seed.

As in the paper, training uses Adam with an initial rate of 0.0015 and mean absolute error over shuffled
windows of 0.1 s. Unlike in the paper, turns are added (augment.py), the rate follows one cycle, the
running mean of the weights is kept, and a scale is trained (loss.py).

Random numbers are seeded in each epoch from seed and epoch, so that a resumed training gives the same result as one that
was not interrupted.
"""

from __future__ import annotations

import copy
import dataclasses
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from .augment import turn
from .loss import window_loss
from .model import GyroNet
from .recordings import WINDOW, Drive
from .validation import Validation, validate_all


@dataclass(frozen=True)
class Settings:
    """Settings of a training."""

    epochs: int
    """Number of passes, each with as many windows as the training drives have samples."""
    batch: int
    """Number of windows of a batch."""
    lr: float
    """Largest learning rate."""
    turns: bool
    """Whether to add turns."""
    patience: int
    """Epochs without improvement after which training stops."""
    memory: float = 0.999
    """Decay of the running mean of the weights per batch."""


@dataclass(frozen=True)
class Epoch:
    """The result of an epoch."""

    epoch: int
    loss: float
    """Mean loss over the batches."""
    validation: Validation


@dataclass(frozen=True)
class Trained:
    """A trained network."""

    model: GyroNet
    validation: Validation
    epoch: int
    """The epoch of these weights: the best on the validation drives."""
    seconds: float
    """Wall time, s."""
    epochs: list[Epoch]
    """All epochs that were run."""


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


def train(
    data: Windows,
    validation: list[Drive],
    settings: Settings,
    seed: int,
    on_epoch: Callable[[Epoch], None],
    state: Path | None = None,
) -> Trained:
    """Trains GyroNet; calls `on_epoch` after each epoch. Resumes from the file `state` if it exists, and updates it."""
    of = {"settings": dataclasses.asdict(settings), "seed": seed, "drives": data.names}
    of["validation drives"] = [drive.sha256 for drive in validation]
    torch.manual_seed(seed)
    unit = data.deviations[-1].item()
    model = GyroNet(data.mean, data.deviations[:-1], unit)
    mean, best = copy.deepcopy(model), copy.deepcopy(model)
    optimiser = torch.optim.Adam(model.parameters(), lr=settings.lr)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, settings.lr, total_steps=data.epoch(settings.batch) * settings.epochs
    )
    parts = {"model": model, "mean": mean, "best": best, "optimiser": optimiser, "schedule": schedule}
    epochs: list[Epoch] = []
    seconds = 0.0
    saved = load_state(state, of) if state else None
    if saved:
        for name, part in parts.items():
            part.load_state_dict(saved[name])
        epochs = [Epoch(e["epoch"], e["loss"], Validation(**e["validation"])) for e in saved["epochs"]]
        seconds = saved["seconds"]
    started = time.monotonic() - seconds
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
            correction, scale = model(x)
            loss = window_loss(correction - gyro_error, scale, unit)
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
        seconds = time.monotonic() - started
        if state:
            told = {"epochs": [dataclasses.asdict(e) for e in epochs], "seconds": seconds}
            save_state(state, of, {name: part.state_dict() for name, part in parts.items()} | told)
    chosen = best_of(epochs)
    calibrate(best, chosen.validation.scale_ratio)
    return Trained(best, validate_all(best, validation), chosen.epoch, seconds, epochs)


def save_state(path: Path, of: dict, state: dict) -> None:
    """Writes a state; `of` identifies the training. After a crash the old or the new file is complete."""
    written = path.with_suffix(".part")
    torch.save({"of": of, "state": state}, written)
    os.replace(written, path)


def load_state(path: Path, of: dict) -> dict | None:
    """Reads a state; returns None if there is no file. Raises ValueError for the state of another training."""
    if not path.exists():
        return None
    saved = torch.load(path, weights_only=True)
    other = [name for name in of if saved["of"].get(name) != of[name]]
    if other:
        raise ValueError(
            f"{path}: is of a training with other {', '.join(other)}; remove it to start again, or pass another --out"
        )
    return saved["state"]


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


@torch.no_grad()
def calibrate(model: GyroNet, ratio: float) -> None:
    """Multiplies the scale by a factor, by changing the bias of its log."""
    model.fc.bias[1] += math.log(ratio)

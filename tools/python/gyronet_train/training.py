"""Training of one network with one seed.

As in the paper, training uses Adam with an initial rate of 0.0015 and mean absolute error over shuffled
windows of 0.1 s. Unlike in the paper, turns are added (augment.py), the rate follows one cycle, the
running mean of the weights is kept, and a scale is trained (loss.py). Windows can be grouped in spans
that overlap as in the firmware; by default they are not, since it improved neither the 1 s error nor the
windows' mean error on the validation drive.

Random numbers are seeded in each epoch from seed and epoch, so that a resumed training gives the same result as one that
was not interrupted.
"""

from __future__ import annotations

import copy
import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from tqdm import tqdm

from .augment import turn
from .loss import span_loss
from .model import GyroNet
from .recordings import Drive
from .spans import Spans, cut
from .state import load_state, save_state
from .validation import Validation, validate_all


@dataclass(frozen=True)
class Settings:
    """Settings of a training."""

    epochs: int
    """Number of passes, each with as many windows as the training drives have samples."""
    batch: int
    """Approximate number of windows of a batch."""
    lr: float
    """Largest learning rate."""
    turns: bool
    """Whether to add turns."""
    windows: int
    """Windows of a span; with one window, the loss ignores the overlap."""
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


def train(
    data: Spans,
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
            correction, scale = model(cut(x).flatten(0, 1))
            shape = (len(x), settings.windows)
            loss = span_loss(correction.unflatten(0, shape), scale.view(shape), gyro_error, unit)
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

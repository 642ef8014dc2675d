"""Training of one network with one seed.

As in the paper: Adam with an initial rate of 0.0015 and mean absolute error over shuffled windows
of 0.1 s. Other than there, turns are added (augment.py), the rate follows one cycle, what is kept is
the running mean of the weights, and a scale is trained (loss.py). Windows can come in spans as the
firmware overlaps them, and as other units of the part would give them; the defaults do without, for
on the validation drive neither the 1 s error nor the windows' mean error was better with them.
"""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import torch
from tqdm import tqdm

from .augment import other_unit, turn
from .loss import span_loss
from .model import GyroNet
from .recordings import Drive
from .spans import Spans, cut
from .validation import Validation, validate_all


@dataclass(frozen=True)
class Settings:
    """How to train."""

    epochs: int
    """Passes; in each, as many windows as the training drives have samples."""
    batch: int
    """Windows of a batch, about."""
    lr: float
    """Largest learning rate."""
    turns: bool
    """Add turns."""
    units: bool
    """Add other units."""
    windows: int
    """Windows of a span; with one, the overlap has no part in the loss."""
    memory: float = 0.999
    """Of the running mean of the weights, a batch."""


@dataclass(frozen=True)
class Trained:
    """A trained network."""

    model: GyroNet
    validation: Validation
    epoch: int
    """The one whose mean weights these are: the best on the validation drives."""
    seconds: float
    """Wall time."""


def train(
    drives: list[Drive],
    validation: list[Drive],
    settings: Settings,
    seed: int,
    on_epoch: Callable[[int, Validation], None],
) -> Trained:
    """Trains GyroNet; `on_epoch` hears of each epoch. Reads no other drives."""
    started = time.monotonic()
    torch.manual_seed(seed)
    spans = Spans(drives, settings.windows)
    unit = spans.gyro_error.std().item()
    model = GyroNet(spans.features.mean(0), spans.features.std(0), unit)
    mean = copy.deepcopy(model)
    optimiser = torch.optim.Adam(model.parameters(), lr=settings.lr)
    steps = spans.epoch(settings.batch) * settings.epochs
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, settings.lr, total_steps=steps)
    best = None
    step = 0
    for epoch in range(1, settings.epochs + 1):
        model.train()
        batches = tqdm(
            spans.batches(settings.batch),
            f"epoch {epoch}/{settings.epochs}",
            spans.epoch(settings.batch),
            disable=None,
        )
        for x, gyro_error in batches:
            x = turn(x) if settings.turns else x
            x = other_unit(x) if settings.units else x
            correction, scale = model(cut(x).flatten(0, 1))
            shape = (len(x), settings.windows)
            loss = span_loss(correction.unflatten(0, shape), scale.view(shape), gyro_error, unit)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
            step += 1
            update_mean(mean, model, min(settings.memory, step / (step + 10)))
        errors = validate_all(mean, validation)
        on_epoch(epoch, errors)
        if best is None or errors.any_1s_rad < best.validation.any_1s_rad:
            best = Trained(copy.deepcopy(mean), errors, epoch, 0.0)
    calibrate(best.model, best.validation.scale_ratio)
    seconds = time.monotonic() - started
    return Trained(best.model, validate_all(best.model, validation), best.epoch, seconds)


@torch.no_grad()
def update_mean(mean: GyroNet, model: GyroNet, memory: float) -> None:
    """Moves the running mean of the weights towards the weights."""
    for old, new in zip(mean.parameters(), model.parameters(), strict=True):
        old.lerp_(new, 1 - memory)


@torch.no_grad()
def calibrate(model: GyroNet, ratio: float) -> None:
    """Multiplies the scale by a factor, in the bias of its log."""
    model.fc.bias[1] += math.log(ratio)

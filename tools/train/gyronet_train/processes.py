"""One process of several that train together (torchrun, PyTorch DDP over gloo); or the only one."""

from __future__ import annotations

import os
from typing import TypeVar

import torch
from torch import distributed, nn
from torch.nn.parallel import DistributedDataParallel

T = TypeVar("T")


def join() -> None:
    """Joins the others where torchrun has started this process."""
    if int(os.environ.get("WORLD_SIZE", "1")) > 1:
        distributed.init_process_group("gloo")


def leave() -> None:
    """Leaves the others, where there are any."""
    if distributed.is_initialized():
        distributed.destroy_process_group()


def part() -> tuple[int, int]:
    """This process's number, from 0, and how many there are."""
    return (distributed.get_rank(), distributed.get_world_size()) if distributed.is_initialized() else (0, 1)


def together(model: nn.Module) -> nn.Module:
    """The model with gradients that are the mean over all processes'."""
    return DistributedDataParallel(model) if distributed.is_initialized() else model


def mean(value: float) -> float:
    """The mean of a number over all processes."""
    total = torch.tensor(value, dtype=torch.float64)
    if distributed.is_initialized():
        distributed.all_reduce(total)
    return total.item() / part()[1]


def of_first(value: T) -> T:
    """The first process's value in all of them: what they decide by must be equal to the last bit."""
    values = [value]
    if distributed.is_initialized():
        distributed.broadcast_object_list(values)
    return values[0]

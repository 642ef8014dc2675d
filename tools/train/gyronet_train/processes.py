"""Training in several processes (torchrun, PyTorch DDP over gloo), or in one."""

from __future__ import annotations

import os
from typing import TypeVar

import torch
from torch import distributed, nn
from torch.nn.parallel import DistributedDataParallel

T = TypeVar("T")


def join() -> None:
    """Joins the process group if torchrun has started several processes."""
    if int(os.environ.get("WORLD_SIZE", "1")) > 1:
        distributed.init_process_group("gloo")


def leave() -> None:
    """Leaves the process group, if there is one."""
    if distributed.is_initialized():
        distributed.destroy_process_group()


def part() -> tuple[int, int]:
    """Returns the number of this process, from 0, and the number of processes."""
    return (distributed.get_rank(), distributed.get_world_size()) if distributed.is_initialized() else (0, 1)


def together(model: nn.Module) -> nn.Module:
    """Returns the model with gradients that are averaged over all processes."""
    return DistributedDataParallel(model) if distributed.is_initialized() else model


def mean(value: float) -> float:
    """Returns the mean of a number over all processes."""
    total = torch.tensor(value, dtype=torch.float64)
    if distributed.is_initialized():
        distributed.all_reduce(total)
    return total.item() / part()[1]


def of_first(value: T) -> T:
    """Returns the first process's value in all processes, since decisions need bit-identical values."""
    values = [value]
    if distributed.is_initialized():
        distributed.broadcast_object_list(values)
    return values[0]

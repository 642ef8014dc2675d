"""A file with the state of a training after each epoch, from which an interrupted training resumes."""

from __future__ import annotations

import os
from pathlib import Path

import torch


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

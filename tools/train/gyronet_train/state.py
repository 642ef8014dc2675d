"""The state of a training after each epoch, in a file: a training that was killed goes on from there."""

from __future__ import annotations

import os
from pathlib import Path

import torch


def save_state(path: Path, of: dict, state: dict) -> None:
    """Writes a state; `of` says of which training it is. A crash leaves the old file or the new one, whole."""
    written = path.with_suffix(".part")
    torch.save({"of": of, "state": state}, written)
    os.replace(written, path)


def load_state(path: Path, of: dict) -> dict | None:
    """Reads a state, None where there is none. Raises ValueError for another training's."""
    if not path.exists():
        return None
    saved = torch.load(path, weights_only=True)
    other = [name for name in of if saved["of"].get(name) != of[name]]
    if other:
        raise ValueError(
            f"{path}: is of a training with other {', '.join(other)}; remove it to begin anew, or give another --out"
        )
    return saved["state"]

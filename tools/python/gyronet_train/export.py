"""Writes checkpoint and golden tensors as safetensors, with the provenance in the metadata."""

import datetime
import json
from pathlib import Path

import torch
from safetensors.torch import save_file

from .fognet_model import FoGNet
from .model import GyroNet

GOLDEN_WINDOWS = 8


def export(model: GyroNet | FoGNet, provenance: dict, folder: Path, stem: str) -> None:
    """Writes STEM.safetensors and STEM.golden.safetensors, and prints their paths."""
    provenance = {**provenance, "torch": torch.__version__.split("+")[0], "date": datetime.date.today().isoformat()}
    folder.mkdir(parents=True, exist_ok=True)
    checkpoint = folder / f"{stem}.safetensors"
    tensors = {name: t.detach().contiguous() for name, t in model.state_dict().items()}
    # There is one metadata value only, since safetensors does not guarantee the order of several.
    save_file(tensors, checkpoint, metadata={"provenance": json.dumps(provenance, sort_keys=True)})
    golden = folder / f"{stem}.golden.safetensors"
    save_file(golden_tensors(model), golden, metadata={"made_by": f"torch {torch.__version__}"})
    print(checkpoint, golden, sep="\n")


@torch.no_grad()
def golden_tensors(model: GyroNet | FoGNet) -> dict[str, torch.Tensor]:
    """Returns test vectors: synthetic windows (noise about the means, two of them with large amplitudes, one of zeros)
    and the output of every layer. They contain no recording."""
    generator = torch.Generator().manual_seed(20)
    noise = torch.randn(GOLDEN_WINDOWS, model.steps, len(model.input_mean), generator=generator)
    gain = torch.tensor([1.0, 1.0, 1.0, 1.0, 1.0, 4.0, 8.0, 0.0]).view(-1, 1, 1)
    x = model.input_mean + gain * model.input_std * noise
    x[-1] = 0.0
    return {"input": x, **{k: v.contiguous() for k, v in model.layers(x).items()}}

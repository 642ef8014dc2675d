"""python -m gyronet_train.kingston CHECKPOINT DIR: evaluate FoGNet on the part of the Kingston 2008
recording that training has not read, against the uncorrected gyro and the gyro less Earth's rate.

Corrections are applied as in the firmware (src/fog.rs), from the second after next on. The linear part
of an increment is subtracted from that increment, the rest is spread over a minute.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file

from .fognet import ADAPT_SHARE
from .fognet_model import FoGNet
from .seconds import FOG, Seconds, load_kingston, window_rows

EARTH_RATE = 7.292115e-5  # rad/s
LATITUDE_DEG = 44.23
IN_USE_AFTER = 2  # s


@torch.no_grad()
def corrections(model: FoGNet, drive: Seconds, padding: str) -> np.ndarray:
    """Returns what is subtracted from each second's increment, rad."""
    gains = model.correction_scale * model.fc4.weight[0, 1] * model.fc3.weight[0] / model.input_std[FOG]
    gains = gains.numpy().astype(float)
    features = torch.from_numpy(drive.features).float()
    spread = np.zeros(len(drive.turn))
    in_use = np.zeros(len(drive.turn), dtype=bool)
    for end in range(1, len(drive.turn) - IN_USE_AFTER + 2):
        rows = window_rows(end, padding)
        used = end - 1 + IN_USE_AFTER
        if rows is None or used >= len(drive.turn):
            continue
        correction, _, _ = model(features[rows][None])
        linear = (gains * drive.features[rows, FOG]).sum()
        spread[used] = (correction.item() - linear) / len(rows)
        in_use[used] = True
    return spread + in_use * gains.mean() * drive.features[:, FOG]


def main() -> None:
    parser = argparse.ArgumentParser(prog="gyronet_train.kingston", description=__doc__)
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("data", type=Path)
    args = parser.parse_args()
    tensors = load_file(args.checkpoint)
    model = FoGNet(tensors["input_mean"], tensors["input_std"], tensors["correction_scale"].item())
    model.load_state_dict(tensors)
    model.eval()
    drive = load_kingston(args.data)
    drive = drive.part(int(ADAPT_SHARE * len(drive.turn)), len(drive.turn))
    error = drive.features[:, FOG] - drive.turn
    earth = np.full(len(error), EARTH_RATE * np.sin(np.deg2rad(LATITUDE_DEG)))
    print(f"{drive.name}: yaw error, rad: at the end, RMS; 60 s turn, mean")
    for name, correction in (
        ("gyro", np.zeros(len(error))),
        ("gyro less Earth rate", earth),
        ("FoGNet", corrections(model, drive, "repeat")),
        ("FoGNet, no padding", corrections(model, drive, "none")),
    ):
        left = error - correction
        yaw = np.cumsum(left)
        minutes = np.abs(np.convolve(left, np.ones(60), "valid"))
        print(f"{name:22} {yaw[-1]:9.5f} {np.sqrt(np.mean(yaw**2)):9.5f} {minutes.mean():9.5f}")


if __name__ == "__main__":
    main()

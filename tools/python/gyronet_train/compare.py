"""python -m gyronet_train.compare DATA --out STEM: compare CNN, RNN, LSTM and Bi-LSTM, as in Fig. 2.

Zhao et al. chose the Bi-LSTM among these by the test error after each epoch. They give neither the
size of the other networks nor the kind of error. Here all have two recurrent layers (the CNN four
convolutions of three samples) and as many parameters as GyroNet, 119,000. The error is the loss, the
mean absolute error by sample. The training is that of the paper: Adam at a fixed rate of 0.0015, mean
absolute error over shuffled windows without augmentation. The outcome chooses nothing.

Writes STEM.json and STEM.png.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
import torch
from torch import nn
from tqdm import tqdm

from .model import INPUTS, overlap_mean
from .recordings import Drive, find_drive, load_drive, mean_1s_error, windows
from .spans import STRIDE, Spans

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402 - the backend comes first


class Network(nn.Module):
    """A body from (B, N, 6) to (B, N, width), and a last layer that gives the gyro error in rad/s, (B, N)."""

    def __init__(self, body: nn.Module, width: int, spans: Spans):
        super().__init__()
        self.register_buffer("mean", spans.features.mean(0))
        self.register_buffer("std", spans.features.std(0))
        self.register_buffer("unit", spans.gyro_error.std())
        self.body = body
        self.fc = nn.Linear(width, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.fc(self.body((x - self.mean) / self.std)).squeeze(-1) * self.unit


class Recurrent(nn.Module):
    """Two recurrent layers that return only the hidden states."""

    def __init__(self, kind: type[nn.RNNBase], hidden: int, bidirectional: bool = False):
        super().__init__()
        self.layers = kind(INPUTS, hidden, num_layers=2, batch_first=True, bidirectional=bidirectional)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.layers(x)[0]


class Convolutional(nn.Module):
    """Four convolutions over time, each of three samples."""

    def __init__(self, channels: int):
        super().__init__()
        widths = [INPUTS] + 4 * [channels]
        convolutions = [nn.Conv1d(i, o, 3, padding=1) for i, o in zip(widths, widths[1:])]
        self.layers = nn.Sequential(*(layer for c in convolutions for layer in (c, nn.ReLU())))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return self.layers(x.transpose(1, 2)).transpose(1, 2)


NETWORKS: dict[str, Callable[[Spans], Network]] = {
    "CNN": lambda spans: Network(Convolutional(113), 113, spans),
    "RNN": lambda spans: Network(Recurrent(nn.RNN, 198), 198, spans),
    "LSTM": lambda spans: Network(Recurrent(nn.LSTM, 98), 98, spans),
    "Bi-LSTM": lambda spans: Network(Recurrent(nn.LSTM, 60, bidirectional=True), 120, spans),
}


@torch.no_grad()
def errors(network: Network, drives: list[Drive]) -> tuple[float, float]:
    """Returns means over drives: the mean absolute error by sample over all windows (rad/s), and the 1 s yaw error with
    windows that overlap as in the firmware (rad)."""
    network.eval()
    by_sample, in_1s = [], []
    for drive in drives:
        output = network(torch.from_numpy(np.ascontiguousarray(windows(drive.features)[::STRIDE])))
        by_sample.append(float(np.abs(output.numpy() - windows(drive.gyro_error)[::STRIDE]).mean()))
        in_1s.append(mean_1s_error(drive.gyro_error - overlap_mean(output, STRIDE, len(drive.gyro_error)).numpy()))
    return float(np.mean(by_sample)), float(np.mean(in_1s))


def run(name: str, spans: Spans, test: list[Drive], args: argparse.Namespace) -> dict:
    """Trains one network; returns its errors after each epoch."""
    torch.manual_seed(args.seed)
    network = NETWORKS[name](spans)
    optimiser = torch.optim.Adam(network.parameters(), lr=args.lr)
    history = []
    for _ in tqdm(range(args.epochs), name, disable=None):
        network.train()
        for x, gyro_error in spans.batches(args.batch):
            loss = (network(x) - gyro_error).abs().mean()
            optimiser.zero_grad()
            (loss / network.unit).backward()
            optimiser.step()
        history.append(errors(network, test))
    by_sample, in_1s = zip(*history)
    return {
        "parameters": sum(p.numel() for p in network.parameters()),
        "mean_abs_rad_per_sec": [round(error, 8) for error in by_sample],
        "mean_1s_rad": [round(error, 8) for error in in_1s],
    }


def plot(networks: dict[str, dict], path: Path) -> None:
    """Plots the mean absolute error by epoch."""
    figure, axes = pyplot.subplots(figsize=(7, 4), layout="constrained")
    for name, result in networks.items():
        error = 1e3 * np.array(result["mean_abs_rad_per_sec"])
        axes.plot(range(1, len(error) + 1), error, marker="o", label=f"{name}, {result['parameters']:,} parameters")
    axes.set(xlabel="epoch", ylabel="test error by sample, 1e-3 rad/s", ylim=(0, None))
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(prog="gyronet_train.compare", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of drives")
    parser.add_argument("--out", type=Path, required=True, help="path of the files to write, without .json and .png")
    parser.add_argument("--train", nargs="+", default=["02", "03", "04", "06", "07"], metavar="NN")
    parser.add_argument("--test", nargs="+", default=["09", "11"], metavar="NN")
    parser.add_argument("--epochs", type=int, default=8)
    parser.add_argument("--batch", type=int, default=512)
    parser.add_argument("--lr", type=float, default=0.0015)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=torch.get_num_threads(), help="CPU threads")
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    train = [load_drive(find_drive(args.data, n)) for n in args.train]
    test = [load_drive(find_drive(args.data, n)) for n in args.test]
    spans = Spans(train, 1)
    networks = {name: run(name, spans, test, args) for name in NETWORKS}
    for name, result in networks.items():
        last = result["mean_abs_rad_per_sec"][-1], result["mean_1s_rad"][-1]
        print(
            f"{name}: {result['parameters']} parameters; after epoch {args.epochs} "
            f"{last[0]:.6f} rad/s by sample, 1 s error {last[1]:.6f} rad"
        )
    report = {
        "train": [d.name for d in train],
        "test": [d.name for d in test],
        "test_static_mean_1s_rad": round(float(np.mean([mean_1s_error(d.gyro_error) for d in test])), 8),
        "epochs": args.epochs,
        "batch": args.batch,
        "lr": args.lr,
        "seed": args.seed,
        "networks": networks,
    }
    args.out.with_suffix(".json").write_text(json.dumps(report, indent=1) + "\n")
    plot(networks, args.out.with_suffix(".png"))


if __name__ == "__main__":
    main()

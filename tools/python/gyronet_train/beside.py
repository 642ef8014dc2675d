"""python -m gyronet_train.beside DATA --out FOLDER: train the shipped model, a linear part and a small Bi-LSTM.

The linear part is the filter of linear.py: differences of neighbouring samples, which add nothing for a constant input.
Mounting and gain of the training unit are fitted beside it and left out: they belong to the unit, and the board or
`gyronet calibrate` finds those of another. The board removes the slow mean of the network's corrections, so that no
vehicle gets a constant. A Bi-LSTM gives the expected error of each window, beside mounting and gain. The program also
measures what the Bi-LSTM could add to the correction, on each drive with the models of the others. This is not shipped
unless it gains more than its spread over drives.

Random levels and turns are added to the input (`disturb`), so that the Bi-LSTM does not learn from level and turn.
"""

import argparse
import statistics
import time
from pathlib import Path

import numpy as np
import torch

from .augment import turn
from .export import export
from .linear import PARTS, corrections, fit, ratio, rows, sums, window_error
from .loss import window_loss
from .model import GyroNet
from .recordings import STATIC_SAMPLES, STRIDE, WINDOW, Drive, find_drive, load_drive, windows
from .training import calibrate
from .validation import estimates

SHIPPED = ("low pass", "accelerometer")
UNIT = ("mounting", "gain")
TILT = 0.5  # m/s^2, 1 sigma: 3 degrees of mounting or street
BATCH = 512
LR = 0.004
# Factor on the trained scale. With it 0.85 of the straight seconds of the training drives are within one sigma as the
# board sends it (`gyronet evaluate`).
STATED = 0.8


def disturb(x: torch.Tensor) -> torch.Tensor:
    """Adds a random turn and level to each window; neither depends on the gyro's error."""
    tilted = turn(x).clone()
    tilted[..., :3] += TILT * torch.randn(len(x), 1, 3)
    return tilted


class Windows:
    """All windows of some drives after the static phase, and the gyro error that remains after the linear part."""

    def __init__(self, drives: list[Drive], outputs: np.ndarray):
        linear = torch.from_numpy(outputs.reshape(WINDOW, -1)).float()
        cut = lambda series: torch.from_numpy(np.ascontiguousarray(windows(series)[STATIC_SAMPLES:]))
        self.x = torch.cat([cut(drive.features) for drive in drives])
        self.left = torch.cat([cut(drive.gyro_error) for drive in drives]) - self.x.flatten(1) @ linear.T


def train(drives: list[Drive], outputs: np.ndarray, units: int, epochs: int, seed: int, correct: bool) -> GyroNet:
    """Trains a Bi-LSTM beside a linear part; with `correct` the Bi-LSTM also adds to the correction."""
    torch.manual_seed(seed)
    data = Windows(drives, outputs)
    features = np.concatenate([drive.features for drive in drives])
    mean, std = (torch.from_numpy(of) for of in (features.mean(axis=0), features.std(axis=0)))
    unit = window_error(outputs, drives)
    model = GyroNet(mean, std, unit, units, torch.from_numpy(outputs.reshape(WINDOW, -1)))
    with torch.no_grad():
        model.fc.weight.zero_()
        model.fc.bias.zero_()
    trained = [value for name, value in model.named_parameters() if not name.startswith("linear")]
    optimiser = torch.optim.Adam(trained, lr=LR)
    steps = epochs * (len(data.x) // BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, LR, total_steps=steps)
    for _ in range(epochs):
        for batch in torch.randperm(len(data.x)).split(BATCH)[: len(data.x) // BATCH]:
            x = data.x[batch]
            # The linear part runs on the undisturbed window; by construction neither turn nor level changes its output.
            correction, scale = model(disturb(x))
            by_network = correction - model.linear(x.flatten(1)) if correct else torch.zeros_like(correction)
            error = by_network - data.left[batch]
            loss = window_loss(error, scale, unit, correct)
            optimiser.zero_grad()
            loss.backward()
            if not correct:
                model.fc.weight.grad[0] = 0.0
                model.fc.bias.grad[0] = 0.0
            optimiser.step()
            schedule.step()
    return model.eval()


def log_loss(model: GyroNet | None, outputs: np.ndarray, drive: Drive, unit: float) -> float:
    """Returns the mean negative log likelihood of the windows' mean errors, in units of the training drives' mean
    error; without a model, with the same scale for all windows."""
    data = Windows([drive], outputs)
    error = data.left.mean(1).abs().numpy()[::STRIDE] / unit
    if model is None:
        return float(error.mean())
    scale = estimates(model, drive)[1][STATIC_SAMPLES // STRIDE :][: len(error)] / unit
    return float((error[: len(scale)] / scale + np.log(scale)).mean())


def report(drives: list[Drive], basis: np.ndarray, kept: int, sizes: list[int], epochs: int, seed: int) -> dict:
    """Returns mean and standard deviation over drives of each part's score, with the models of the other drives."""
    made = [sums(drive, basis) for drive in drives]
    rows_of: dict[str, list[float]] = {}
    add = lambda name, value: rows_of.setdefault(name, []).append(value)
    for k, drive in enumerate(drives):
        others = drives[:k] + drives[k + 1 :]
        part, outputs = map(rows, fit(made[:k] + made[k + 1 :], basis, kept))
        unit = window_error(outputs, others)
        add("linear: ratio", ratio(corrections(part, drive), drive))
        add("with the unit's part: ratio", ratio(corrections(outputs, drive), drive))
        add("one scale: log loss", log_loss(None, outputs, drive, unit))
        for units in sizes:
            model = train(others, outputs, units, epochs, seed, correct=False)
            add(f"{units} units: log loss", log_loss(model, outputs, drive, unit))
            model = train(others, outputs, units, epochs, seed, correct=True)
            add(f"{units} units, correcting: ratio", ratio(estimates(model, drive)[0], drive))
        print(f"{drive.name}: " + ", ".join(f"{name} {each[-1]:.3f}" for name, each in rows_of.items()), flush=True)
    return {name: [round(statistics.mean(v), 4), round(statistics.stdev(v), 4)] for name, v in rows_of.items()}


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train.beside", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of drives")
    parser.add_argument("--out", type=Path, required=True, help="folder for the .safetensors files")
    parser.add_argument("--stem", default="default", help="name of the files")
    parser.add_argument("--train", nargs="+", default=["02", "03", "04", "06", "07", "08"], metavar="NN")
    parser.add_argument("--units", type=int, default=4, help="units of the Bi-LSTM that is written, a multiple of 4")
    parser.add_argument("--parts", nargs="+", default=SHIPPED, choices=list(PARTS), help="parts of the linear part")
    parser.add_argument("--correct", action="store_true", help="the Bi-LSTM also adds to the correction")
    parser.add_argument("--report", type=int, nargs="*", default=[4, 8, 16], metavar="UNITS", help="sizes to compare")
    parser.add_argument("--epochs", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def main() -> None:
    args = arguments()
    started = time.monotonic()
    drives = [load_drive(find_drive(args.data, n)) for n in args.train]
    # The filters of the parts, then those of the unit.
    basis = np.concatenate([PARTS[part] for part in dict.fromkeys([*args.parts, *UNIT])])
    kept = sum(len(PARTS[part]) for part in args.parts)
    found = report(drives, basis, kept, args.report, args.epochs, args.seed) if args.report else {}
    for name, (mean, deviation) in found.items():
        print(f"{name}: {mean:.3f}, standard deviation over drives {deviation:.3f}")
    part, outputs = map(rows, fit([sums(drive, basis) for drive in drives], basis, kept))
    model = train(drives, outputs, args.units, args.epochs, args.seed, args.correct)
    calibrate(model, STATED)
    model.linear.weight.data = torch.from_numpy(part.reshape(WINDOW, -1)).float()
    provenance = {
        "network": "gyronet",
        "parts": "linear differences, expected error by a Bi-LSTM",
        "train": [drive.name for drive in drives],
        "sha256": {drive.name: drive.sha256 for drive in drives},
        "leave_one_out": found,
        "units": args.units,
        "epochs": args.epochs,
        "seed": args.seed,
    }
    export(model, provenance, args.out, args.stem)
    print(f"{time.monotonic() - started:.0f} s")


if __name__ == "__main__":
    main()

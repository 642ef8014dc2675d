"""python -m gyronet_train DATA --out FOLDER: train GyroNet on a folder of drives.

As in the paper: Adam with an initial rate of 0.0015, mean absolute error, windows of 0.1 s
taken every 0.01 s and shuffled. The rate follows one cycle; the epoch that does best on the
validation drive is kept. Test drives are never read here. Other than the paper, turns are added
to half of the windows (augment.py); --no-turns leaves them as they are.
"""

from __future__ import annotations

import argparse
import copy
import datetime
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from .augment import turn
from .export import export
from .model import GyroNet, overlap_mean
from .recordings import WINDOW, Drive, load_drive, mean_1s_error, windows

HOP = 5


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of trialNN_100hz.csv drives")
    parser.add_argument("--out", type=Path, required=True, help="folder for the .safetensors files")
    parser.add_argument("--stem", default="gyronet", help="name of the files")
    parser.add_argument("--train", nargs="+", default=["02", "03", "04", "06", "07"], metavar="NN")
    parser.add_argument("--validate", default="08", metavar="NN")
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--batch", type=int, default=512)
    parser.add_argument("--lr", type=float, default=0.0015)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--no-turns", dest="turns", action="store_false", help="as in the paper: add no turns")
    return parser.parse_args()


@torch.no_grad()
def validation_error(model: GyroNet, drive: Drive) -> float:
    """1 s yaw error (rad) with overlapping windows every HOP samples, as the firmware runs."""
    model.eval()
    x = torch.from_numpy(np.ascontiguousarray(windows(drive.features)[::HOP]))
    correction = overlap_mean(model(x), HOP, len(drive.gyro_error)).numpy()
    return mean_1s_error(drive.gyro_error - correction)


def main() -> None:
    args = arguments()
    torch.manual_seed(args.seed)
    drives = [load_drive(args.data / f"trial{n}_100hz.csv") for n in tqdm(args.train, "reading")]
    validate = load_drive(args.data / f"trial{args.validate}_100hz.csv")
    features = np.concatenate([d.features for d in drives])
    labels = np.concatenate([d.gyro_error for d in drives])
    model = GyroNet(
        torch.from_numpy(features.mean(axis=0)), torch.from_numpy(features.std(axis=0)), float(labels.std())
    )
    x = torch.from_numpy(np.concatenate([windows(d.features) for d in drives]))
    y = torch.from_numpy(np.concatenate([windows(d.gyro_error) for d in drives]))
    optimiser = torch.optim.Adam(model.parameters(), lr=args.lr)
    batches = len(x) // args.batch
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, args.lr, total_steps=batches * args.epochs)
    static = mean_1s_error(validate.gyro_error)
    best = (float("inf"), 0, None)
    for epoch in range(1, args.epochs + 1):
        model.train()
        order = torch.randperm(len(x))
        bar = tqdm(range(batches), f"epoch {epoch}/{args.epochs}")
        for b in bar:
            pick = order[b * args.batch : (b + 1) * args.batch]
            loss = (model(turn(x[pick]) if args.turns else x[pick]) - y[pick]).abs().mean()
            optimiser.zero_grad()
            (loss / model.output_scale.item()).backward()
            optimiser.step()
            schedule.step()
            bar.set_postfix(mae_rad_s=f"{loss.item():.5f}")
        error = validation_error(model, validate)
        print(f"epoch {epoch}: validation 1 s error {error:.6f} rad (static initialisation {static:.6f})")
        if error < best[0]:
            best = (error, epoch, copy.deepcopy(model.state_dict()))
    model.load_state_dict(best[2])
    model.eval()
    provenance = {
        "network": "gyronet",
        "train": [d.name for d in drives],
        "validate": validate.name,
        "sha256": {d.name: d.sha256 for d in [*drives, validate]},
        "validation_mean_1s_rad": round(best[0], 7),
        "validation_static_mean_1s_rad": round(static, 7),
        "epoch": best[1],
        "epochs": args.epochs,
        "batch": args.batch,
        "lr": args.lr,
        "seed": args.seed,
        "turns_added": args.turns,
        "torch": torch.__version__.split("+")[0],
        "date": datetime.date.today().isoformat(),
    }
    args.out.mkdir(parents=True, exist_ok=True)
    for path in export(model, provenance, args.out, args.stem):
        print(path)


if __name__ == "__main__":
    main()

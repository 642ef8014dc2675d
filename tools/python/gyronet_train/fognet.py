"""python -m gyronet_train.fognet --train DRIVE ... --validate DRIVE --out FOLDER: train FoGNet.

As in the paper, training uses windows of 60 s every second, Adam with an initial rate of 0.0015, and the
two losses of Eq. 14-16 with alpha 0.5. The paper gives no units. Here the first loss is in units of the
corrections' RMS, the second is the mean over the window in units of the gyro increments' RMS; in radians
and summed, it would be a thousand times the first. Some windows are padded (Fig. 8) and labelled with the
truth of the rows that they repeat. The learning rate follows one cycle, weights are averaged over the last
steps, and the best epoch on the validation drive is kept. If the gyro's bias is known, the constant part of
the correction is removed at the end. Test drives are never read.

Drives are files that `gyronet-paper import --training` wrote, with the Earth's rate and the bias subtracted
from the gyro; a file with gaps is used in pieces.
"""

import argparse
import copy
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from .export import export
from .fognet_loss import fognet_losses
from .fognet_model import FoGNet
from .seconds import FOG, STEPS, Seconds, load_grid, window_rows
from .training import update_mean

AVERAGE = 0.995  # decay of the weights' average per step
SETTINGS = ("epochs", "windows", "batch", "lr", "alpha", "padded", "seed")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train.fognet", description=__doc__)
    parser.add_argument("--train", type=Path, nargs="+", required=True, metavar="PATH")
    parser.add_argument("--validate", type=Path, nargs="+", metavar="PATH", help="validation drives")
    parser.add_argument("--rates", type=Path, metavar="FOLDER", help="rates of `gyronet replay --csv` (DRIVE.csv), not the FoG's")
    parser.add_argument("--gyro", choices=["DSP-1760", "DSP-3000", "pseudo-FoG"], help="gyro that the weights are for")
    parser.add_argument("--serial", type=int, default=0, help="serial number of the one gyro for the weights; 0: any")
    parser.add_argument("--simulated", action="store_true", help="mark the drives as simulated in the provenance")
    parser.add_argument("--out", type=Path, required=True, help="folder for the .safetensors files")
    parser.add_argument("--stem", default="fognet", help="name of the files")
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--windows", type=int, default=4800, help="windows per epoch")
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--lr", type=float, default=0.0015)
    parser.add_argument("--alpha", type=float, default=0.5)
    parser.add_argument("--padded", type=float, default=0.1, help="share of padded windows")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def load(args: argparse.Namespace) -> tuple[list[Seconds], list[Seconds]]:
    """Returns the training and the validation drives; pieces of a drive count as drives."""
    rates = lambda path: args.rates and args.rates / path.name
    pieces = lambda path: load_grid(path, rates(path))
    train = [piece for path in tqdm(args.train, "reading", disable=None) for piece in pieces(path)]
    return train, [piece for path in args.validate or [] for piece in pieces(path)]


class Windows:
    """All windows of some drives, as row numbers instead of copies."""

    def __init__(self, drives: list[Seconds], padding: str):
        self.features = torch.from_numpy(np.concatenate([d.features for d in drives])).float()
        error = np.concatenate([d.features[:, FOG] - d.turn for d in drives])
        self.error = torch.from_numpy(error).float()
        offsets = np.cumsum([0, *(len(d.turn) for d in drives)])
        full, padded = [], []
        for drive, offset in zip(drives, offsets):
            for end in range(1, len(drive.turn) + 1):
                rows = window_rows(end, padding)
                if rows is not None:
                    (full if end >= STEPS else padded).append(offset + rows)
        self.full = torch.from_numpy(np.array(full).reshape(-1, STEPS))
        self.padded = torch.from_numpy(np.array(padded).reshape(-1, STEPS))

    def take(self, rows: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns inputs (B, 60, 9) and correction labels (B)."""
        return self.features[rows], self.error[rows].sum(dim=1)


def normalisation(data: Windows) -> tuple[torch.Tensor, torch.Tensor, float]:
    """Returns mean and standard deviation of each feature, and the RMS of the corrections. The mean of the gyro
    increment is zero, so that FC3 stays linear in it."""
    mean, std = data.features.mean(dim=0), data.features.std(dim=0)
    mean[FOG] = 0.0
    std[FOG] = data.features[:, FOG].square().mean().sqrt()
    _, labels = data.take(data.full)
    return mean, std, labels.square().mean().sqrt().item()


def epoch_rows(data: Windows, count: int, padded: float) -> torch.Tensor:
    """Returns the rows of one epoch's windows in random order; some windows are padded."""
    extra = int(padded * count) if len(data.padded) else 0
    rows = data.full[torch.randperm(len(data.full))[: count - extra]]
    if extra:
        rows = torch.cat([rows, data.padded[torch.randint(len(data.padded), (extra,))]])
    return rows[torch.randperm(len(rows))]


@torch.no_grad()
def validation_error(model: FoGNet, data: Windows) -> float:
    """Returns the mean |predicted - true turn| over all full windows, rad: Eq. 14."""
    x, label = data.take(data.full)
    return (torch.cat([model(part)[0] for part in x.split(256)]) - label).abs().mean().item()


def main() -> None:
    args = arguments()
    torch.manual_seed(args.seed)
    train, validate = load(args)
    data, held_out = Windows(train, "repeat"), Windows(validate, "none")
    for what, windows in (("training", data), ("validation", held_out)):
        if len(windows.full) == 0:
            raise SystemExit(f"no {what} drive has a minute without a gap")
    model = FoGNet(*normalisation(data))
    optimiser = torch.optim.Adam(model.parameters(), lr=args.lr)
    batches = min(args.windows, len(data.full)) // args.batch
    if batches == 0:
        raise SystemExit(f"{len(data.full)} full windows to train on, fewer than a batch of {args.batch}")
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, args.lr, total_steps=batches * args.epochs)
    average = copy.deepcopy(model)
    scale = model.correction_scale.item()
    none = held_out.take(held_out.full)[1].abs().mean().item()
    before = validation_error(model, held_out)
    best = (before, 0, copy.deepcopy(model.state_dict()))
    print(f"{len(data.full)} windows, correction RMS {scale:.6f} rad")
    print(f"validation: uncorrected {none:.7f} rad, at the start {before:.7f} rad")
    step = 0
    for epoch in range(1, args.epochs + 1):
        model.train()
        losses = torch.zeros(2)
        rows_of_epoch = epoch_rows(data, batches * args.batch, args.padded)
        for rows in tqdm(rows_of_epoch.split(args.batch), f"epoch {epoch}/{args.epochs}", disable=None):
            x, label = data.take(rows)
            correction, f1, fog = model(x)
            loss1, loss2, loss = fognet_losses(correction, label, f1, fog, scale, args.alpha)
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
            optimiser.step()
            schedule.step()
            step += 1
            update_mean(average, model, min(AVERAGE, step / (step + 10)))
            losses += torch.tensor([loss1.item(), loss2.item()]) / batches
        error = validation_error(average, held_out)
        print(f"epoch {epoch}: losses {losses[0]:.4f} {losses[1]:.4f}, validation {error:.7f}", flush=True)
        if error < best[0]:
            best = (error, epoch, copy.deepcopy(average.state_dict()))
    model.load_state_dict(best[2])
    model.eval()
    constant = take_out_constant(model, data)
    print(f"a constant of {constant:+.7f} rad per minute is removed")
    provenance = {
        "network": "fognet",
        "train": list(dict.fromkeys(d.name for d in train)),
        "validate": ", ".join(dict.fromkeys(d.name for d in validate)),
        "gyro": args.gyro,
        "serial": args.serial,
        "simulated": args.simulated,
        "sha256": {d.name: d.sha256 for d in [*train, *validate]},
        "validation_mean_60s_rad": round(best[0], 8),
        "validation_uncorrected_mean_60s_rad": round(none, 8),
        "epoch": best[1],
        "constant_taken_out_rad": round(constant, 8),
        **{name: getattr(args, name) for name in SETTINGS},
    }
    export(model, provenance, args.out, args.stem)


@torch.no_grad()
def take_out_constant(model: FoGNet, data: Windows) -> float:
    """Removes the mean of the correction's part that is not linear in the gyro's increments; returns it, rad per
    minute. The bias was removed before, by standstills of each drive, so what remains is specific to these drives."""
    total = 0.0
    for rows in data.full.split(256):
        x, _ = data.take(rows)
        layers = model.layers(x)
        linear = layers["f3"] - model.fc3.bias
        total += (layers["correction"] - model.correction_scale * model.fc4.weight[0, 1] * linear).sum().item()
    mean = total / len(data.full)
    model.fc4.bias -= mean / model.correction_scale
    return mean


if __name__ == "__main__":
    main()

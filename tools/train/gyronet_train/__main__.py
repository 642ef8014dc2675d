"""python -m gyronet_train DATA --out FOLDER: train GyroNet on a folder of drives.

Trains once for each seed, prints what each is worth on the validation drives with mean and spread,
and keeps the best of them there. Test drives are never read here. training.py says how it is
trained and in what that departs from the paper. With --scale-of CHECKPOINT nothing is trained but
that network's scale of its expected error (scale.py).
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import statistics
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from .export import export, load_gyronet
from .model import GyroNet
from .recordings import Drive, load_pieces, mean_1s_error
from .scale import fit_scale
from .training import Settings, Trained, calibrate, train
from .validation import Validation, validate_all


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of the drives")
    parser.add_argument("--out", type=Path, required=True, help="folder for the .safetensors files")
    parser.add_argument("--stem", default="gyronet", help="name of the files")
    parser.add_argument("--train", nargs="+", default=["02", "03", "04", "06", "07"], metavar="DRIVE",
        help="NN for trialNN_100hz.csv, or a file's name; drives with gaps are used in pieces")
    parser.add_argument("--validate", nargs="+", default=["08"], metavar="DRIVE")
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--batch", type=int, default=512, help="windows of a batch")
    parser.add_argument("--lr", type=float, default=0.0015)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], metavar="N")
    parser.add_argument("--threads", type=int, default=torch.get_num_threads(), help="CPU threads")
    parser.add_argument("--no-turns", dest="turns", action="store_false", help="add no turns")
    parser.add_argument("--units", action="store_true", help="add other units of the part")
    parser.add_argument("--windows", type=int, default=1, help="windows of a span")
    parser.add_argument("--scale-of", type=Path, metavar="CHECKPOINT", help="fit only this network's scale")
    parser.add_argument("--note", help="a sentence for the provenance")
    return parser.parse_args()


def line(what: str, validation: Validation) -> str:
    """The errors of one network, for people."""
    return (
        f"{what}: 1 s error {validation.mean_1s_rad:.6f} rad, over any 1 s {validation.any_1s_rad:.6f}, "
        f"window mean {validation.window_rad_per_sec:.6f} rad/s at {validation.scale_ratio:.2f} of its scale, "
        f"log loss {validation.log_loss:.4f}"
    )


def main() -> None:
    args = arguments()
    torch.set_num_threads(args.threads)
    drives, validation = [
        [piece for name in tqdm(names, "reading", disable=None) for piece in load_pieces(drive_path(args.data, name))]
        for names in (args.train, args.validate)
    ]
    make = with_scale if args.scale_of else best_of_seeds
    model, provenance = make(args, drives, validation)
    if args.note:
        provenance["note"] = args.note
    args.out.mkdir(parents=True, exist_ok=True)
    for path in export(model, provenance, args.out, args.stem):
        print(path)


def drive_path(folder: Path, name: str) -> Path:
    """The file of a drive that is named by its number or by its file."""
    return folder / (name if name.endswith(".csv") else f"trial{name}_100hz.csv")


def best_of_seeds(
    args: argparse.Namespace, drives: list[Drive], validation: list[Drive]
) -> tuple[GyroNet, dict]:
    """Trains with each seed: the best network on the validation drives, and where it comes from."""
    weights = [len(drive.gyro_error) for drive in validation]
    static = float(np.average([mean_1s_error(drive.gyro_error) for drive in validation], weights=weights))
    print(f"static initialisation: 1 s error {static:.6f} rad")
    settings = Settings(args.epochs, args.batch, args.lr, args.turns, args.units, args.windows)
    networks: dict[int, Trained] = {}
    for seed in args.seeds:
        networks[seed] = train(
            drives,
            validation,
            settings,
            seed,
            lambda epoch, errors: tqdm.write(line(f"seed {seed} epoch {epoch}", errors)),
        )
        print(line(f"seed {seed}, {networks[seed].seconds:.0f} s", networks[seed].validation))
    errors = [network.validation.mean_1s_rad for network in networks.values()]
    spread = statistics.stdev(errors) if len(errors) > 1 else 0.0
    seconds = sum(network.seconds for network in networks.values())
    print(
        f"{len(errors)} seeds in {seconds:.0f} s: 1 s error {statistics.mean(errors):.6f} rad, "
        f"standard deviation {spread:.6f}"
    )
    seed = min(networks, key=lambda seed: networks[seed].validation.any_1s_rad)
    chosen = networks[seed]
    provenance = {
        "network": "gyronet",
        "train": names(drives),
        "validate": ", ".join(names(validation)),
        "sha256": {d.name: d.sha256 for d in [*drives, *validation]},
        "validation_mean_1s_rad": round(chosen.validation.mean_1s_rad, 7),
        "validation_static_mean_1s_rad": round(static, 7),
        "validation_mean_1s_rad_of_seeds": {s: round(e, 7) for s, e in zip(networks, errors)},
        "epoch": chosen.epoch,
        "seed": seed,
        "seconds": round(seconds),
        **dataclasses.asdict(settings),
        "torch": torch.__version__.split("+")[0],
        "date": datetime.date.today().isoformat(),
    }
    return chosen.model, provenance


def names(drives: list[Drive]) -> list[str]:
    """The names of drives, each once, however many pieces it has."""
    return list(dict.fromkeys(drive.name for drive in drives))


def with_scale(
    args: argparse.Namespace, drives: list[Drive], validation: list[Drive]
) -> tuple[GyroNet, dict]:
    """The checkpoint's network, its scale fitted again to the drives that it was trained on."""
    model, provenance = load_gyronet(args.scale_of)
    if provenance["sha256"] != {d.name: d.sha256 for d in [*drives, *validation]}:
        raise ValueError(f"{args.scale_of}: trained or validated on other drives than these")
    print(line("before", validate_all(model, validation)))
    fit_scale(model, drives)
    calibrate(model, validate_all(model, validation).scale_ratio)
    print(line("after", validate_all(model, validation)))
    provenance["scale"] = f"fitted alone on {datetime.date.today()}"
    return model, provenance


if __name__ == "__main__":
    main()

"""python -m gyronet_train DATA --out FOLDER: train GyroNet on a folder of drives.

Trains once for each seed, prints each seed's errors on the validation drives with mean and spread, and
keeps the best network. Test drives are never read. training.py describes the training and where it
differs from the paper.
"""

import argparse
import dataclasses
import statistics
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from .export import export
from .model import GyroNet
from .recordings import Drive, find_drive, load_pieces, mean_1s_error
from .training import Epoch, Settings, Trained, Windows, train
from .validation import Validation


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train", description=__doc__)
    parser.add_argument("data", type=Path, help="folder of drives (CSV)")
    parser.add_argument("--out", type=Path, required=True, help="folder for the .safetensors files")
    parser.add_argument("--stem", default="gyronet", help="name of the files")
    parser.add_argument("--train", nargs="+", default=["02", "03", "04", "06", "07"], metavar="NAME")
    parser.add_argument("--validate", nargs="+", default=["08"], metavar="NAME")
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--patience", type=int, default=6, help="stop after this many epochs without improvement")
    parser.add_argument("--batch", type=int, default=512, help="windows per batch")
    parser.add_argument("--lr", type=float, default=0.0015)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], metavar="N")
    parser.add_argument("--threads", type=int, default=torch.get_num_threads(), help="CPU threads")
    parser.add_argument("--no-turns", dest="turns", action="store_false", help="do not add turns")
    parser.add_argument("--note", help="a sentence for the provenance")
    return parser.parse_args()


def line(what: str, validation: Validation) -> str:
    """Returns a line of text with the errors of one network."""
    return (
        f"{what}: 1 s error {validation.mean_1s_rad:.6f} rad, over any 1 s {validation.any_1s_rad:.6f}, "
        f"window mean {validation.window_rad_per_sec:.6f} rad/s"
    )


def main() -> None:
    args = arguments()
    torch.set_num_threads(args.threads)
    try:
        run(args)
    except ValueError as error:
        raise SystemExit(str(error)) from error


def run(args: argparse.Namespace) -> None:
    """Trains and writes the files."""
    args.out.mkdir(parents=True, exist_ok=True)
    validation = pieces(args.data, args.validate)
    model, provenance = best_of_seeds(args, validation)
    if args.note:
        provenance["note"] = args.note
    export(model, provenance, args.out, args.stem)


def pieces(folder: Path, names: list[str]) -> list[Drive]:
    """Returns the drives of these names, each in pieces between its gaps."""
    return [piece for name in tqdm(names, "reading", disable=None) for piece in load_pieces(find_drive(folder, name))]


def best_of_seeds(args: argparse.Namespace, validation: list[Drive]) -> tuple[GyroNet, dict]:
    """Trains with each seed; returns the best network on the validation drives, and its provenance."""
    weights = [len(drive.gyro_error) for drive in validation]
    static = float(np.average([mean_1s_error(drive.gyro_error) for drive in validation], weights=weights))
    print(f"static initialisation: 1 s error {static:.6f} rad")
    settings = Settings(args.epochs, args.batch, args.lr, args.turns, args.patience)
    data = Windows(pieces(args.data, args.train))
    networks: dict[int, Trained] = {}
    for seed in args.seeds:

        def on_epoch(epoch: Epoch) -> None:
            print(line(f"seed {seed} epoch {epoch.epoch}, loss {epoch.loss:.4f}", epoch.validation), flush=True)

        networks[seed] = train(data, validation, settings, seed, on_epoch)
        print(line(f"seed {seed}, {networks[seed].seconds:.0f} s", networks[seed].validation))
    errors = [network.validation.mean_1s_rad for network in networks.values()]
    seconds = sum(network.seconds for network in networks.values())
    if len(errors) > 1:
        print(
            f"{len(errors)} seeds in {seconds:.0f} s: 1 s error {statistics.mean(errors):.6f} rad, "
            f"standard deviation {statistics.stdev(errors):.6f}"
        )
    seed = min(networks, key=lambda seed: networks[seed].validation.any_1s_rad)
    chosen = networks[seed]
    provenance = {
        "network": "gyronet",
        "train": list(data.names),
        "validate": ", ".join(dict.fromkeys(drive.name for drive in validation)),
        "sha256": {**data.names, **{d.name: d.sha256 for d in validation}},
        "validation_mean_1s_rad": round(chosen.validation.mean_1s_rad, 7),
        "validation_static_mean_1s_rad": round(static, 7),
        "validation_mean_1s_rad_of_seeds": {s: round(e, 7) for s, e in zip(networks, errors)},
        "epoch": chosen.epoch,
        "seed": seed,
        "seconds": round(seconds),
        **dataclasses.asdict(settings),
    }
    return chosen.model, provenance


if __name__ == "__main__":
    main()

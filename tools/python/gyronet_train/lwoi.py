"""python -m gyronet_train.lwoi --train DIR ... --test DIR ... --out FOLDER: the rival lwoi, from the paper's equations.

Brossard and Bonnabel, Learning wheel odometry and IMU errors for localization, 2019: a Gaussian process
predicts the error of each second of wheel and fibre-optic odometry. The program trains it on the training
sequences, in the layout of KAIST Urban. It writes the trajectories of the test sequences in TUM format to
FOLDER/odometry, FOLDER/constant and FOLDER/model (see lwoi_run.py), and all numbers to FOLDER/lwoi.json. A
test sequence that cannot be read is reported and left out.
"""

import argparse
import dataclasses
from pathlib import Path

import gpytorch
import numpy as np
import torch

from .lwoi_motion import odometry_errors
from .lwoi_process import Settings, Trained, train
from .lwoi_run import MODES, Expected, run
from .results import run_mode, test_all, write_report
from .sequence import Sequence, SequenceError, load_pieces


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train.lwoi", description=__doc__)
    parser.add_argument("--train", type=Path, nargs="+", required=True, metavar="DIR")
    parser.add_argument("--test", type=Path, nargs="+", required=True, metavar="DIR")
    parser.add_argument("--out", type=Path, required=True, help="folder for the trajectories")
    parser.add_argument("--steps", type=int, default=100, help="training steps, each on all windows")
    parser.add_argument("--rate", type=float, default=0.01, help="initial rate of Adam")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="train on every Nth window")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=torch.get_num_threads(), help="CPU threads")
    return parser.parse_args()


def fit(drives: list[Sequence], errors: np.ndarray, args: argparse.Namespace) -> Trained:
    """Trains the process."""
    windows = np.concatenate([drive.odometry for drive in drives])[:: args.every]
    settings = Settings(args.steps, args.rate, seed=args.seed)

    def report(step: int, loss: float) -> None:
        if step % max(1, args.steps // 5) == 0:
            print(f"step {step}/{args.steps}: loss {loss:.4f}", flush=True)

    trained = train(windows, errors[:: args.every], settings, report)
    print(f"{len(windows)} windows, seed {args.seed}, {trained.seconds:.0f} s", flush=True)
    return trained


def test(drive: Sequence, process: Trained, errors: np.ndarray, out: Path) -> dict:
    """Runs a drive in every mode with a process and the errors of its training, writes its trajectories and returns its numbers."""
    expected = Expected(errors.mean(axis=0), process.predict(drive.odometry))
    numbers: dict = {"sha256": drive.sha256}
    for mode in MODES:
        numbers[mode] = run_mode(drive, out / mode / f"{drive.name}.txt", lambda: run(drive, expected, mode))
    return numbers


def main() -> None:
    args = arguments()
    torch.set_num_threads(args.threads)
    try:
        drives = load_pieces(args.train)
    except SequenceError as error:
        raise SystemExit(str(error)) from error
    errors = np.concatenate([odometry_errors(drive) for drive in drives])
    process = fit(drives, errors, args)
    results = test_all(args.test, args.out, MODES, lambda drive: test(drive, process, errors, args.out))
    report = {
        "method": "lwoi",
        "train": {drive.name: drive.sha256 for drive in drives},
        "settings": dataclasses.asdict(process.settings),
        "every": args.every,
        "seconds": round(process.seconds, 1),
        "torch": torch.__version__.split("+")[0],
        "gpytorch": gpytorch.__version__,
    }
    write_report(args.out / "lwoi.json", report, results, MODES)


if __name__ == "__main__":
    main()

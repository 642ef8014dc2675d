"""python -m gyronet_train.rinsw --train DIR ... --test DIR ... --out FOLDER: the rival RINS-W, from its equations.

Brossard, Barrau and Bonnabel, RINS-W: Robust inertial navigation system on wheels, 2019: recurrent
networks detect from the inertial sensor when the car stands, goes straight, or does not slip, and an
invariant Kalman filter uses that as measurements. The program trains the detectors on the training
sequences, in the layout of KAIST Urban, or reads trained ones. It writes the trajectories of the test
sequences in TUM format to FOLDER/rinsw, those of the variants to FOLDER/stops, FOLDER/truth and
FOLDER/inertial (see rinsw_run.py), and all numbers to FOLDER/rinsw.json. A test sequence that cannot be
read, or on which the filter diverges, is reported and left out.
"""

import argparse
import dataclasses
import time
from pathlib import Path

import torch

from .results import run_mode, test_all, write_report
from .rinsw_detector import THRESHOLDS, DetectorError, Detectors, Settings, load_detectors, train
from .rinsw_filter import Noise
from .rinsw_profiles import PROFILES, Limits, agreement, label
from .rinsw_run import MODES, gates, run, samples_of
from .sequence import Sequence, SequenceError, load_pieces


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="gyronet_train.rinsw", description=__doc__)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--train", type=Path, nargs="+", metavar="DIR")
    source.add_argument("--detectors", type=Path, metavar="FILE", help="trained detectors, instead of --train")
    parser.add_argument("--test", type=Path, nargs="+", required=True, metavar="DIR")
    parser.add_argument("--out", type=Path, required=True, help="folder for trajectories and detectors")
    parser.add_argument("--modes", nargs="+", choices=MODES, default=MODES)
    parser.add_argument("--units", type=int, default=Settings.units, help="units of each LSTM layer")
    parser.add_argument("--steps", type=int, default=Settings.steps, help="training steps of each detector")
    parser.add_argument("--rate", type=float, default=Settings.rate, help="initial rate of Adam")
    parser.add_argument("--seed", type=int, default=Settings.seed)
    parser.add_argument("--threads", type=int, default=torch.get_num_threads(), help="CPU threads")
    return parser.parse_args()


def fit(args: argparse.Namespace) -> tuple[Detectors, dict]:
    """Trains the detectors and writes them; returns them and their entries for the report."""
    drives = load_pieces(args.train)
    settings = Settings(units=args.units, steps=args.steps, rate=args.rate, seed=args.seed)

    def report(profile: str, step: int, loss: float) -> None:
        if step % max(1, args.steps // 5) == 0:
            print(f"{profile} step {step}/{args.steps}: loss {loss:.5f}", flush=True)

    detectors, seconds = train([samples_of(d) for d in drives], [label(d) for d in drives], settings, report)
    detectors.save(args.out / "rinsw.safetensors")
    return detectors, {
        "train": {drive.name: drive.sha256 for drive in drives},
        "seconds": {profile: round(s, 1) for profile, s in seconds.items()},
    }


def test(drive: Sequence, detectors: Detectors, args: argparse.Namespace) -> dict:
    """Runs a drive in every mode, writes its trajectories and returns its numbers."""
    begin = time.monotonic()
    detected, true = detectors.detect(samples_of(drive)), label(drive)
    numbers: dict = {
        "sha256": drive.sha256,
        "detect_s": round(time.monotonic() - begin, 2),
        "detectors": agreement(detected, true),
    }
    print(f"{drive.name}: {numbers['detectors']}", flush=True)
    for mode in args.modes:
        path = args.out / mode / f"{drive.name}.txt"
        numbers[mode] = run_mode(drive, path, lambda: run(drive, gates(detected, true, mode)))
    return numbers


def main() -> None:
    args = arguments()
    torch.set_num_threads(args.threads)
    args.out.mkdir(parents=True, exist_ok=True)
    try:
        detectors, trained = fit(args) if args.train else (load_detectors(args.detectors), {})
    except (DetectorError, SequenceError) as error:
        raise SystemExit(str(error)) from error
    results = test_all(args.test, args.out, args.modes, lambda drive: test(drive, detectors, args))
    report = {
        "method": "RINS-W",
        **trained,
        "settings": dataclasses.asdict(detectors.settings),
        "thresholds": dict(zip(PROFILES, THRESHOLDS.tolist())),
        "limits": dataclasses.asdict(Limits()),
        "noise": dataclasses.asdict(Noise()),
        "torch": torch.__version__.split("+")[0],
    }
    write_report(args.out / "rinsw.json", report, results, args.modes)


if __name__ == "__main__":
    main()

"""python -m gyronet_train.lwoi --train DIR ... --test DIR ... --out FOLDER: the rival lwoi, from the paper's equations.

Brossard and Bonnabel, Learning wheel odometry and IMU errors for localization, 2019: Gaussian
processes predict the error of each second of wheel and fibre-optic odometry and of the inertial
sensor, and a Kalman filter uses both. The program trains both processes on the training sequences, in
the layout of KAIST Urban. It writes the trajectories of the test sequences in TUM format to
FOLDER/odometry, FOLDER/constant, FOLDER/model and FOLDER/filter (see lwoi_run.py), and all numbers to
FOLDER/lwoi.json. A test sequence that cannot be read, or on which the filter diverges, is reported and
left out.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime
import json
import time
from pathlib import Path

import gpytorch
import numpy as np
import torch

from .lwoi_motion import inertial_errors, odometry_errors
from .lwoi_process import Settings, Trained, inertial_features, odometry_features, train
from .lwoi_run import MODES, Expected, run
from .results import mean_numbers, run_mode, test_all
from .sequence import STEPS, Sequence, SequenceError, load_pieces
from .trajectory import Track, trajectory_error

JITTER = {"odometry": 1e-3, "inertial": 1e-4}


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


def fit(what: str, drives: list[Sequence], args: argparse.Namespace) -> Trained:
    """Trains the process for the errors of the odometry or of the inertial sensor."""
    errors_of, features = {
        "odometry": (odometry_errors, odometry_features),
        "inertial": (inertial_errors, inertial_features),
    }[what]
    windows = np.concatenate([getattr(drive, what) for drive in drives])[:: args.every]
    errors = np.concatenate([errors_of(drive) for drive in drives])[:: args.every]
    settings = Settings(args.steps, args.rate, JITTER[what], args.seed)

    def report(step: int, loss: float) -> None:
        if step % max(1, args.steps // 5) == 0:
            print(f"{what} step {step}/{args.steps}: loss {loss:.4f}", flush=True)

    trained = train(windows, errors, features, settings, report)
    print(f"{what}: {len(windows)} windows, seed {args.seed}, {trained.seconds:.0f} s", flush=True)
    return trained


def speed_variance(drives: list[Sequence]) -> float:
    """Returns the mean squared error of the wheels' speed at the edges, m^2/s^2."""
    off = [drive.edge_speed - np.linalg.norm(drive.edge_velocity, axis=1) for drive in drives]
    return float((np.concatenate(off) ** 2).mean())


def remaining(errors: np.ndarray, expected: np.ndarray) -> list[float]:
    """Returns the RMS of each component after the expected error is subtracted, over the RMS before: 1 is no gain."""
    return [round(float(x), 4) for x in np.sqrt(((errors - expected) ** 2).mean(0) / (errors**2).mean(0))]


@dataclasses.dataclass(frozen=True)
class Model:
    """The result of a training: the processes, the variance of the wheels' speed, and mean and mean square of the
    odometry's errors."""

    processes: dict[str, Trained]
    speed_variance: float
    constant: np.ndarray
    mean_square: np.ndarray

    def expect(self, drive: Sequence) -> Expected:
        """Predicts the errors of a drive."""
        errors = [process.predict(getattr(drive, what)) for what, process in self.processes.items()]
        return Expected(self.constant, self.mean_square, *errors, self.speed_variance)


def test(drive: Sequence, model: Model, out: Path) -> dict:
    """Runs a drive in every mode, writes its trajectories and returns its numbers."""
    begin = time.monotonic()
    expected = model.expect(drive)
    numbers: dict = {
        "sha256": drive.sha256,
        "remaining_odometry": remaining(odometry_errors(drive), expected.odometry.mean),
        "remaining_inertial": remaining(inertial_errors(drive), expected.inertial.mean),
        "predict_s": round(time.monotonic() - begin, 2),
    }
    for mode in MODES:

        def late(track: Track) -> dict:
            """Returns the error if each pose is used one second late."""
            error = trajectory_error(track.position[STEPS:], drive.position[:-STEPS], False)
            return {"ate_a_second_late_m": round(error, 3)}

        path = out / mode / f"{drive.name}.txt"
        numbers[mode] = run_mode(drive, path, lambda: run(drive, expected, mode), late)
    return numbers


def main() -> None:
    args = arguments()
    torch.set_num_threads(args.threads)
    try:
        drives = load_pieces(args.train)
    except SequenceError as error:
        raise SystemExit(str(error)) from error
    processes = {what: fit(what, drives, args) for what in JITTER}
    errors = np.concatenate([odometry_errors(drive) for drive in drives])
    model = Model(processes, speed_variance(drives), errors.mean(axis=0), (errors**2).mean(axis=0))
    results = test_all(args.test, args.out, MODES, lambda drive: test(drive, model, args.out))
    means = {mode: mean_numbers(results, mode) for mode in MODES}
    report = {
        "method": "lwoi",
        "train": {drive.name: drive.sha256 for drive in drives},
        "settings": {what: dataclasses.asdict(p.settings) for what, p in processes.items()},
        "every": args.every,
        "seconds": {what: round(p.seconds, 1) for what, p in processes.items()},
        "speed_std_m_per_s": round(model.speed_variance**0.5, 5),
        "tests": results,
        "means": means,
        "torch": torch.__version__.split("+")[0],
        "gpytorch": gpytorch.__version__,
        "date": datetime.date.today().isoformat(),
    }
    path = args.out / "lwoi.json"
    path.write_text(json.dumps(report, indent=2) + "\n")
    for mode in MODES:
        print(f"means of {mode}: {means[mode]}")
    print(path)


if __name__ == "__main__":
    main()

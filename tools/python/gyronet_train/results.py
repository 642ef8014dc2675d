"""Runs a rival on test sequences and collects its numbers.

A sequence that cannot be read, or a mode in which the filter diverges, is reported, counted and left out:
it has a reason instead of numbers, and no trajectory.
"""

import datetime
import json
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from .sequence import Sequence, SequenceError, load_sequence
from .trajectory import FilterError, Track, trajectory_error, write_tum


def test_all(folders: Iterable[Path], out: Path, modes: Iterable[str], test: Callable[[Sequence], dict]) -> dict[str, dict]:
    """Tests the sequence of each folder; returns the numbers by folder name. Removes trajectories of an earlier run."""
    results: dict[str, dict] = {}
    for folder in folders:
        if folder.name in results:
            raise SystemExit(f"{folder}: a second test sequence with the name {folder.name}")
        for mode in modes:
            (out / mode).mkdir(parents=True, exist_ok=True)
            (out / mode / f"{folder.name}.txt").unlink(missing_ok=True)
        try:
            drive = load_sequence(folder)
        except SequenceError as error:
            results[folder.name] = left_out(folder.name, error)
            continue
        results[folder.name] = test(drive)
    return results


def run_mode(drive: Sequence, path: Path, run: Callable[[], Track]) -> dict:
    """Runs a drive in one mode, writes its trajectory to `path` and returns its numbers."""
    begin = time.monotonic()
    name = f"{drive.name} {path.parent.name}"
    try:
        track = run()
    except FilterError as error:
        return left_out(name, error)
    seconds = time.monotonic() - begin
    numbers = {
        "ate_m": round(trajectory_error(track.position, drive.position, False), 3),
        "aligned_ate_m": round(trajectory_error(track.position, drive.position, True), 3),
        "refused": track.refused,
        "run_s": round(seconds, 2),
    }
    print(f"{name}: {numbers}", flush=True)
    write_tum(drive, track, path)
    return numbers


def left_out(name: str, error: ValueError) -> dict:
    """Prints and returns the reason why a sequence or a mode has no numbers."""
    print(f"{name}: left out, {error}", flush=True)
    return {"left_out": str(error)}


def mean_numbers(results: dict[str, dict], mode: str) -> dict:
    """Returns the means of a mode's numbers, and how many sequences have them and how many were left out."""
    rows = [numbers[mode] for numbers in results.values() if "left_out" not in numbers]
    rows = [row for row in rows if "left_out" not in row]
    means = {key: round(float(np.mean([row[key] for row in rows])), 3) for key in (rows[0] if rows else {})}
    return {"sequences": len(rows), "left_out": len(results) - len(rows), **means}


def write_report(path: Path, report: dict, results: dict[str, dict], modes: Iterable[str]) -> None:
    """Writes a report with the numbers of the tests, their means and the date; prints the means."""
    means = {mode: mean_numbers(results, mode) for mode in modes}
    report = {**report, "tests": results, "means": means, "date": datetime.date.today().isoformat()}
    path.write_text(json.dumps(report, indent=2) + "\n")
    for mode, numbers in means.items():
        print(f"means of {mode}: {numbers}")
    print(path)

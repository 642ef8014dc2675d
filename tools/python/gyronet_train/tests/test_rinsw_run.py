"""Drives by RINS-W, and its command."""

import contextlib
import io
import json
import unittest
from dataclasses import replace
from unittest.mock import patch

from .needs_torch import torch

import numpy as np
from scipy.spatial.transform import Rotation

from gyronet_train.rinsw import main
from gyronet_train.rinsw_detector import Detectors, Settings
from gyronet_train.rinsw_profiles import label
from gyronet_train.rinsw_run import gates, run

from .in_folder import InFolder
from .made_drive import START, make_drive, start_and_go, write_kaist


def go_and_stop():
    """Ten seconds of standing, a straight of 10 s, a bend of 10 s, and another stop of 10 s."""
    knots = [0, 10, 13, 27, 30, 40]
    time = np.arange(4000) / 100
    speed = np.interp(time, knots, [0, 0, 8, 8, 0, 0])
    return make_drive(speed, np.where((time > 18) & (time < 26), 0.1, 0.0))


class Runs(unittest.TestCase):
    def test_exact_sensors_and_true_profiles_stay_near_the_truth(self):
        drive = go_and_stop()
        true = label(drive)
        track = run(drive, true)
        self.assertLess(np.linalg.norm(track.position - drive.position, axis=1).max(), 1.0)
        self.assertLess((track.attitude * drive.attitude.inv()).magnitude().max(), 0.01)
        self.assertEqual(len(track.position), 4001)

    def test_a_stop_takes_back_most_of_what_a_lasting_force_error_does(self):
        drive = go_and_stop()
        drive.inertial[15:, :, 3] += 0.1
        errors = {}
        for mode in ("stops", "inertial"):
            true = label(drive)
            track = run(drive, gates(true, true, mode))
            errors[mode] = np.linalg.norm(track.position[-1] - drive.position[-1])
        self.assertGreater(errors["inertial"], 25.0)
        self.assertLess(errors["stops"], 0.5 * errors["inertial"])

    def test_place_and_heading_of_the_start_move_the_track_as_a_whole(self):
        drive = go_and_stop()
        turn, shift = Rotation.from_euler("z", 0.9), np.array([100.0, -50.0, 3.0])
        moved = replace(
            drive, attitude=turn * drive.attitude, position=turn.apply(drive.position - START) + START + shift
        )
        track, other = run(drive, label(drive)), run(moved, label(drive))
        expected = turn.apply(track.position - START) + START + shift
        np.testing.assert_allclose(other.position, expected, atol=1e-6)

    def test_modes_choose_the_profiles(self):
        detected = np.array([[True, False, False, True]])
        true = ~detected
        self.assertEqual(gates(detected, true, "stops").tolist(), [[True, True, True, True]])
        self.assertEqual(gates(~detected, true, "stops").tolist(), [[False, False, True, True]])
        self.assertIs(gates(detected, true, "rinsw"), detected)
        self.assertIs(gates(detected, true, "truth"), true)
        self.assertFalse(gates(detected, true, "inertial").any())


class Command(InFolder):
    def call(self, *words):
        with patch("sys.argv", ["rinsw", *map(str, words)]), contextlib.redirect_stdout(io.StringIO()):
            main()

    def test_a_missing_file_of_detectors_ends_it(self):
        with self.assertRaisesRegex(SystemExit, "nothing.safetensors: not a file of RINS-W detectors"):
            file = self.folder / "nothing.safetensors"
            self.call("--detectors", file, "--test", self.folder, "--out", self.folder / "out")

    def test_a_training_sequence_that_is_missing_ends_it(self):
        with self.assertRaisesRegex(SystemExit, "train01"):
            self.call("--train", self.folder / "train01", "--test", self.folder, "--out", self.folder / "out")

    def test_rows_that_have_no_number_say_why(self):
        torch.manual_seed(1)
        file, out = self.folder / "detectors.safetensors", self.folder / "out"
        Detectors(Settings(units=4)).save(file)
        broken = start_and_go()
        broken.inertial[5:, :, 3] += 50.0
        drives = {"good": start_and_go(), "broken": broken, "short": make_drive(np.zeros(200), np.zeros(200))}
        for name, drive in drives.items():
            write_kaist(drive, self.folder / name)
        tests = [self.folder / name for name in drives]
        self.call("--detectors", file, "--test", *tests, "--out", out, "--modes", "inertial", "truth", "--threads", 1)
        report = json.loads((out / "rinsw.json").read_text())
        self.assertEqual(report["settings"]["units"], 4)
        self.assertRegex(report["tests"]["short"]["left_out"], "short: its files have 2 s in common")
        self.assertRegex(report["tests"]["broken"]["inertial"]["left_out"], "diverged")
        self.assertLess(report["tests"]["good"]["truth"]["ate_m"], 1.0)
        self.assertEqual(report["means"]["inertial"]["sequences"], 1)
        self.assertEqual(report["means"]["inertial"]["left_out"], 2)
        self.assertEqual([path.name for path in (out / "inertial").iterdir()], ["good.txt"])

"""Errors of trajectories, the files that hold them, and what is left out of the results."""

import contextlib
import io
import unittest

import numpy as np
from scipy.spatial.transform import Rotation

from gyronet_train.results import mean_numbers, run_mode, test_all
from gyronet_train.trajectory import FilterError, Track, trajectory_error, write_tum

from .in_folder import InFolder
from .made_drive import SECONDS, START, make_drive, start_and_go, write_kaist


def true_track(drive):
    """The truth as a track."""
    return Track(drive.attitude, drive.position.copy(), 0)


class Errors(unittest.TestCase):
    def test_alignment_takes_off_a_turn_and_a_shift(self):
        drive = start_and_go()
        moved = Rotation.from_euler("z", 0.7).apply(drive.position - START) + START + [5.0, -3.0, 0.0]
        self.assertGreater(trajectory_error(moved, drive.position, False), 5.0)
        self.assertLess(trajectory_error(moved, drive.position, True), 1e-6)


class Files(InFolder):
    def test_trajectories_have_a_pose_each_step_in_the_frame_of_the_truth(self):
        drive, path = start_and_go(), self.folder / "made.txt"
        write_tum(drive, true_track(drive), path)
        lines = path.read_text().splitlines()
        self.assertEqual(len(lines), 100 * SECONDS + 1)
        self.assertEqual(lines[1].split()[0], "1524000000.020000")
        last = np.array(lines[-1].split()[1:], dtype=float)
        np.testing.assert_allclose(last[:3], drive.position[-1], atol=1e-5)
        self.assertAlmostEqual(np.linalg.norm(last[3:]), 1.0, places=6)


class LeftOut(InFolder):
    def test_bad_sequences_and_diverged_filters_are_counted_and_have_no_numbers(self):
        short = make_drive(np.zeros(200), np.zeros(200))
        for name, drive in (("good", start_and_go()), ("short", short), ("diverging", start_and_go())):
            write_kaist(drive, self.folder / name)
        old = self.folder / "out" / "mode" / "short.txt"
        old.parent.mkdir(parents=True)
        old.write_text("of an earlier run\n")

        def test(drive):
            def run():
                if drive.name == "diverging":
                    raise FilterError("second 3: it diverges")
                return true_track(drive)

            return {"mode": run_mode(drive, old.parent / f"{drive.name}.txt", run)}

        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            names = ("good", "short", "diverging", "missing")
            results = test_all([self.folder / name for name in names], self.folder / "out", ["mode"], test)
        self.assertRegex(results["short"]["left_out"], "short: its files have 2 s in common")
        self.assertRegex(results["missing"]["left_out"], "missing.*xsens_imu.csv")
        self.assertEqual(results["diverging"]["mode"], {"left_out": "second 3: it diverges"})
        self.assertIn("diverging mode: left out, second 3", said.getvalue())
        self.assertEqual([path.name for path in old.parent.iterdir()], ["good.txt"])
        means = mean_numbers(results, "mode")
        self.assertEqual((means["sequences"], means["left_out"], means["ate_m"]), (1, 3, 0.0))
        self.assertEqual(mean_numbers({"a": {"left_out": "why"}}, "mode"), {"sequences": 0, "left_out": 1})

    def test_two_sequences_of_one_name_are_refused(self):
        for folder in ("a", "b"):
            write_kaist(start_and_go(), self.folder / folder / "made")
        with self.assertRaisesRegex(SystemExit, "b/made: a second test sequence with the name made"):
            test_all([self.folder / "a" / "made", self.folder / "b" / "made"], self.folder, [], lambda drive: {})

"""Drives by lwoi."""

import unittest

import numpy as np

from gyronet_train.lwoi_run import Expected, run
from gyronet_train.sequence import STEPS
from gyronet_train.trajectory import trajectory_error

from .made_drive import SECONDS, SPEED, start_and_go


def expect(drive, ahead=0.0):
    """Expects an error ahead in every window, and nothing else."""
    return Expected(np.zeros(6), np.tile([ahead, 0, 0, 0, 0, 0], (len(drive), 1)))


class Runs(unittest.TestCase):
    def test_exact_odometry_is_the_truth_at_every_step(self):
        drive = start_and_go()
        for mode in ("odometry", "constant", "model"):
            track = run(drive, expect(drive), mode)
            np.testing.assert_allclose(track.position, drive.position, atol=1e-6)
            self.assertLess((track.attitude * drive.attitude.inv()).magnitude().max(), 1e-9)

    def test_an_expected_error_is_taken_off_by_the_model_alone(self):
        drive = start_and_go()
        drive.odometry[400 // STEPS :, :, :2] -= 0.001
        short = trajectory_error(run(drive, expect(drive, 0.1), "odometry").position, drive.position, False)
        track = run(drive, expect(drive, 0.1), "model").position
        way = np.linalg.norm(np.diff(track[400:], axis=0), axis=1).sum()
        self.assertAlmostEqual(way, SPEED * (SECONDS - 4), delta=0.01)
        self.assertGreater(short, 0.3)

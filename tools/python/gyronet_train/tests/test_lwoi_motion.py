"""A second's motion by odometry, and its errors."""

import unittest

import numpy as np

from gyronet_train.lwoi_motion import corrected, odometry_errors, odometry_motion

from .made_drive import START, START_YAW, expected_end, make_drive

SECONDS = 20


class Odometry(unittest.TestCase):
    def test_a_straight_line_is_as_long_as_its_speed_says(self):
        drive = make_drive(np.full(100 * SECONDS, 10.0), np.zeros(100 * SECONDS))
        attitude, position = expected_end(drive)
        ahead = 10.0 * SECONDS * np.array([np.cos(START_YAW), np.sin(START_YAW), 0.0])
        np.testing.assert_allclose(position - START, ahead, atol=1e-6)
        self.assertAlmostEqual(attitude.as_euler("ZYX")[0], START_YAW, places=12)

    def test_a_constant_turn_is_a_circle_but_for_the_length_of_a_step(self):
        rate = 2 * np.pi / SECONDS
        drive = make_drive(np.full(100 * SECONDS, 10.0), np.full(100 * SECONDS, rate))
        half = make_drive(np.full(50 * SECONDS, 10.0), np.full(50 * SECONDS, rate))
        np.testing.assert_allclose(expected_end(drive)[1], START, atol=1e-6)
        # Half a circle is its diameter; chords are shorter than arcs by 1 - (turn of a step)^2 / 24.
        across = np.linalg.norm(expected_end(half)[1] - START)
        self.assertAlmostEqual(across, 20.0 / rate, delta=1e-4)

    def test_windows_one_after_the_other_are_the_drive(self):
        time = np.arange(100 * SECONDS) / 100
        drive = make_drive(8 + 3 * np.sin(time), 0.3 * np.cos(time / 2))
        np.testing.assert_allclose(expected_end(drive)[1], drive.position[-1], atol=1e-8)

    def test_the_true_error_leads_to_the_true_pose(self):
        time = np.arange(100 * SECONDS) / 100
        drive = make_drive(8 + 3 * np.sin(time), 0.3 * np.cos(time / 2))
        drive.odometry[:] *= 1.01
        drive.odometry[:, :, 2] += 1e-3
        rotation, way = corrected(*odometry_motion(drive.odometry), odometry_errors(drive))
        edges = drive.attitude[drive.edges]
        moved = edges[:-1].apply(way)
        np.testing.assert_allclose(moved, np.diff(drive.position[drive.edges], axis=0), atol=1e-8)
        self.assertLess((edges[:-1] * rotation * edges[1:].inv()).magnitude().max(), 1e-12)

    def test_wheels_that_are_too_large_are_an_error_ahead(self):
        drive = make_drive(np.full(100 * SECONDS, 10.0), np.zeros(100 * SECONDS))
        drive.odometry[:, :, :2] *= 0.99
        np.testing.assert_allclose(odometry_errors(drive), np.tile([0.1, 0, 0, 0, 0, 0], (SECONDS, 1)), atol=1e-8)

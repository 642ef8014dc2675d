"""Drives by lwoi, the trajectories that it writes, and the sequences that it refuses."""

import tempfile
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from gyronet_train.lwoi_process import Errors
from gyronet_train.lwoi_run import Expected, consistency, run, trajectory_error, write_tum
from gyronet_train.lwoi_sequence import STEPS, SequenceError, load_sequence

from .lwoi_drive import START, make_drive

SECONDS, SPEED = 12, 7.0
COUNTS_PER_M = 4096 / (np.pi * 0.623)


def start_and_go():
    """Four seconds of standing, then a bend at constant speed."""
    going = np.arange(100 * SECONDS) >= 400
    return make_drive(SPEED * going, 0.1 * going)


def expect(drive, ahead=0.0):
    """Expects an error ahead in every window, and little else."""
    count = len(drive)
    mean = np.tile([ahead, 0, 0, 0, 0, 0], (count, 1))
    odometry = Errors(mean, np.full((count, 6), 1e-6))
    inertial = Errors(np.zeros((count, 9)), np.full((count, 9), 0.1))
    return Expected(np.zeros(6), np.full(6, 1e-6), odometry, inertial, 1e-4)


def write_kaist(drive, folder):
    """Writes a drive in the layout of KAIST Urban."""
    (folder / "sensor_data").mkdir(parents=True)
    (folder / "calibration").mkdir()
    stamps = drive.start_ns + 10_000_000 * np.arange(len(drive) * STEPS + 1)
    odometry, inertial = drive.odometry.reshape(-1, 3), drive.inertial.reshape(-1, 6)
    counts = np.round(np.concatenate([np.zeros((1, 2)), np.cumsum(odometry[:, :2], axis=0)]) * COUNTS_PER_M)
    matrices = drive.attitude.as_matrix()

    def write(name, rows):
        lines = (",".join([str(stamp), *(f"{x:.9f}" for x in row)]) for stamp, row in zip(stamps, rows))
        (folder / name).write_text("\n".join(lines) + "\n")

    imu = np.zeros((len(stamps), 16))
    imu[1:, 7:13], imu[0, 7:13] = inertial, inertial[0]
    write("sensor_data/xsens_imu.csv", imu)
    write("sensor_data/encoder.csv", counts)
    write("sensor_data/fog.csv", np.pad(odometry[:, 2:], ((1, 0), (2, 0))))
    write("global_pose.csv", np.concatenate([matrices, drive.position[..., None]], axis=2).reshape(-1, 12))
    diameters = "Encoder left wheel diameter: 0.623\nEncoder right wheel diameter: 0.623\n"
    (folder / "calibration" / "EncoderParameter.txt").write_text(f"Encoder resolution: 4096\n{diameters}")


class Runs(unittest.TestCase):
    def test_exact_odometry_is_the_truth_at_every_step(self):
        drive = start_and_go()
        for mode in ("odometry", "constant", "model"):
            track = run(drive, expect(drive), mode)
            np.testing.assert_allclose(track.position, drive.position, atol=1e-6)
            self.assertLess((track.attitude * drive.attitude.inv()).magnitude().max(), 1e-9)

    def test_the_filter_stays_at_the_truth_of_exact_sensors(self):
        drive = start_and_go()
        track = run(drive, expect(drive), "filter")
        self.assertLess(trajectory_error(track.position, drive.position, False), 0.05)
        self.assertEqual(track.refused, 0)

    def test_a_lasting_gyro_bias_moves_the_heading_little(self):
        time = np.arange(20_000)
        drive = make_drive(np.where(time < 400, 0.0, SPEED), np.where(time < 400, 0.0, 0.05))
        drive.inertial[:, :, 2] += 3e-4
        expected = expect(drive)
        sure = Errors(expected.inertial.mean, np.full((len(drive), 9), 1e-7))
        track = run(drive, replace(expected, inertial=sure), "filter")
        # By the gyro alone it would be 0.06 rad.
        self.assertLess((track.attitude[-1] * drive.attitude[-1].inv()).magnitude(), 0.003)

    def test_a_pose_that_is_a_second_late_is_wrong_by_a_seconds_way(self):
        drive = start_and_go()
        track = run(drive, expect(drive), "model")
        late = np.linalg.norm(track.position[STEPS:] - drive.position[:-STEPS], axis=1)
        self.assertAlmostEqual(late[-1], SPEED, delta=0.01)
        self.assertEqual(late[0], 0.0)

    def test_an_expected_error_is_taken_off_by_the_model_alone(self):
        drive = start_and_go()
        drive.odometry[400 // STEPS :, :, :2] -= 0.001
        short = trajectory_error(run(drive, expect(drive, 0.1), "odometry").position, drive.position, False)
        track = run(drive, expect(drive, 0.1), "model").position
        way = np.linalg.norm(np.diff(track[400:], axis=0), axis=1).sum()
        self.assertAlmostEqual(way, SPEED * (SECONDS - 4), delta=0.01)
        self.assertGreater(short, 0.3)


class Numbers(unittest.TestCase):
    def test_alignment_takes_off_a_turn_and_a_shift(self):
        drive = start_and_go()
        moved = Rotation.from_euler("z", 0.7).apply(drive.position - START) + START + [5.0, -3.0, 0.0]
        self.assertGreater(trajectory_error(moved, drive.position, False), 5.0)
        self.assertLess(trajectory_error(moved, drive.position, True), 1e-6)

    def test_an_error_of_one_sigma_counts_one(self):
        drive = start_and_go()
        track = run(drive, expect(drive), "model")
        sigma = np.sqrt(track.covariance[:, 3, 3])
        across = np.linalg.inv(track.covariance[1:, 2:5, 2:5])[:, 1, 1] * sigma[1:] ** 2
        drive.position[:: STEPS, 0] += sigma
        self.assertAlmostEqual(consistency(drive, track), across.mean() / 3, places=6)


class Files(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name) / "made"
        self.drive = start_and_go()
        write_kaist(self.drive, self.folder)

    def test_a_folder_is_read_as_it_was_written(self):
        read = load_sequence(self.folder)
        self.assertEqual((read.name, len(read)), ("made", SECONDS))
        self.assertAlmostEqual(read.start_ns, self.drive.start_ns, delta=256)
        np.testing.assert_allclose(read.position, self.drive.position, atol=1e-6)
        np.testing.assert_allclose(read.odometry[:, :, 2], self.drive.odometry[:, :, 2], atol=1e-7)
        np.testing.assert_allclose(read.odometry[:, :, :2].sum(1), self.drive.odometry[:, :, :2].sum(1), atol=1e-3)
        np.testing.assert_allclose(read.edge_speed[[2, 6, -1]], [0.0, SPEED, SPEED], atol=0.01)
        np.testing.assert_allclose(np.linalg.norm(read.edge_velocity[[2, 6, -1]], axis=1), [0, SPEED, SPEED], atol=1e-3)

    def test_trajectories_have_a_pose_each_step_in_the_frame_of_the_truth(self):
        track = run(self.drive, expect(self.drive), "odometry")
        path = self.folder / "made.txt"
        write_tum(self.drive, track, path)
        lines = path.read_text().splitlines()
        self.assertEqual(len(lines), 100 * SECONDS + 1)
        self.assertEqual(lines[1].split()[0], "1524000000.020000")
        last = np.array(lines[-1].split()[1:], dtype=float)
        np.testing.assert_allclose(last[:3], self.drive.position[-1], atol=1e-5)
        self.assertAlmostEqual(np.linalg.norm(last[3:]), 1.0, places=6)

    def test_a_missing_file_is_named(self):
        (self.folder / "sensor_data" / "fog.csv").unlink()
        with self.assertRaisesRegex(SequenceError, "made.*fog.csv"):
            load_sequence(self.folder)

    def test_a_drive_that_does_not_stand_at_first_is_named(self):
        moving = make_drive(np.full(800, 5.0), np.zeros(800))
        write_kaist(moving, self.folder.parent / "moving")
        with self.assertRaisesRegex(SequenceError, "moving: it moves in its first 3 s"):
            load_sequence(self.folder.parent / "moving")

    def test_a_drive_of_a_moment_is_named(self):
        short = make_drive(np.zeros(200), np.zeros(200))
        write_kaist(short, self.folder.parent / "short")
        with self.assertRaisesRegex(SequenceError, "short: its files have 2 s in common"):
            load_sequence(self.folder.parent / "short")

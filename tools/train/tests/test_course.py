"""Training on drives that have a course (`ref_yaw`) and no yaw rate of reference."""

import tempfile
import unittest
from pathlib import Path

import numpy as np

from gyronet_train import course
from gyronet_train.course import CourseDrive, fit, load_course_drive, ratio, spans

SHARES = [0.0, 0.03, -0.015]  # of the pitch and the yaw rate, in the sensor's yaw rate
HEADER = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_yaw"
STILL = 300


class Courses(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name) / "monday.csv"

    def write(self, seed=0, seconds=600, noise=0.0, turn=0.3, change=lambda yaw: yaw):
        """A drive with turns, hills and a bias that static initialisation does not see; course at 1 Hz, with a gap."""
        random = np.random.default_rng(seed)
        count = 100 * seconds
        time = np.arange(count) / 100
        moving = np.arange(count) >= STILL
        truth = turn * np.sin(time / 7) * moving
        pitch = 0.05 * np.cos(time / 11 + seed) * moving
        gyro = np.stack([0 * time, pitch, truth + 1e-4 * moving], axis=1)
        gyro[:, 2] += SHARES[1] * pitch + SHARES[2] * truth
        gyro += random.normal(0, 0.001, gyro.shape) + [0, 0, 0.01]
        yaw = change(np.cumsum(truth) / 100 + random.normal(0, noise, count))
        rows = np.column_stack([time, random.normal(0, 0.1, (count, 3)) + [0, 0, 9.8], gyro])
        known = (np.arange(count) % 100 == 0) & ~((time > 100) & (time < 145))
        wrapped = np.angle(np.exp(1j * yaw))
        lines = [",".join([*(f"{x:.7f}" for x in row), f"{w:.7f}" if k else ""]) for row, w, k in zip(rows, wrapped, known)]
        self.path.write_text("\n".join([HEADER, *lines]) + "\n")
        return self.path

    def refused(self, reason, **drive):
        with self.assertRaisesRegex(ValueError, f"monday.csv: .*{reason}"):
            load_course_drive(self.write(**drive))

    def test_mounting_and_gain_are_found_within_their_sigma(self):
        drives = [load_course_drive(self.write(seed, noise=0.02)) for seed in range(3)]
        # 59 whole blocks and a part, fewer those of the gap and what lies across it.
        self.assertEqual([len(drive.errors) for drive in drives], [54] * 3)
        shares, sigmas = fit(drives)
        for share, sigma, true in zip(shares[1:], sigmas[1:], SHARES[1:]):
            self.assertLess(abs(share - true), 3 * sigma)
        self.assertLess(sigmas[2], 0.002)
        # Nothing rolls: a share of the roll rate cannot be seen, and is left at zero.
        self.assertEqual(shares[0], 0.0)
        self.assertAlmostEqual(sigmas[0], course.PRIOR[0], delta=0.002)
        other = load_course_drive(self.write(9))
        self.assertLess(ratio(shares, other), 0.3)

    def test_a_course_that_cannot_train_is_refused_with_the_reason(self):
        self.refused("turns by [0-9]+ degrees, but 90 are needed", turn=0.001)
        self.refused("the course is known in 1 spans", seconds=20)
        self.refused("ref_yaw disagrees with gyr_z by", change=lambda yaw: -yaw, turn=0.5)
        # Every fourth block of 10 s lies 0.4 rad beside the others.
        beside = lambda yaw: yaw + 0.4 * ((np.arange(len(yaw)) - STILL) // 1000 % 4 == 0)
        self.refused("the course jumps by more than 0.2 rad in", change=beside)
        self.path.write_text("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n0,0,0,9.8,0,0,0\n0.01,0,0,9.8,0,0,0\n")
        with self.assertRaisesRegex(ValueError, "neither ref_gyr_z nor ref_yaw"):
            load_course_drive(self.path)

    def test_one_jump_costs_the_spans_that_it_touches(self):
        drive = load_course_drive(self.write(change=lambda yaw: yaw + 0.5 * (np.arange(len(yaw)) >= 30_300)))
        self.assertEqual((drive.left_out, len(drive.errors)), (1, 53))

    def test_an_uncertain_course_is_not_used(self):
        lines = self.write().read_text().splitlines()
        sigma = ["ref_yaw_sigma"] + ["0.3" if k < 30_300 else "0.02" for k in range(len(lines) - 1)]
        self.path.write_text("\n".join(f"{line},{s}" for line, s in zip(lines, sigma)))
        self.assertEqual(len(load_course_drive(self.path).errors), 29)

    def test_a_constant_of_a_drive_is_no_share(self):
        drive = CourseDrive("a", "", np.empty(0), np.random.default_rng(1).normal(size=(40, 3)), np.full(40, 0.1), 0)
        np.testing.assert_allclose(fit([drive])[0], 0, atol=1e-9)

    def test_a_course_is_simulated_from_a_rate(self):
        made = course.simulate_course(np.full(1000, 0.5), 0.0, np.random.default_rng(1))
        np.testing.assert_allclose(made[::100], 0.005 + 0.5 * np.arange(10))
        self.assertEqual(np.isfinite(made).sum(), 10)

    def test_spans_add_up_a_known_rate(self):
        gyro = np.tile([0.01, -0.02, 0.05], (4000, 1))
        turns, errors = spans(gyro, 0.04 * np.arange(1, 4001) / 100)
        np.testing.assert_allclose(turns, np.tile([0.1, -0.2, 0.5], (3, 1)))
        np.testing.assert_allclose(errors, 0.1)


if __name__ == "__main__":
    unittest.main()

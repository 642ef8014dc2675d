"""Drives as `gyronet import` writes them: pieces between gaps, for GyroNet and for FoGNet."""

import unittest

import numpy as np

from gyronet_train.recordings import load_drive, load_pieces
from gyronet_train.seconds import DRIVE, STEPS, load_grid, window_rows

from .in_folder import InFolder

GYR_Z, FOG, REFERENCE = DRIVE.index("gyr_z"), DRIVE.index("fog_rad"), DRIVE.index("ref_gyr_z")


class Gaps(InFolder):
    def setUp(self):
        super().setUp()
        self.path = self.folder / "any name.csv"
        rows = np.random.default_rng(1).normal(size=(2400, len(DRIVE)))
        rows[:, 0] = np.arange(2400) / 100
        self.rows = rows

    def write(self, kept):
        np.savetxt(self.path, self.rows[kept], delimiter=",", header=",".join(DRIVE), comments="")

    def test_without_a_gap_there_is_one_piece(self):
        self.write(np.arange(2400))
        [piece] = load_pieces(self.path)
        np.testing.assert_array_equal(piece.features, load_drive(self.path).features)
        self.assertEqual((len(piece.features), len(load_grid(self.path)[0].turn)), (2400, 24))

    def test_ends_without_a_reference_are_left_out(self):
        self.rows[[*range(7), *range(2390, 2400)], REFERENCE] = np.nan
        self.write(np.arange(2400))
        drive = load_drive(self.path)
        self.assertEqual(len(drive.gyro_error), 2383)
        np.testing.assert_allclose(drive.reference_rate[0], self.rows[7, REFERENCE], rtol=1e-6)
        self.rows[100, REFERENCE] = np.nan
        self.write(np.arange(2400))
        with self.assertRaisesRegex(ValueError, "line 102: a value is empty"):
            load_drive(self.path)

    def test_pieces_share_the_static_initialisation_of_the_first(self):
        kept = np.concatenate([np.arange(1010), np.arange(1230, 1300), np.arange(1400, 2400)])
        self.write(kept)
        first, second = load_pieces(self.path)
        bias = self.rows[:300, GYR_Z].mean()
        error = self.rows[1400:, GYR_Z] - bias - self.rows[1400:, REFERENCE]
        np.testing.assert_allclose(second.gyro_error, error, atol=1e-5)
        self.assertEqual((len(first.gyro_error), len(second.gyro_error)), (1010, 1000))
        with self.assertRaisesRegex(ValueError, "any name.csv: must be an unbroken"):
            load_drive(self.path)

    def test_seconds_with_a_gap_are_left_out(self):
        self.write(np.concatenate([np.arange(1010), np.arange(1230, 2400)]))
        first, second = load_grid(self.path)
        self.assertEqual((len(first.turn), len(second.turn)), (10, 11))
        np.testing.assert_allclose(second.turn[0], self.rows[1300:1400, REFERENCE].sum() / 100)
        np.testing.assert_allclose(second.features[0, 8], self.rows[1300:1400, FOG].sum())

    def test_rates_stand_in_for_the_fibre_optic_gyro(self):
        self.write(np.concatenate([np.arange(1010), np.arange(1230, 2400)]))
        rates = self.path.with_name("rates.csv")
        sent = np.concatenate([np.arange(300, 1010), np.arange(1230, 2400)])
        lines = [f"{k / 100:.4f},{'' if k == 500 else k / 1000},ready" for k in sent]
        rates.write_text("\n".join(["t_s,delayed,status", *lines]))
        first, second = load_grid(self.path, rates)
        self.assertEqual(first.features[:3, 8].tolist(), [0.0] * 3)
        np.testing.assert_allclose(first.features[5, 8], np.arange(501, 600).sum() / 1e5)
        np.testing.assert_allclose(second.features[0, 8], np.arange(1300, 1400).sum() / 1e5)
        rates.write_text("t_s,delayed,status\n11.0,0.1,ready\n11.01,0.1,ready\n")
        with self.assertRaisesRegex(ValueError, "rates.csv: has rates at times at which the drive has no rows"):
            load_grid(self.path, rates)

    def test_a_drive_that_begins_with_a_gap_is_named(self):
        self.write(np.concatenate([np.arange(200), np.arange(250, 2400)]))
        with self.assertRaisesRegex(ValueError, "any name.csv: must be an unbroken 100 Hz recording of more than 3 s"):
            load_pieces(self.path)

    def test_rows_are_turned_as_the_vehicle_file_beside_the_drive_says(self):
        self.write(np.arange(2400))
        [plain], [seconds] = load_pieces(self.path), load_grid(self.path)
        beside = self.path.with_suffix(".toml")
        beside.write_text("[mounting]\nyaw_deg = 90.0\n[wheels]\nradius_m = 0.3\n")
        [turned], [turned_seconds] = load_pieces(self.path), load_grid(self.path)
        x, y, z, p, q, r = plain.features.T
        np.testing.assert_allclose(turned.features.T, [-y, x, z, -q, p, r], atol=1e-6)
        np.testing.assert_allclose(turned_seconds.features[:, 0], -seconds.features[:, 1], atol=1e-12)
        np.testing.assert_allclose(turned_seconds.features[:, 4], seconds.features[:, 3], atol=1e-12)
        # A training that is gone on with must not mix the two.
        self.assertNotEqual(turned.sha256, plain.sha256)
        beside.write_text("[mounting]\nyaw_deg = 90.0\napplied = true\n")
        np.testing.assert_array_equal(load_pieces(self.path)[0].features, plain.features)

    def test_a_sensor_on_its_side_has_its_yaw_on_another_axis(self):
        self.write(np.arange(2400))
        [plain] = load_pieces(self.path)
        self.path.with_suffix(".toml").write_text("[mounting]\nroll_deg = 90.0\n")
        [turned] = load_pieces(self.path)
        np.testing.assert_allclose(turned.features[:, 5], plain.features[:, 4], atol=1e-6)
        error = plain.features[:, 4] - plain.reference_rate
        np.testing.assert_allclose(turned.gyro_error, error, atol=1e-6)

    def test_a_vehicle_file_that_cannot_be_read_is_named(self):
        self.write(np.arange(2400))
        for text in ["mounting = 3", "[mounting", "[mounting]\nyaw_deg = 'left'", "[mounting]\nyaw_deg = nan"]:
            self.path.with_suffix(".toml").write_text(text)
            with self.assertRaisesRegex(ValueError, "any name.toml: "):
                load_pieces(self.path)


class Windows(unittest.TestCase):
    def test_the_rows_of_a_window(self):
        self.assertEqual(window_rows(STEPS, "none").tolist(), list(range(STEPS)))
        self.assertIsNone(window_rows(STEPS - 1, "none"))
        self.assertEqual(window_rows(2, "repeat").tolist(), [0, 1] * (STEPS // 2))

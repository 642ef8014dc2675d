"""Sequences in the layout of KAIST Urban: what is read, and what is refused."""

import numpy as np

from gyronet_train.sequence import SequenceError, load_sequence

from .in_folder import InFolder
from .made_drive import SECONDS, SPEED, make_drive, start_and_go, write_kaist


class Files(InFolder):
    def setUp(self):
        super().setUp()
        self.folder = self.folder / "made"
        self.drive = start_and_go()
        write_kaist(self.drive, self.folder)

    def test_a_folder_is_read_as_it_was_written(self):
        read = load_sequence(self.folder)
        self.assertEqual((read.name, len(read)), ("made", SECONDS))
        self.assertAlmostEqual(read.start_ns, self.drive.start_ns, delta=256)
        np.testing.assert_allclose(read.position, self.drive.position, atol=1e-6)
        np.testing.assert_allclose(read.odometry[:, :, 2], self.drive.odometry[:, :, 2], atol=1e-7)
        np.testing.assert_allclose(read.odometry[:, :, :2].sum(1), self.drive.odometry[:, :, :2].sum(1), atol=1e-3)

    def test_rows_that_are_odd_are_left_out_and_a_gap_parts_a_drive(self):
        path = self.folder / "sensor_data" / "encoder.csv"
        rows = path.read_text().splitlines()
        odd = rows[500].split(",")[0] + ",nan,nan"
        # From 5.0 to 5.5 s there are no rows; the stamp of row 300 is there twice.
        path.write_text("\n".join([*rows[:300], rows[300], rows[300], *rows[301:500], odd, *rows[550:]]) + "\n")
        read = load_sequence(self.folder)
        self.assertEqual(np.flatnonzero(~read.whole).tolist(), [4, 5])
        [piece] = read.pieces()
        self.assertEqual((len(piece), piece.start_ns - read.start_ns), (6, 6 * 10**9))
        np.testing.assert_array_equal(piece.position, read.position[600:])

    def test_a_missing_file_is_named(self):
        (self.folder / "sensor_data" / "fog.csv").unlink()
        with self.assertRaisesRegex(SequenceError, "made.*fog.csv"):
            load_sequence(self.folder)

    def test_a_drive_that_does_not_stand_at_first_is_named(self):
        moving = make_drive(np.full(800, 5.0), np.zeros(800))
        write_kaist(moving, self.folder.parent / "moving")
        with self.assertRaisesRegex(SequenceError, "moving: the vehicle moves in the first 3 s"):
            load_sequence(self.folder.parent / "moving")

    def test_a_drive_of_a_moment_is_named(self):
        short = make_drive(np.zeros(200), np.zeros(200))
        write_kaist(short, self.folder.parent / "short")
        with self.assertRaisesRegex(SequenceError, "short: its files have 2 s in common"):
            load_sequence(self.folder.parent / "short")

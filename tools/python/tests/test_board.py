"""The board in Python sends and reports what the board in Rust does, on the simulated drive."""

import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

try:
    from gyronet import Coprocessor
except ImportError:
    raise unittest.SkipTest("the board's extension is not built: pip install ./tools/python with Rust") from None

ROOT = Path(__file__).parents[3]
DRIVE = ROOT / "tools/data/simulated_drive.csv"
WHEELS = [f"wheel{k}_rate" for k in range(1, 5)]


class Board(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        drive = np.genfromtxt(DRIVE, delimiter=",", names=True)
        cls.t, cls.imu = drive["t_s"], np.column_stack([drive[f"{kind}_{axis}"] for kind in ("acc", "gyr") for axis in "xyz"])
        cls.wheels = np.column_stack([drive[name] for name in WHEELS])

    def board(self, **more):
        return Coprocessor(wheels=[True] * 4, frames=True, **more)

    def test_bits_of_the_replay(self):
        """GYRONET_REPLAY is a folder with the log and the table that Rust wrote of this drive."""
        if "GYRONET_REPLAY" not in os.environ:
            self.skipTest("GYRONET_REPLAY is not set: cargo test runs this")
        folder, board = Path(os.environ["GYRONET_REPLAY"]), self.board()
        steps, log = board.run(self.t, self.imu, self.wheels), (folder / "can.log").read_text().split("\n")
        sent = [f"({time:.6f}) can0 {identifier:0{8 if extended else 3}X}#{data.hex().upper()}" for time, identifier, extended, data in board.frames()]
        self.assertEqual(sent, log[:-1])
        rows = [line.split(",") for line in (folder / "rates.csv").read_text().split()[1:]]
        known = steps[steps["status"] != 0]
        self.assertEqual(len(rows), len(known))
        for name, column in (("gyro", 1), ("live", 2), ("delayed", 3), ("delayed_sigma", 4), ("yaw", 5)):
            self.assertEqual(["" if np.isnan(value) else f"{value:.7f}" for value in known[name]], [row[column] for row in rows], name)

    def test_row_by_row_and_in_parts_as_in_one_call(self):
        boards = [self.board() for _ in range(3)]
        whole = boards[0].run(self.t, self.imu, self.wheels)
        parts = [boards[1].run(self.t[k : k + 777], self.imu[k : k + 777], self.wheels[k : k + 777], last=False) for k in range(0, len(self.t), 777)]
        single = [boards[2].step(*row) for row in zip(self.t, self.imu, self.wheels)]
        for board, found in ((boards[1], np.concatenate([*parts, boards[1].finish()])),
                             (boards[2], np.concatenate([np.array([s for s in single if s is not None]), boards[2].finish()]))):
            self.assertEqual(found.tobytes(), whole.tobytes())
            self.assertEqual(board.gyro_bias, boards[0].gyro_bias)
        self.assertEqual(boards[1].frames(), boards[0].frames())
        self.assertEqual((len(whole), boards[0].frames()), (len(self.t), []))

    def test_weights_configuration_and_calibration(self):
        plain = self.board().run(self.t, self.imu, self.wheels)
        default = self.board(weights=ROOT / "src/model/weights/default.blob").run(self.t, self.imu, self.wheels)
        self.assertEqual(default.tobytes(), plain.tobytes())
        other = self.board(weights=ROOT / "src/model/weights/gyronet.blob").run(self.t, self.imu, self.wheels)
        self.assertGreater(np.nanstd(other["delayed"] - plain["delayed"]), 1e-6)
        for more, words in ((dict(weights=ROOT / "src/model/weights/fognet.blob"), "fognet.blob: "), (dict(weights="absent"), "absent: "),
                            (dict(configuration="{}"), "missing field"), (dict(calibration="absent.json"), "absent.json: "), (dict(radius_m=0), "0.01 to 10 m")):
            with self.assertRaisesRegex(ValueError, words):
                self.board(**more)

    def test_arrays_that_do_not_fit(self):
        moving = self.imu.copy()
        moving[:, 5] += 0.002 * np.arange(len(moving))
        broken = self.imu.copy()
        broken[7, 2] = np.nan
        for arguments, words in (((self.t, self.imu[:, :5]), "imu has the shape"), ((self.t, self.imu, self.wheels[:9]), "wheels has the shape"),
                                 ((self.t, self.imu, None, None, True, self.wheels), "gnss has the shape"),
                                 ((self.imu, self.imu), "t_s has the shape"), ((-1 - self.t, self.imu), "row 0: "), ((self.t, broken), "row 7: not a finite"),
                                 ((self.t, moving), "row 299: ")):
            with self.assertRaisesRegex(ValueError, words):
                self.board().run(*arguments)

    def test_the_example(self):
        def example(*arguments):
            return subprocess.run([sys.executable, Path(__file__).parents[1] / "example.py", *arguments], capture_output=True, text=True,
                                  env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})

        done = example(DRIVE)
        yaw = re.search(r"yaw at the end: ([\d.]+) deg by the board, ([\d.]+) deg by the gyro alone\ntrue yaw ([\d.]+) deg", done.stdout)
        self.assertIsNotNone(yaw, done.stdout + done.stderr)
        board, gyro, truth = map(float, yaw.groups())
        self.assertLess(abs(board - truth), abs(gyro - truth))
        lines = DRIVE.read_text().splitlines()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "d.csv"
            for rows, words in ((lines[:1] + lines[3000:], "d.csv: row .*moves"), (lines[:200], "199 rows, of which none"), ([__doc__], "not a drive")):
                path.write_text("\n".join(rows) + "\n")
                self.assertRegex(example(path).stderr, rf"^[^\n]*{words}[^\n]*\n$")
        self.assertRegex(example().stderr, r"^[^\n]*python example.py DRIVE.csv\n$")

"""Two processes that train together end where one does, within its spread over seeds."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from . import needs_torch  # noqa: F401

import numpy as np

from .made_csv import write_drive

ROOT = Path(__file__).resolve().parents[1]
SEEDS = ["1", "2", "3", "4"]


class Processes(unittest.TestCase):
    def losses(self, folder, launcher, name):
        """The last losses of all seeds."""
        out = folder / name
        command = [sys.executable, *launcher, "-m", "gyronet_train", str(folder), "--out", str(out), "--train", "a", "b"]
        options = ["--validate", "c", "--epochs", "3", "--batch", "128", "--threads", "1", "--seeds", *SEEDS]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "TQDM_DISABLE": "1"}
        ran = subprocess.run([*command, *options], env=environment, capture_output=True, text=True)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        history = json.loads((out / "gyronet.history.json").read_text())
        return np.array([history["seeds"][seed]["loss"][-1] for seed in SEEDS])

    def test_two_processes_give_the_loss_of_one(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for k, drive in enumerate("abc"):
                write_drive(folder / f"{drive}.csv", 20, k)
            one = self.losses(folder, [], "one")
            two = self.losses(folder, ["-m", "torch.distributed.run", "--standalone", "--nproc_per_node", "2"], "two")
            # Two standard errors of the difference of two means.
            self.assertLess(abs(two.mean() - one.mean()), 2 * np.hypot(one.std(ddof=1), two.std(ddof=1)) / 2)


if __name__ == "__main__":
    unittest.main()

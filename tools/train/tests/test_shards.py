"""Drives go into Parquet shards and come back; what is streamed from them is what memory holds."""

import importlib.util
import sys
import tempfile
import unittest
from pathlib import Path

from .needs_torch import torch

import numpy as np

from gyronet_train.recordings import load_drive
from gyronet_train.spans import Spans

from .made_csv import write_drive

if importlib.util.find_spec("pyarrow"):
    from gyronet_train.shards import Stream, entries, write_shard
else:
    print("SKIPPED test_shards: no pyarrow", file=sys.stderr)


@unittest.skipUnless(importlib.util.find_spec("pyarrow"), "no pyarrow")
class Shards(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        paths = [write_drive(self.folder / f"{k}.csv", 8 + k, k) for k in range(5)]
        self.drives = [load_drive(path) for path in paths]
        write_shard(self.folder / "0.parquet", self.drives[:3])
        write_shard(self.folder / "1.parquet", self.drives[3:])

    def test_a_drive_comes_back_to_the_last_bit(self):
        for drive, entry in zip(self.drives, entries(self.folder), strict=True):
            back = entry.read()
            self.assertEqual((back.name, back.sha256), (drive.name, drive.sha256))
            for name in ("features", "gyro_error", "reference_rate"):
                np.testing.assert_array_equal(getattr(back, name), getattr(drive, name))

    def test_moments_are_those_of_all_samples(self):
        stream, spans = Stream(self.folder, 1), Spans(self.drives, 1)
        torch.testing.assert_close(stream.moments.mean(), spans.features.mean(0))
        deviations = torch.cat([spans.features.std(0), spans.gyro_error.std().view(1)])
        torch.testing.assert_close(stream.moments.deviations(), deviations)

    def test_an_epoch_has_each_window_at_most_once_and_nearly_all(self):
        spans = Spans(self.drives, 1)
        rows = {spans.features[at : at + 10].numpy().tobytes() for at in spans.starts}
        for ranks in (1, 2):
            seen, batches = [], []
            for rank in range(ranks):
                stream = Stream(self.folder, 1, (rank, ranks), drives_at_once=2)
                got = list(stream.batches(64))
                batches.append((len(got), stream.epoch(64)))
                seen += [window.numpy().tobytes() for features, _ in got for window in features]
            # Every process has the same number of batches, or the others would wait for it.
            self.assertEqual(len(set(batches)), 1)
            self.assertEqual(*batches[0])
            self.assertEqual(len(seen), len(set(seen)))
            self.assertLessEqual(set(seen), rows)
            self.assertGreater(len(seen), (0.85 if ranks == 1 else 0.65) * len(rows))

    def test_other_files_are_refused(self):
        import pyarrow
        import pyarrow.parquet as parquet

        with self.assertRaisesRegex(ValueError, "5 drives for 6 processes"):
            Stream(self.folder, 1, (0, 6))
        parquet.write_table(pyarrow.table({"a": [1]}), self.folder / "2.parquet")
        with self.assertRaisesRegex(ValueError, "2.parquet: not written by"):
            entries(self.folder)
        with self.assertRaisesRegex(ValueError, "no .parquet files"):
            entries(self.folder / "none")


if __name__ == "__main__":
    unittest.main()

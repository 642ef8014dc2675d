"""python -m gyronet_train.shards DRIVE.csv... --out FOLDER: write drives as Parquet shards, for data beyond memory.

A shard has one row group per drive, with the network's inputs and labels in f32. Its metadata has the name, hash and
moments of each drive, so that a training has them before it reads a row. Needs pyarrow.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet as parquet
import torch

from .moments import Moments
from .recordings import Drive, load_drive
from .spans import Spans

COLUMNS = [*(f"feature{k}" for k in range(6)), "gyro_error", "reference_rate"]


@dataclass(frozen=True)
class Entry:
    """The location of a drive in a shard, and its metadata."""

    path: Path
    group: int
    name: str
    sha256: str
    moments: Moments

    def read(self) -> Drive:
        """Reads the drive."""
        table = parquet.ParquetFile(self.path).read_row_group(self.group)
        columns = [table[name].to_numpy() for name in COLUMNS]
        return Drive(self.name, self.sha256, np.stack(columns[:6], axis=1), *columns[6:])


def write_shard(path: Path, drives: list[Drive]) -> None:
    """Writes drives to one shard."""
    about = [{"name": d.name, "sha256": d.sha256, "moments": asdict(Moments.of(d))} for d in drives]
    schema = pyarrow.schema([(name, pyarrow.float32()) for name in COLUMNS], {"drives": json.dumps(about)})
    with parquet.ParquetWriter(path, schema) as writer:
        for drive in drives:
            columns = [*drive.features.T, drive.gyro_error, drive.reference_rate]
            writer.write_table(pyarrow.table(columns, schema=schema), len(drive.gyro_error))


def entries(folder: Path) -> list[Entry]:
    """Returns the drives in the shards of a folder. Raises ValueError if there are none, or for other Parquet files."""
    found = []
    for path in sorted(folder.glob("*.parquet")):
        metadata = parquet.read_schema(path).metadata or {}
        if b"drives" not in metadata:
            raise ValueError(f"{path}: not written by gyronet_train.shards")
        for group, drive in enumerate(json.loads(metadata[b"drives"])):
            moments = Moments(**drive["moments"])
            found.append(Entry(path, group, drive["name"], drive["sha256"], moments))
    if not found:
        raise ValueError(f"{folder}: no .parquet files")
    return found


class Stream:
    """All spans of the drives in some shards, like `Spans`, with a few drives in memory at a time."""

    def __init__(self, folder: Path, windows: int, part: tuple[int, int] = (0, 1), drives_at_once: int = 8):
        self.entries = entries(folder)
        self.names = {entry.name: entry.sha256 for entry in self.entries}
        self.windows = windows
        self.part = part
        self.at_once = drives_at_once
        self.moments = Moments.added([entry.moments for entry in self.entries])
        if len(self.entries) < part[1]:
            raise ValueError(f"{folder}: {len(self.entries)} drives for {part[1]} processes")

    def batches(self, windows: int) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        """Yields the batches of this process: its drives in random order, shuffled within the drives in memory."""
        return islice(self._all(windows), self.epoch(windows))

    def _all(self, windows: int) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        mine = self.entries[self.part[0] :: self.part[1]]
        order = torch.randperm(len(mine)).tolist()
        for at in range(0, len(order), self.at_once):
            drives = [mine[k].read() for k in order[at : at + self.at_once]]
            yield from Spans(drives, self.windows).batches(windows)

    def epoch(self, windows: int) -> int:
        """Returns the number of batches of an epoch, the same for every process: the least that any process has in any
        order of its drives."""

        def least(entry: Entry) -> int:
            return Spans.count(entry.moments.count, self.windows) // (windows // self.windows * self.windows)

        ranks = self.part[1]
        return min(sum(map(least, self.entries[rank::ranks])) for rank in range(ranks))


def main() -> None:
    parser = argparse.ArgumentParser(prog="gyronet_train.shards", description=__doc__)
    parser.add_argument("drives", type=Path, nargs="+", metavar="DRIVE.csv")
    parser.add_argument("--out", type=Path, required=True, help="folder for the .parquet files")
    parser.add_argument("--drives-per-shard", type=int, default=16, metavar="N")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    each = args.drives_per_shard
    for at in range(0, len(args.drives), each):
        path = args.out / f"{at // each:05}.parquet"
        write_shard(path, [load_drive(drive) for drive in args.drives[at : at + each]])
        print(path)


if __name__ == "__main__":
    main()

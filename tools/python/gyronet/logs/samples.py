"""Channels of a log: timed samples, the older ones in a temporary file, with a record of what was wrong with their stamps."""

import os
import tempfile
import weakref
from array import array
from collections import Counter
from pathlib import Path

import numpy as np

from gyronet.refused import Refused, listed

WIDTH = {"imu": 6, "gyro": 3, "accel": 3, "odometry": 2, "position": 5, "number": 1}
NAMES = {"imu": "IMU", "number": "signal"}
BLOCK = 1 << 16  # numbers in memory, of each channel
STEP = 0.5  # s: a step back that is more than messages out of order


class Channel:
    def __init__(self, log, name, kind, unit="", kept=True):
        self.log, self.name, self.kind, self.unit, self.kept = log, name, kind, unit, kept
        self.width = 1 + WIDTH[kind]
        self.buffer, self.file = array("d"), None
        self.count, self.first, self.last = 0, None, -np.inf
        self.given = 0
        self.seen = np.zeros(WIDTH[kind], bool)  # columns that were ever other than zero
        self.gap = (0.0, 0.0)  # the longest pause between samples and its place, s
        self.falls = {}  # counts and first places of stamps that do not rise
        self.back = None  # size, place and cost of the steps back

    def add(self, seconds, values):
        self.buffer.append(seconds)
        self.buffer.extend(values)
        if len(self.buffer) >= BLOCK:
            self.flush()

    def flush(self):
        if self.buffer:
            block, self.buffer = self.buffer, array("d")
            self.extend(np.frombuffer(block).reshape(-1, self.width))

    def extend(self, block):
        """Adds rows of time and values; what is not finite or does not rise in time is counted and left out."""
        self.given += len(block)
        good = np.isfinite(block[:, 0])
        values = block[:, 1:3] if self.kind == "position" else block[:, 1:]
        good &= np.isfinite(values).all(axis=1)
        if self.kind == "position":
            good &= (np.abs(block[:, 1]) <= 90) & (np.abs(block[:, 2]) <= 360)
        self.log.drop(f"{self.name}: not a finite number", len(block) - np.count_nonzero(good))
        block = block[good]
        if not len(block):
            return
        seconds = block[:, 0]
        self.first = seconds[0] if self.first is None else self.first
        before = np.maximum.accumulate(np.concatenate([[self.last], seconds[:-1]]))
        step = seconds - before
        for reason, which in (("stand still", step == 0), ("step back", step < 0)):
            if which.any():
                self.falls.setdefault(reason, [0, before[which][0] - self.first])[0] += np.count_nonzero(which)
        if (far := step < -STEP).any():
            size, place, lost = self.back or (0.0, before[far][0] - self.first, 0)
            self.back = (max(size, -step[far].min()), place, lost + np.count_nonzero(far))
        longest = int(np.argmax(np.where(np.isfinite(step), step, 0.0)))
        if self.gap[0] < step[longest] < np.inf:
            self.gap = (float(step[longest]), float(before[longest] - self.first))
        kept = block[step > 0]
        self.count, self.last = self.count + len(kept), float(max(seconds.max(), self.last))
        self.seen |= (kept[:, 1:] != 0).any(axis=0)
        if self.kept and len(kept):
            if self.file is None:
                self.file = tempfile.TemporaryFile()
                # A log and its channels refer to each other: without this the file is open until some later collection.
                weakref.finalize(self, self.file.close)
            self.file.write(np.ascontiguousarray(kept).tobytes())

    def append(self, other):
        """Adds the samples of the same channel in the next part of a recording."""
        if other is not self and other.count and other.file:
            for first in range(0, other.count, BLOCK):
                self.extend(other.rows(first, first + BLOCK))
        self.close()

    def close(self):
        """Ends the writing; an IMU one of whose halves is zero throughout is a gyro or an accelerometer."""
        self.flush()
        if self.file:
            self.file.flush()
        for reason, (count, place) in self.falls.items():
            self.log.drop(f"{self.name}: stamps that {reason}, first at {place:.2f} s", count)
        self.falls = {}
        if self.kind == "imu" and self.count:
            force, rate = self.seen[:3].any(), self.seen[3:].any()
            if force != rate:
                self.kind = "accel" if force else "gyro"

    def rows(self, first=0, behind=None):
        """Samples of a range, as rows of time and values; read, not mapped, so that the memory stays bounded."""
        behind = min(self.count if behind is None else behind, self.count)
        if not self.file or behind <= first:
            return np.empty((0, self.width))
        size = 8 * self.width
        return np.frombuffer(os.pread(self.file.fileno(), size * (behind - first), size * first)).reshape(-1, self.width)

    def stamps(self):
        blocks = [self.rows(first, first + BLOCK)[:, 0].copy() for first in range(0, self.count if self.file else 0, BLOCK)]
        return np.concatenate(blocks or [np.empty(0)])

    @property
    def rate(self):
        return (self.count - 1) / max(self.last - self.first, 1e-9) if self.count else 0.0

    def __str__(self):
        return f"{self.name} ({NAMES.get(self.kind, self.kind)}, {self.rate:.1f} Hz)"


class Log:
    """The channels of one file, and counts of what was not used."""

    def __init__(self, path, wanted=None, recorded=False, several=False):
        self.path, self.wanted, self.recorded, self.several = path, wanted, recorded, several
        self.channels, self.dropped, self.passed, self.notes = {}, Counter(), Counter(), []
        self.columns, self.mapped = None, set()  # of a table: its names, and those of ours that the vehicle file finds
        self.epoch = None  # time of day at time 0, s, where the log gives it

    def channel(self, name, kind, unit=""):
        channel = self.channels.get(name)
        if channel is None:
            channel = self.channels[name] = Channel(self, name, kind, unit, kind != "number" or self.wants(name))
        return channel

    def wants(self, name):
        return self.wanted is None or any(want == name or want.endswith(":" + name) for want in self.wanted)

    def find(self, ours, vehicle, find):
        """What `find` finds under the name that the vehicle file gives a column of ours, as NAME or FILE:NAME; else under ours."""
        name = vehicle.column(ours)
        if not name:
            return find(ours)
        found = find(name.removeprefix(Path(self.path).name + ":"))
        if found is not None:
            self.mapped.add(ours)
        elif not self.several:
            raise Refused(f"{self.path}: no column {name}, which {vehicle.path} names for {ours}" + listed(self.columns, "; the columns are "))
        return found

    def add(self, name, kind, seconds, values, unit=""):
        channel = self.channel(name, kind, unit)
        if channel.kind != kind:
            self.dropped[f"{name}: another type under the same name"] += 1
        else:
            channel.add(seconds, values)

    def drop(self, reason, count=1):
        if count:
            self.dropped[reason] += int(count)

    def close(self):
        for channel in self.channels.values():
            channel.close()
        self.channels = {name: channel for name, channel in self.channels.items() if channel.count}
        return self

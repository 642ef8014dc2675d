"""A channel in its role: SI values, even stamps, offset of its clock, and what a user must know about it."""

import numpy as np

from gyronet import units
from gyronet.logs import grid
from gyronet.logs.samples import BLOCK
from gyronet.refused import Refused

GRAVITY = 9.80665
IMU = {"imu": [("acceleration", "m/s^2"), ("rate", "rad/s")], "gyro": [("rate", "rad/s")], "accelerometer": [("acceleration", "m/s^2")]}
HALVES = {**IMU, "odometry": [("speed", "m/s"), ("rate", "rad/s")]}  # dimensions and units of a message's parts


class Used:
    def __init__(self, role, entry, request):
        self.role, (self.file, self.channel) = role, entry
        self.name, self.filled, self.remarks = self.channel.name, 0, []
        self.seconds = self.channel.stamps()
        self.offset = request.offsets.get(self.name, 0.0)
        self.columns, self.scales, self.unit, self.dimension = self.pick(request)
        if role in IMU:
            even, remark = grid.spread_bursts(self.seconds)
            if remark:
                self.seconds = even
                self.remarks.append(remark)
        self.hz = grid.rate(self.seconds) or 100.0
        if self.channel.gap[0] > max(1.0, 20 / max(self.hz, 1e-9)):
            self.remarks.append(f"stamps jump by {self.channel.gap[0]:.2f} s at {self.channel.gap[1]:.2f} s")
        self.check_back(request)

    def pick(self, request):
        """Columns of the samples, their scales, the unit's name and its dimension."""
        kind, name, width = self.channel.kind, self.name, self.channel.width
        if self.role in HALVES:
            given = [request.units.get((name, dimension)) for dimension, _ in HALVES[self.role]]
            scales = [units.find(unit)[1] if unit else 1.0 for unit in given]
            said = ", ".join(unit or own for unit, (_, own) in zip(given, HALVES[self.role]))
            # A channel of the kind imu holds both halves also where one of them is zero throughout.
            first, axes = 3 if self.role == "gyro" and width == 7 else 0, 3 if self.role in IMU else 1
            return slice(first, first + axes * len(given)), np.repeat(scales, axes), said, None
        if self.role == "position":
            return slice(0, 5), 1.0, "deg", None
        if kind != "number":
            unit = request.units.get((name, "rate"))
            return slice(width - 2, width - 1), units.find(unit)[1] if unit else 1.0, unit or "rad/s", "rate"
        wheel = self.role.startswith("wheel")
        unit = request.units.get(name) or self.channel.unit
        scale, dimension, said = units.scale(name, unit, ["speed", "rate"] if wheel else ["rate"], "wheel speed" if wheel else "yaw rate")
        return slice(0, 1), scale, said, dimension

    def check_back(self, request):
        if not self.channel.back:
            return
        size, place, lost = self.channel.back
        said = f"stamps step back by {size:.2f} s at {place:.2f} s, and {lost} of {self.channel.given} samples are lost"
        if lost > 0.05 * self.channel.given and self.role != "position" and (request.to is None or request.to > place):
            raise Refused(f"{self.name}: {said}; import the part before with --to {max(int(100 * place) / 100, 0):g}"
                          + ("" if request.recorded else ", or use the recording times: --stamps recorded (bags)"))
        self.remarks.append(said)

    def values(self, first, behind):
        return self.channel.rows(first, behind)[:, 1:][:, self.columns] * self.scales

    def at(self, times):
        """Values at the rows' times; NaN where there is none."""
        return grid.resample(self.seconds, self.values, self.hz, times, self.offset)

    def yaw(self, vehicle, longest):
        """Times and yaw rate of the first part, for the comparison of clocks."""
        seconds = self.seconds[: np.searchsorted(self.seconds, self.seconds[0] + longest)]
        rates = []
        for first in range(0, len(seconds), BLOCK):
            values = self.values(first, min(first + BLOCK, len(seconds)))
            rates.append(vehicle.turn(values[:, -3:])[:, 2] if self.role in IMU else values[:, -1])
        return np.column_stack([seconds + self.offset, np.concatenate(rates)])

    def span(self):
        return self.seconds[0] + self.offset, self.seconds[-1] + self.offset

    def line(self, start, seconds, rows):
        """The report: unit, rate, span within the drive, offset and how many rows it filled."""
        first, last = (min(max(time - start, 0.0), seconds) for time in self.span())
        return (f"{self.role}: {self.name}, {self.unit}, {self.hz:.1f} Hz, {first:.2f} to {last:.2f} s, offset {self.offset:+.3f} s, "
                f"{self.filled} of {rows} rows" + "".join(f"; {remark}" for remark in self.remarks))

    def check_gravity(self):
        size = float(np.median(np.linalg.norm(self.values(0, 10_000)[:, :3], axis=1)))
        if 0.8 < size < 1.25 or 800 < size < 1250:
            unit = "g" if size < 2 else "mg"
            raise Refused(f"{self.name}: the specific force is {size:.2f}, where gravity is {GRAVITY:.2f} m/s^2: {unit}?"
                          f" --unit {self.name}={unit}")

"""A channel in its role: SI values, even stamps, offset of its clock, and what a user must know about it."""

import numpy as np

from gyronet.logs import grid, units
from gyronet.refused import Refused

GRAVITY = 9.80665


class Used:
    def __init__(self, role, entry, request, half=None):
        self.role, (self.file, self.channel) = role, entry
        self.name, self.filled, self.remarks = self.channel.name, 0, []
        self.rows = self.channel.rows()
        self.seconds = np.array(self.rows[:, 0])
        self.offset = request.offsets.get(self.name, 0.0)
        self.columns, self.scales, self.unit, self.dimension = self.pick(request, half)
        if role in ("imu", "gyro", "accelerometer"):
            even, remark = grid.spread_bursts(self.seconds)
            if remark:
                self.seconds = even
                self.remarks.append(remark)
        self.hz = grid.rate(self.seconds) or 100.0
        if self.channel.gap[0] > max(1.0, 20 / max(self.hz, 1e-9)):
            self.remarks.append(f"stamps jump by {self.channel.gap[0]:.2f} s at {self.channel.gap[1]:.2f} s")
        self.check_back(request)

    def pick(self, request, half):
        """Columns of the samples, their scales, the unit's name and its dimension."""
        kind, name = self.channel.kind, self.name
        if self.role in ("imu", "gyro", "accelerometer"):
            given = {what: request.units.get((name, what)) for what in ("acceleration", "rate")}
            scale = {what: units.find(unit)[1] if unit else 1.0 for what, unit in given.items()}
            said = ", ".join(given[what] or units.KNOWN[4 if what == "acceleration" else 7][2].split("|")[0] for what in
                             {"imu": ("acceleration", "rate"), "gyro": ("rate",), "accelerometer": ("acceleration",)}[self.role])
            said = said if any(given.values()) else {"imu": "m/s^2, rad/s", "gyro": "rad/s", "accelerometer": "m/s^2"}[self.role]
            if self.role == "imu":
                return slice(0, 6), [scale["acceleration"]] * 3 + [scale["rate"]] * 3, said, None
            first = 3 if kind == "imu" and half == "rate" else 0
            return slice(first, first + 3), [scale["rate" if half == "rate" else "acceleration"]] * 3, said, None
        if self.role == "odometry":
            return slice(0, 2), [1.0, 1.0], "m/s, rad/s", None
        if self.role == "position":
            return slice(0, 6), [1.0] * 6, "deg", None
        if kind != "number":
            at = {"imu": 5, "gyro": 2, "odometry": 1}[kind]
            unit = request.units.get((name, "rate"))
            return slice(at, at + 1), [units.find(unit)[1] if unit else 1.0], unit or "rad/s", "rate"
        wheel = self.role.startswith("wheel")
        unit = request.units.get(name) or request.vehicle.unit_of(name) or self.channel.unit
        scale, dimension, said = units.scale(name, unit, ["speed", "rate"] if wheel else ["rate"], "wheel speed" if wheel else "yaw rate")
        return slice(0, 1), [scale], said, dimension

    def check_back(self, request):
        if not self.channel.back:
            return
        size, place, lost = self.channel.back
        said = f"stamps step back by {size:.2f} s at {place:.2f} s, and {lost} of {self.channel.given} samples are lost"
        if lost > 0.05 * self.channel.given and self.role != "position" and (request.to is None or request.to > place):
            raise Refused(f"{self.name}: {said}; import the part before with --to {max(int(100 * place) / 100, 0):g}"
                          + ("" if request.recorded else ", or use the recording times: --stamps recorded (bags)"))
        self.remarks.append(said)

    def at(self, times):
        """Values at the rows' times; NaN where there is none."""
        return grid.resample(self.rows[:, [0, *range(1 + self.columns.start, 1 + self.columns.stop)]], self.hz, times, self.offset,
                             self.seconds) * self.scales

    def yaw(self, vehicle):
        """Times and yaw rate, for the comparison of clocks."""
        values = np.array(self.rows[:, 1:][:, self.columns]) * self.scales
        if self.role in ("imu", "gyro"):
            values = vehicle.turn(values[:, -3:])
        return np.column_stack([self.seconds + self.offset, values[:, -1]])

    def span(self):
        return self.seconds[0] + self.offset, self.seconds[-1] + self.offset

    def line(self, start, rows):
        """The report: unit, rate, span, offset and how many rows it filled."""
        first, last = (time - start for time in self.span())
        return (f"{self.role}: {self.name}, {self.unit}, {self.hz:.1f} Hz, {first:.2f} to {last:.2f} s, offset {self.offset:+.3f} s, "
                f"{self.filled} of {rows} rows" + "".join(f"; {remark}" for remark in self.remarks))

    def check_gravity(self):
        force = np.array(self.rows[:10_000, 1:][:, self.columns])[:, :3] * self.scales[:3]
        size = float(np.median(np.linalg.norm(force, axis=1)))
        if 0.8 < size < 1.25 or 800 < size < 1250:
            unit = "g" if size < 2 else "mg"
            raise Refused(f"{self.name}: the specific force is {size:.2f}, where gravity is {GRAVITY:.2f} m/s^2: {unit}? --unit {self.name}={unit}")

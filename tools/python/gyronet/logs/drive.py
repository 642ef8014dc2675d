"""One drive from one or more logs, at 100 Hz on the clock of the gyro's file, and the CSV that every gyronet command reads."""

import os
from contextlib import suppress
from datetime import datetime, timezone
from functools import partial
from pathlib import Path

import numpy as np

from gyronet import units
from gyronet.logs import clocks, course, grid, opened, select
from gyronet.logs.can import Bus
from gyronet.logs.used import Used
from gyronet.refused import Refused, gathered
from gyronet.vehicle import CARRIED, IMU_COLUMNS, POSITION, RADIUS, WHEEL_COLUMNS, WHEELS

SHORTEST, LONGEST = 3.0, 86_400.0
RATES = (24.5, 1_020.0)
CHUNK = 50_000  # rows in memory
DAY = 1e9  # s: later stamps are times of day
NAMES = ["t_s", *IMU_COLUMNS, "ref_gyr_z", "ref_yaw", "ref_yaw_sigma", "gnss_speed", *WHEEL_COLUMNS, *POSITION, "course", "course_sigma", "temp_c"]
ROLES = [f"wheel {name.replace('_', ' ')}" for name in WHEELS]


class Drive:
    def __init__(self, request):
        self.request, self.vehicle = request, request.vehicle
        self.warnings = []
        bus = Bus(self.vehicle.bus["dbc"], request.wanted())
        paths = opened.expand(request.files)
        logs = [opened.read(path, request, bus, len(paths) > 1) for path in paths]
        self.report = opened.check_columns(self.vehicle, logs)
        self.logs = logs = opened.merged(logs)
        files = select.Files(logs, bus)
        self.choose(files)
        self.dropped = {}
        for log in logs:
            unused = set(log.channels) - {used.name for used in self.used()}
            for reason, count in log.dropped.items():
                if reason.partition(": ")[0] in unused:
                    log.passed[reason] += count
                else:
                    self.dropped[f"{log.path}: {reason}"] = count
            self.report += [f"{log.path}: {note}" for note in log.notes]
            if passed := +log.passed:
                self.report.append(f"{log.path}: {passed.total()} records that this drive does not need: {', '.join(list(passed)[:6])}")
        self.report += bus.notes + files.notes
        self.span()
        clocks.settle(self, logs, request)
        self.place_courses()
        self.count_rows()
        self.start_of_day()
        # The names that were used, for what the doctor says.
        halves = [self.gyro.name] + [self.accel.name] * (self.accel is not self.gyro)
        used = {"imu": "+".join(halves), "odometry": self.odometry, "position": self.position, "reference_rate": self.reference}
        for role, channel in used.items():
            self.vehicle.signals[role] = getattr(channel, "name", channel)

    def choose(self, files):
        signals, request = self.vehicle.signals, self.request

        def used(role, entry):
            return Used(role, entry, request) if entry else None

        def motion():
            wheels = files.wheels(self.vehicle)
            # If wheels are found, no odometry is needed.
            return wheels, files.one("odometry", signals["odometry"] or any(wheels) and "none")

        (gyro, accel), (wheels, odometry), position = gathered(lambda: files.imu(signals["imu"]), motion, lambda: files.one("position", signals["position"]))
        if gyro is accel:
            self.gyro = self.accel = used("imu", gyro)
        else:
            self.gyro, self.accel = used("gyro", gyro), used("accelerometer", accel)
        self.accel.check_gravity()
        self.wheels = gathered(*(partial(used, role, wheel) for role, wheel in zip(ROLES, wheels)))
        name = signals["reference_rate"] or ("ref_gyr_z" if any(c.name == "ref_gyr_z" for _, c in files.all) else None)
        self.reference = used("reference rate", name and files.named("the reference rate", name, ("number", "imu", "gyro", "odometry")))
        self.odometry, self.position = used("odometry", odometry), used("position", position)
        self.courses = course.courses(self.position.channel.rows()) if self.position else np.empty((0, 4))
        if unknown := set(request.offsets) - {channel.name for _, channel in files.all}:
            raise Refused(f"--offset {min(unknown)}: no such channel" + files.listed(files.all))
        known = {name for log in self.logs for name in [*log.channels, *(log.columns or ())]}
        request.units.check(known - {used.name for used in self.used()})

    def used(self):
        roles = [self.gyro, self.accel, self.reference, self.odometry, self.position, *self.wheels]
        return list(dict.fromkeys(used for used in roles if used))

    def span(self):
        request, (first, last) = self.request, self.gyro.span()
        if self.accel is not self.gyro:
            begin, end = self.accel.span()
            first = max(first, min(begin, last))
            if begin > last or end < first:
                raise Refused(self.apart(self.accel) + "; one clock is needed")
        self.start = first + request.start
        last = min(last, first + request.to) if request.to is not None else last
        for used in (self.gyro, self.accel):
            if not RATES[0] <= used.hz <= RATES[1]:
                raise Refused(f"{used.name}: {used.hz:.4g} Hz by the median period, {used.channel.rate:.4g} Hz by count and span, "
                              "but an IMU needs 25 to 1000 Hz; is the time's unit right? --unit t_s=ms")
        self.length = last - self.start
        if request.start and self.length < 0:
            raise Refused(f"--from {request.start:g} is after the end, {last - first:.1f} s")
        if not SHORTEST <= self.length < LONGEST:
            raise Refused(f"{self.gyro.name}: {self.length:.2f} s, but a drive is 3 s to a day long; --from and --to choose a part")
        self.count = int(self.length / grid.DT) + 1

    def apart(self, used):
        (a, b), (c, d) = self.gyro.span(), used.span()
        return (f"{used.name} does not overlap with {self.gyro.name} in time: {self.gyro.name} spans {a:.2f} to {b:.2f} s, "
                f"{used.name} {c:.2f} to {d:.2f} s")

    def place_courses(self):
        fixes, offset = self.position.channel.rows()[:, :3] if self.position else np.empty((0, 3)), self.position.offset if self.position else 0
        self.gnss = [(slice(15, 17), *self.placed(fixes, offset))]
        log, carried = self.logs[self.gyro.file], []
        for name, dimension in CARRIED.items():
            channel = log.channels.get(name)
            if channel is None or channel.kind != "number":
                continue
            scale = units.scale(name, channel.unit, [dimension], f"{name} column")[0] if channel.unit else 1.0
            column = NAMES.index(name)
            self.gnss.append((slice(column, column + 1), *self.placed(channel.rows() * [1.0, scale], self.request.offsets.get(name, 0.0))))
            carried.append(name)
        courses = self.courses.copy()
        courses[:, 1:3] = np.nan if "ref_yaw" in carried else courses[:, 1:3]
        courses[:, 3] = np.nan if "gnss_speed" in carried else courses[:, 3]
        self.gnss.insert(0, (slice(8, 11), *self.placed(courses, offset)))
        if carried:
            self.report.append(f"{log.path}: columns that stay as they are: {', '.join(carried)}")

    def placed(self, received, offset):
        """The rows of the drive in which something was received, and its values."""
        at = (received[:, 0] + offset - self.start) / grid.DT
        at = np.sign(at) * np.floor(np.abs(at) + 0.5)
        near = (at >= 0) & (at < self.count)
        return at[near].astype(int), received[near, 1:]

    def chunks(self):
        """Rows by the thousand: t_s, six of the IMU, reference, three of the course, four wheels, two of the position, three more; NaN is unknown."""
        for first in range(0, self.count, CHUNK):
            index = np.arange(first, min(first + CHUNK, self.count))
            times = self.start + grid.DT * index
            rows = np.full((len(index), len(NAMES)), np.nan)
            rows[:, 0] = grid.DT * index
            gyro = self.gyro.at(times)
            force = gyro[:, :3] if self.accel is self.gyro else self.accel.at(times)
            rows[:, 1:4], rows[:, 4:7] = self.vehicle.turn(force), self.vehicle.turn(gyro[:, -3:])
            if self.reference:
                rows[:, 7] = self.reference.at(times)[:, 0]
            for columns, at, values in self.gnss:
                here = (at >= first) & (at <= index[-1])
                rows[at[here] - first, columns] = values[here]
            for k, wheel in enumerate(self.wheels):
                if wheel:
                    rows[:, 11 + k] = wheel.at(times)[:, 0] * (1.0 if wheel.dimension == "rate" else 1.0 / self.vehicle.radius)
            if self.odometry:
                speed, turn = self.odometry.at(times).T
                half, known = 0.5 * (self.vehicle.wheels["track_m"] or 0.0), np.isfinite(speed)
                rows[known, 11], rows[known, 13] = np.nan, np.nan
                rows[known, 12] = (speed + half * turn)[known] / self.vehicle.radius
                rows[known, 14] = (speed - half * turn)[known] / self.vehicle.radius
            yield rows[np.isfinite(rows[:, 1:7]).all(axis=1)]

    def count_rows(self):
        filled, self.rows, self.seconds = np.zeros(len(NAMES), int), 0, 0.0
        for table in self.chunks():
            filled += np.isfinite(table).sum(axis=0)
            self.rows += len(table)
            self.seconds = float(table[-1, 0]) if len(table) else self.seconds
        if not self.rows:
            raise Refused(f"{self.gyro.name}: no row has gyro and accelerometer: {self.apart(self.accel)}")
        self.seen = filled > 0
        places = [(self.gyro, 4), (self.accel, 1), (self.reference, 7), (self.odometry, 12), (self.position, 8),
                  *((wheel, 11 + k) for k, wheel in enumerate(self.wheels))]
        for used, column in places:
            if not used:
                continue
            used.filled = int(filled[column])
            begin, end = used.span()
            beyond = begin > self.start + self.count * grid.DT or end < self.start
            if not used.filled and (beyond or used is not self.position):
                flag = {"odometry": "--odometry none", "position": "--position none"}.get(used.role, "another name in the vehicle file")
                raise Refused(f"{self.apart(used)}, so it fills no row; without it: {flag}; a known offset: --offset {used.name}=SECONDS"
                              + ("" if self.request.recorded else "; a bag's recording times: --stamps recorded"))
            if not used.filled:
                used.remarks.append("no course: it stands, is too slow or too noisy")
        for used in self.used():
            self.report.append(used.line(self.start, self.length, self.rows))
        rates, given = any(wheel and wheel.dimension == "rate" for wheel in self.wheels), self.vehicle.wheels
        if (self.odometry or any(self.wheels)) and not given["radius_m"]:
            why = "speeds and paths scale with it" if rates else "paths do not depend on it, since speeds are given"
            self.report.append(f"wheels: radius {RADIUS} m is assumed ({why}); set wheels.radius_m in a --vehicle file")
            given["radius_m"] = None if rates else RADIUS  # by which the drive's rates are made of speeds
        if self.odometry and not given["track_m"]:
            self.report.append("wheels: track 0 m is assumed (both at the vehicle's speed); set wheels.track_m in a --vehicle file")
        if not self.seen[7:10].any():
            lacks = "no course" if self.position else "no GNSS position (sensor_msgs/NavSatFix, columns gnss_lat and gnss_lon)"
            self.report.append(f"{lacks} and no reference: no method can be judged by this drive")
        if self.count > self.rows:
            self.report.append(f"imu: {self.count - self.rows} of {self.count} rows are in gaps and left out")

    def start_of_day(self):
        """The time of day of row 0, s since 1970, by whichever clock has it."""
        known = [self.start] if self.start > DAY else []
        if self.vehicle.start is not None:
            known.append(self.vehicle.start + self.start - self.gyro.offset)
        for used in self.used():
            epoch = self.logs[used.file].epoch
            if epoch is not None or used.seconds[0] > DAY:
                known.append(self.start - used.offset + (epoch or 0.0))
        self.start_time = known[0] if known else None

    def recording(self):
        """What is known of the import, as tables of the vehicle file."""
        before = self.vehicle.rates  # those of the drive's own sources, of which this is a part
        return {
            "recording": {"start": None if self.start_time is None else round(self.start_time, 6)},
            "recording.units": {used.name: used.unit for used in self.used()},
            "recording.rates": {**before, **{used.role: min(round(used.hz, 2), before.get(used.role, used.hz)) for used in self.used()}},
            "recording.dropped": self.dropped,
        }

    def start_line(self):
        if self.start_time is None:
            return "start = unknown: no clock of the logs is a time of day"
        return f"start = {self.start_time:.6f} ({datetime.fromtimestamp(self.start_time, timezone.utc).isoformat(timespec='microseconds')})"

    def write(self, out):
        """Writes the drive and its vehicle file; on an error neither is left behind."""
        out = Path(out)
        beside = out.with_suffix(".toml")
        halves = [(path, path.with_name(f".{path.name}.{os.getpid()}")) for path in (out, beside)]
        try:
            with open(halves[0][1], "w", encoding="utf-8", newline="\n") as file:
                self.write_csv(file)
            halves[1][1].write_text(self.vehicle.text(self.recording()), encoding="utf-8")
            for path, half in halves:
                os.replace(half, path)
        except OSError as error:
            raise Refused(f"{out}: {error.strerror}") from None
        finally:
            for _, half in halves:
                with suppress(OSError):
                    half.unlink()
        return beside

    def write_csv(self, file):
        columns = [k for k in range(len(NAMES)) if k < 7 or self.seen[k]]
        file.write(",".join(NAMES[k] for k in columns) + "\n")
        form = ",".join(["%.2f"] + ["%.7f"] * 6 + ["%.8f" if k > 14 else "%.6f" for k in columns[7:]]) + "\n"
        for table in self.chunks():
            for row in table[:, columns].tolist():
                line = form % tuple(row)
                file.write(line.replace("nan", "") if "nan" in line else line)

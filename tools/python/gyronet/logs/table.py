"""Text tables by pandas: any CSV by a column map, exports of Xsens MT Manager, and EuRoC."""

import csv
import itertools
import re
import warnings

import numpy as np
import pandas

from gyronet import units
from gyronet.refused import Refused, listed
from gyronet.vehicle import CARRIED, COLUMNS, IMU_COLUMNS, NUMBERS, POSITION

# Names that common exports use for the same column in the same unit.
KNOWN = {"t_s": ["time_s", "timestamp_s", "timestamps"], **{name: [name.title()] for name in IMU_COLUMNS},
         "gnss_lat": ["latitude", "Latitude"], "gnss_lon": ["longitude", "Longitude"], "gnss_speed": ["ground_speed"]}
DIMENSION = {"t_s": "time", **dict(zip(IMU_COLUMNS, 3 * ["acceleration"] + 3 * ["rate"])), "gnss_lat": "angle", "gnss_lon": "angle"}
REMARKS = 1_000  # lines before the header
ROWS = 50_000  # in memory
NUMBER = re.compile(r"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|nan|inf)$", re.IGNORECASE)
COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?$")


class Header:
    """The columns of a table and how its rows are split: the last line of words before rows of numbers is the header."""

    def __init__(self, path):
        self.rate, before = None, []
        with open(path, encoding="utf-8-sig", errors="replace") as file:
            for self.lines, line in enumerate(itertools.islice(file, REMARKS)):
                line = line.strip("\r\n")
                if "DeviceTag" in line:
                    raise Refused(f"{path}: an Xsens DOT export, whose units differ by version; name its columns in the vehicle file")
                if found := re.search(r"Update Rate:\s*([\d.]+)", line):
                    self.rate = float(found[1]) or None
                if not line.strip():
                    continue
                self.separator = next((mark for mark in (";", "\t", ",") if mark in line), None)
                fields = self.split(line)
                self.commas = self.separator != "," and any(map(COMMA.match, fields))
                numbers = sum(bool(NUMBER.match(field.replace(",", ".") if self.commas else field)) for field in fields)
                if numbers >= 2 and numbers + fields.count("") > len(fields) / 2:
                    break
                before.append(line)
            else:
                raise Refused(f"{path}: unknown format: neither a bag, MCAP, ULog, MDF or CAN log, nor a table: none of its first"
                              f" {len(before)} lines is a row of numbers")
        self.names = self.split(before[-1].lstrip("#/ ")) if before else []
        if len(self.names) not in (len(fields), len(fields) - 1) or all(map(NUMBER.match, self.names)):
            raise Refused(f"{path}: no header: line {self.lines + 1} has numbers, and the line before it does not name its "
                          f"{len(fields)} columns; write such a line, for example t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z")
        # A unit may stand in brackets behind the name, as EuRoC writes it.
        found = {name: re.match(r"(.*\S)\s*[\[(]([^\])]+)[\])]$", name) for name in self.names}
        self.units = {name: match[2] for name, match in found.items() if match}

    def split(self, line):
        if self.separator is None:
            return line.split()
        return [field.strip() for field in next(csv.reader([line], delimiter=self.separator), [])]


class Columns:
    """Where our columns are in a table, and their scales."""

    def __init__(self, path, header, vehicle, flags, log):
        self.path, self.names, self.units, self.flags, self.vehicle = path, header.names, header.units, flags, vehicle
        log.columns = header.names
        found = {ours: log.find(ours, vehicle, self.column) for ours in COLUMNS}
        self.places = {ours: place for ours, place in found.items() if place is not None}
        for group in (IMU_COLUMNS[:3], IMU_COLUMNS[3:], POSITION):
            if missing := [ours for ours in group if ours not in self.places]:
                for ours in group:
                    if self.places.pop(ours, None) is not None and vehicle.column(ours):
                        raise Refused(f"{path}: {vehicle.path} names {ours}, but {missing[0]} is missing" + listed(self.names, "; the columns are "))
        self.scales = {ours: self.scale(ours, self.places[ours]) for ours in DIMENSION if ours in self.places}

    def column(self, name):
        """The index of a column; a leading # belongs to the header, and the unit in brackets may be left out."""
        for name in [name, *KNOWN.get(name, [])]:
            for at, own in enumerate(self.names):
                if name.lstrip("# ") in (own, re.sub(r"\s*[\[(][^\])]*[\])]$", "", own)) or name == own:
                    return at
        return None

    def unit(self, ours, place):
        return self.vehicle.unit(self.flags, ours, self.names[place]) or self.units.get(self.names[place])

    def scale(self, ours, place):
        name, dimension, unit = self.names[place], DIMENSION[ours], self.unit(ours, place)
        if not unit:
            return 1.0
        if dimension == "rate" and (units.find(unit) or [""])[0] == "angle" and name not in self.units:
            raise Refused(f"{self.path}: {name}: {unit} is an angle, not a rate; write {unit}/s")
        scale = units.scale(name, unit, [dimension], f"{dimension} column")[0]
        return scale / units.DEG if ours in POSITION else scale

    def add(self, log, seconds, rows):
        """Gives the columns of some rows to the log's channels."""
        def scaled(names):
            known = [name in self.places for name in names]
            columns = [rows[:, self.places[name]] * self.scales[name] if has else seconds * np.nan for name, has in zip(names, known)]
            return np.column_stack(columns), known

        (force, has_force), (rate, has_rate) = scaled(IMU_COLUMNS[:3]), scaled(IMU_COLUMNS[3:])
        halves = [half for half, has in ((force, has_force), (rate, has_rate)) if all(has)]
        if halves:
            kind = "imu" if len(halves) == 2 else "accel" if all(has_force) else "gyro"
            log.channel(kind, kind).extend(np.column_stack([seconds, *halves]))
        fix, has_fix = scaled(POSITION)
        if all(has_fix):
            known = np.isfinite(fix).all(axis=1)
            if (wrong := known & ((np.abs(fix[:, 0]) > 90) | (np.abs(fix[:, 1]) > 360))).any():
                latitude, longitude = fix[wrong][0]
                flags = " ".join(f"--unit {self.names[self.places[ours]]}=1e-7deg" for ours in POSITION)
                raise Refused(f"{self.path}: latitude {latitude:g}, longitude {longitude:g} are outside 90 and 360 degrees: another unit? {flags}")
            log.channel("position", "position").extend(np.column_stack([seconds, fix, np.full((len(fix), 3), np.nan)])[known])
        numbers = {ours: place for ours, place in self.places.items() if ours in NUMBERS}
        others = {name: at for at, name in enumerate(self.names) if name not in numbers and self.is_other(at, log)}
        for name, at in {**others, **numbers}.items():
            ours = next((ours for ours, place in numbers.items() if place == at), name)
            unit = self.unit(ours, at) or ("rad/s" if ours in NUMBERS and ours not in CARRIED else "")
            known = np.isfinite(rows[:, at])
            log.channel(name, "number", unit).extend(np.column_stack([seconds, rows[:, at]])[known])

    def is_other(self, at, log):
        """Whether a column is none of ours, or is wanted under its own name, too."""
        ours = [ours for ours, place in self.places.items() if place == at]
        return not ours or ours[0] in NUMBERS and log.wants(self.names[at])


class Clock:
    """The rows' times: a column, or a counter of an Xsens sensor, which wraps."""

    def __init__(self, path, columns, header, first, rate):
        self.period, self.last, self.turns = None, -np.inf, 0.0
        if "t_s" in columns.places:
            self.at, self.scale = columns.places["t_s"], columns.scales["t_s"]
            if header.names[self.at] == "PacketCounter":
                raise Refused(f"{path}: PacketCounter counts samples and is no time: take it out of [columns] and give --rate HZ")
            return
        for name, self.period, second in (("SampleTimeFine", 2.0**32, 1e4), ("PacketCounter", 65_536.0, rate or header.rate)):
            self.at = columns.column(name)
            if self.at is not None and np.isfinite(first[self.at]):
                if second is None:
                    raise Refused(f"{path}: {name} counts samples, and no update rate is written: give it with --rate HZ")
                self.scale = 1 / second
                return
        raise Refused(f'{path}: no time column; name it in the vehicle file: [columns] t_s = {{ name = "...", unit = "ms" }}'
                      + listed(header.names, "; the columns are "))

    def seconds(self, counts):
        if self.period:
            # A wrap steps back by more than half of the counter's range; a smaller step is a jump of the clock.
            turns = self.turns + self.period * np.cumsum(np.diff(counts, prepend=self.last) < -0.5 * self.period)
            self.last, self.turns = counts[-1], turns[-1]
            counts = counts + turns
        return self.scale * counts


def read(path, log, vehicle, flags, rate):
    header = Header(path)
    columns = Columns(path, header, vehicle, flags, log)
    count, clock = len(header.names), None
    seen = np.zeros(count + 1, bool)
    with open(path, encoding="utf-8-sig", errors="replace") as file, warnings.catch_warnings(record=True) as longer:
        warnings.simplefilter("always", pandas.errors.ParserWarning)
        list(itertools.islice(file, header.lines))
        # One more column takes what a separator at the end of a line makes.
        for frame in pandas.read_csv(file, sep=header.separator or r"\s+", header=None, names=range(count + 1), index_col=False, chunksize=ROWS,
                                     decimal="," if header.commas else ".", on_bad_lines="warn", skipinitialspace=True):
            rows = frame.apply(pandas.to_numeric, errors="coerce").to_numpy(float, copy=True)
            clock = clock or Clock(path, columns, header, rows[0], rate)
            if np.isnan(rows[:, clock.at]).all():  # dates, in UTC where they do not say
                dates = pandas.to_datetime(frame[clock.at], format="ISO8601", utc=True, errors="coerce")
                rows[:, clock.at] = (dates - pandas.Timestamp(0, tz="UTC")).dt.total_seconds() / clock.scale
            timed, whole = np.isfinite(rows[:, clock.at]), frame[count].isna().to_numpy()
            log.drop("rows without a time", np.count_nonzero(~timed & whole))
            log.drop("rows that are longer than the header", np.count_nonzero(~whole))
            rows = rows[timed & whole]
            seen |= np.isfinite(rows).any(axis=0)
            if len(rows):
                columns.add(log, clock.seconds(rows[:, clock.at]), rows)
    log.drop("rows that are longer than the header", sum(str(warning.message).count("Skipping line") for warning in longer))
    used = {at for at, name in enumerate(header.names) if at == clock.at or not columns.is_other(at, log) or log.wants(name)}
    for said, names in (("columns that are left out: ", [name for at, name in enumerate(header.names) if name and at not in used]),
                        ("columns without a number: ", [name for at, name in enumerate(header.names) if at in used and not seen[at]])):
        log.notes += [listed(names, said)] if names else []

"""Text tables by the csv module: any CSV by a column map, exports of Xsens MT Manager, EuRoC, and Gyroflow's .gcsv."""

import csv
import itertools
import math
import re
from pathlib import Path

from gyronet.logs import units
from gyronet.refused import Refused, listed

IMU_COLUMNS = ["acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"]
OWN_RATES = ["ref_gyr_z", "wheel1_rate", "wheel2_rate", "wheel3_rate", "wheel4_rate"]
# Names that common exports use for the same column in the same unit.
KNOWN = {
    "t_s": ["time_s", "timestamp_s", "timestamps"], "latitude": ["Latitude", "gnss_lat"], "longitude": ["Longitude", "gnss_lon"],
    "position_sigma": [], "ground_speed": [], "course": [], "course_sigma": [],
    **{name: [name.title()] for name in IMU_COLUMNS},
}
DIMENSION = {"t_s": "time", "latitude": "angle", "longitude": "angle", "position_sigma": "length", "ground_speed": "speed",
             "course": "angle", "course_sigma": "angle", **dict(zip(IMU_COLUMNS, 3 * ["acceleration"] + 3 * ["rate"]))}
REMARKS = 1_000  # lines before the header
NUMBER = re.compile(r"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|nan|inf)$", re.IGNORECASE)
COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?$")
GCSV = {"t": ("t_s", "tscale"), "gx": ("gyr_x", "gscale"), "gy": ("gyr_y", "gscale"), "gz": ("gyr_z", "gscale"),
        "ax": ("acc_x", "ascale"), "ay": ("acc_y", "ascale"), "az": ("acc_z", "ascale")}


class Header:
    """The columns of a table and how its rows are split: the last line of words before rows of numbers is the header."""

    def __init__(self, path, file):
        self.rate, self.settings, before = None, {}, []
        for line in itertools.islice(file, REMARKS):
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
            if len(fields) == 2:
                self.settings[fields[0]] = fields[1]
            before.append(line)
        else:
            if any("\0" in line or "\ufffd" in line for line in before) or not any(len(self.split(line)) > 1 for line in before):
                raise Refused(f"{path}: unknown format: neither a bag, MCAP, ULog, MDF or CAN log, nor a table with a header")
            raise Refused(f"{path}: a table without a row of numbers in its first {len(before)} lines")
        self.first = line
        words = self.split(before[-1].lstrip("#/ ")) if before else []
        if len(words) not in (len(fields), len(fields) - 1) or all(map(NUMBER.match, words)):
            raise Refused(f"{path}: no header: line {len(before) + 1} has numbers, and the line before it does not name its "
                          f"{len(fields)} columns; write such a line, for example t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z")
        # A unit may stand in brackets behind the name, as EuRoC writes it.
        self.names, self.units = words, {}
        for name in words:
            if found := re.match(r"(.*\S)\s*[\[(]([^\])]+)[\])]$", name):
                self.units[name] = found[2]
        self.gcsv = bool(before) and before[0].startswith("GYROFLOW IMU LOG")

    def split(self, line):
        if self.separator is None:
            return line.split()
        return [field.strip() for field in next(csv.reader([line], delimiter=self.separator), [])]

    def column(self, name):
        """The index of a column; a leading # belongs to the header, and the unit in brackets may be left out."""
        for at, own in enumerate(self.names):
            if name.lstrip("# ") in (own, re.sub(r"\s*[\[(][^\])]*[\])]$", "", own)) or name == own:
                return at
        return None


class Columns:
    """Where our columns are in a table, and their scales."""

    def __init__(self, path, header, vehicle, flags, several):
        self.path, self.header, self.flags, self.vehicle = path, header, flags, vehicle
        self.file = Path(path).name
        self.places = {}
        for ours, others in KNOWN.items():
            place = self.mapped(ours, several) if ours in vehicle.columns else None
            if place is None and ours not in vehicle.columns:
                place = next((at for at in map(header.column, [ours, *others]) if at is not None), None)
            if place is not None:
                self.places[ours] = (place, self.scale(ours, place))
        if header.gcsv:
            for at, name in enumerate(header.names):
                if name in GCSV:
                    ours, factor = GCSV[name]
                    unit = 9.80665 if factor == "ascale" else 1.0
                    self.places.setdefault(ours, (at, unit * float(header.settings.get(factor, 1.0))))

    def mapped(self, ours, several):
        """The index of a column that the vehicle file names, as NAME or FILE:NAME."""
        name = self.vehicle.columns[ours]["name"]
        if name.startswith(self.file + ":"):
            name = name[len(self.file) + 1:]
        at = self.header.column(name)
        if at is None and not several:
            raise Refused(f"{self.path}: no column {name}" + listed(self.header.names, "; the columns are "))
        return at

    def scale(self, ours, place):
        name = self.header.names[place]
        unit = self.flags.get(ours) or self.flags.get(name) or self.vehicle.columns.get(ours, {}).get("unit") or self.header.units.get(name)
        if not unit:
            return 1.0
        if DIMENSION[ours] == "rate" and (units.find(unit) or [""])[0] == "angle" and name not in self.header.units:
            raise Refused(f"{self.path}: {name}: {unit} is an angle, not a rate; write {unit}/s")
        scale = units.scale(name, unit, [DIMENSION[ours]], f"{DIMENSION[ours]} column")[0]
        return scale / units.DEG if ours in ("latitude", "longitude") else scale

    def others(self):
        """Columns that stay plain numbers: index, name and unit."""
        used = {place for place, _ in self.places.values()}
        for at, name in enumerate(self.header.names):
            if at not in used:
                unit = self.flags.get(name) or self.vehicle.unit_of(name) or self.header.units.get(name)
                yield at, name, unit or ("rad/s" if name in OWN_RATES else "")


class Counter:
    """A counter that wraps, in counts per second."""

    def __init__(self, at, period, second):
        self.at, self.period, self.second, self.last, self.turns = at, period, second, None, 0.0

    def seconds(self, row):
        count = row[self.at]
        # A wrap steps back by more than half of the counter's range; a smaller step is a jump of the clock.
        if self.last is not None and count < self.last - 0.5 * self.period:
            self.turns += self.period
        if not math.isnan(count):
            self.last = count
        return (self.turns + count) / self.second


def clock(path, columns, first, rate):
    """How a row's time is read: a column, or a counter of an Xsens sensor."""
    header = columns.header
    if "t_s" in columns.places:
        at, scale = columns.places["t_s"]
        if header.names[at] == "PacketCounter":
            raise Refused(f"{path}: PacketCounter counts samples and is no time: take it out of [columns] and give --rate HZ")
        return lambda row: scale * row[at]
    for name, period, second in (("SampleTimeFine", 2.0**32, 1e4), ("PacketCounter", 65_536.0, rate or header.rate)):
        at = header.column(name)
        if at is not None and not math.isnan(first[at]):
            if second is None:
                raise Refused(f"{path}: {name} counts samples, and no update rate is written: give it with --rate HZ")
            return Counter(at, period, second).seconds
    raise Refused(f'{path}: no time column; name it in the vehicle file: [columns] t_s = {{ name = "...", unit = "ms" }}'
                  + listed(header.names, "; the columns are "))


def number(field, commas):
    try:
        return float(field.replace(",", ".") if commas else field)
    except ValueError:
        return math.nan


def read(path, log, vehicle, flags, rate, several):
    with open(path, encoding="utf-8-sig", errors="replace", newline="") as file:
        header = Header(path, file)
        columns = Columns(path, header, vehicle, flags, several)
        rows = file if header.separator is None else csv.reader(file, delimiter=header.separator)
        rows = itertools.chain([header.split(header.first)], map(str.split, file) if header.separator is None else rows)
        if header.commas:
            log.notes.append("numbers with decimal commas")
        if header.gcsv and header.settings.get("orientation", "XYZ") != "XYZ":
            log.notes.append(f"orientation {header.settings['orientation']} is not applied: give the mounting in the vehicle file")
        try:
            take(path, log, header, columns, rows, rate)
        except csv.Error as error:
            raise Refused(f"{path}: line {getattr(rows, 'line_num', '?')}: not a table: {error}") from None


def take(path, log, header, columns, rows, rate):
    places, count, others, time = columns.places, len(header.names), list(columns.others()), None
    halves = [kind for kind, names in (("accel", IMU_COLUMNS[:3]), ("gyro", IMU_COLUMNS[3:])) if all(name in places for name in names)]
    kind = "imu" if len(halves) == 2 else halves[0] if halves else None
    wanted = {"imu": IMU_COLUMNS, "accel": IMU_COLUMNS[:3], "gyro": IMU_COLUMNS[3:], None: []}[kind]
    inertial = [places[name] for name in wanted]
    position = [places.get(name) for name in ("latitude", "longitude", "position_sigma", "ground_speed", "course", "course_sigma")]
    for row in rows:
        if len(row) == count + 1 and not row[-1].strip():
            row = row[:-1]
        if len(row) != count:
            if any(map(str.strip, row)):
                log.dropped["rows whose length differs from the header"] += 1
            continue
        row = [number(field, header.commas) for field in row]
        time = time or clock(path, columns, row, rate)
        seconds = time(row)
        if not math.isfinite(seconds):
            log.dropped["rows without a time"] += 1
            continue
        if kind:
            values = [scale * row[at] for at, scale in inertial]
            if all(map(math.isfinite, values)):
                log.add(kind, kind, seconds, values)
            else:
                log.dropped["rows without all numbers of the IMU"] += 1
        if position[0] and position[1]:
            fix = [scale * row[at] if place else math.nan for place in position for at, scale in [place or (0, 0.0)]]
            if math.isfinite(fix[0]) and math.isfinite(fix[1]):
                if abs(fix[0]) > 90 or abs(fix[1]) > 360:
                    raise Refused(f"{path}: latitude {fix[0]:g}, longitude {fix[1]:g} are outside 90 and 360 degrees: another unit? "
                                  "--unit latitude=1e-7deg --unit longitude=1e-7deg")
                log.add("position", "position", seconds, fix)
        for at, name, unit in others:
            if math.isfinite(row[at]):
                log.add(name, "number", seconds, (row[at],), unit)

"""The vehicle file (TOML) beside a log or a drive: mounting, wheels, names of channels, DBC file and columns."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np

from gyronet import units
from gyronet.refused import Refused

RADIUS = 0.289  # m; that of the recorded car
ZERO = {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0}
KEYS = {
    "mounting": {**ZERO, "applied": False},
    "wheels": dict.fromkeys(["radius_m", "track_m", "front_left", "front_right", "rear_left", "rear_right"]),
    "signals": dict.fromkeys(["imu", "odometry", "position", "reference_rate"]),
    "bus": {"dbc": None},
}
WHEELS = ["front_right", "rear_right", "front_left", "rear_left"]  # the order of a drive's columns
IMU_COLUMNS = ["acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"]
WHEEL_COLUMNS = ["wheel1_rate", "wheel2_rate", "wheel3_rate", "wheel4_rate"]
POSITION = ["gnss_lat", "gnss_lon"]
# What a drive has besides, as it is: column, and dimension of its unit.
CARRIED = {"ref_yaw": "angle", "ref_yaw_sigma": "angle", "gnss_speed": "speed", "course": "angle", "course_sigma": "angle", "temp_c": "temperature"}
NUMBERS = ["ref_gyr_z", *WHEEL_COLUMNS, *CARRIED]  # columns that are channels of their own
COLUMNS = ["t_s", *IMU_COLUMNS, *POSITION, *NUMBERS]  # of a drive: the keys of [columns]


class Vehicle:
    def __init__(self):
        self.path, self.columns, self.start, self.turned, self.rates = None, {}, None, None, {}
        for table, keys in KEYS.items():
            setattr(self, table, dict(keys))

    @classmethod
    def read(cls, path):
        vehicle, path = cls(), Path(path)
        try:
            text = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise Refused(f"{path}: not a vehicle file: {error}") from None
        vehicle.path = path
        if isinstance(text.get("mounting"), dict) and text["mounting"].get("applied") is True:
            # As imports wrote it before they wrote what the rows have been turned by.
            turned = {**text.pop("mounting")}
            text.setdefault("recording", {})["mounting"] = {key: turned[key] for key in turned if key in ZERO}
        for table, entries in text.items():
            if table == "columns" and isinstance(entries, dict):
                vehicle.columns = {name: _column(path, name, entry) for name, entry in entries.items()}
                continue
            if table == "recording" and isinstance(entries, dict):
                vehicle.start, vehicle.rates = entries.get("start"), entries.get("rates", {})
                vehicle.turned = {**ZERO, **entries.get("mounting", {})}
                continue
            if table not in KEYS or not isinstance(entries, dict):
                raise Refused(f"{path}: unknown table [{table}]; known are {', '.join([*KEYS, 'columns'])}")
            for key, value in entries.items():
                if key not in KEYS[table]:
                    raise Refused(f"{path}: unknown key {table}.{key}; known are {', '.join(KEYS[table])}")
                numeric = key.endswith(("_deg", "_m"))
                kind = (int, float) if numeric else bool if key == "applied" else str
                if not isinstance(value, kind) or numeric and isinstance(value, bool):
                    raise Refused(f"{path}: {table}.{key} = {value!r}: not a {'number' if numeric else kind.__name__}")
                if key.endswith("_m") and not 0.01 <= value < 10 or key.endswith("_deg") and not abs(value) <= 360:
                    raise Refused(
                        f"{path}: {table}.{key} = {value}: must be"
                        f" {'0.01 to 10 m' if key.endswith('_m') else 'at most 360 degrees'}"
                    )
                getattr(vehicle, table)[key] = value
        if vehicle.bus["dbc"]:
            vehicle.bus["dbc"] = str(path.parent / vehicle.bus["dbc"])
        return vehicle

    def of_log(self):
        """The vehicle as a log needs it: what a drive's rows have been turned by comes first."""
        if self.turned:
            self.mounting, self.turned, self.start, self.rates = self.whole(), None, None, {}

    def whole(self):
        """The mounting of the sensor: what the rows have been turned by, then what they still need."""
        m = _matrix(self.mounting) @ _matrix(self.turned or ZERO)
        level = np.hypot(m[2, 1], m[2, 2])
        roll, yaw = (np.arctan2(m[2, 1], m[2, 2]), np.arctan2(m[1, 0], m[0, 0])) if level > 1e-6 else (0.0, np.arctan2(-m[0, 1], m[1, 1]))
        angles = np.round(np.degrees([roll, np.arctan2(-m[2, 0], level), yaw]), 6) + 0.0
        return dict(zip(ZERO, angles.tolist()))

    def forget_names(self):
        """Keeps mounting and dimensions only: the channel names are those of the original logs."""
        for table in ("signals", "bus"):
            setattr(self, table, dict(KEYS[table]))
        self.wheels.update(dict.fromkeys(WHEELS))
        self.columns = {}

    @property
    def radius(self):
        return self.wheels["radius_m"] or RADIUS

    def unit(self, flags, ours, name):
        """The unit that is given for a column of ours, by its own name or the log's."""
        return flags.get(ours) or flags.get(name) or self.columns.get(ours, {}).get("unit")

    def column(self, ours):
        """The name of a log's column that [columns] gives for ours, if it does."""
        return self.columns.get(ours, {}).get("name")

    def turn(self, vectors):
        """Rows of x, y, z from the sensor's axes to the vehicle's."""
        return vectors @ _matrix(self.mounting).T if any(self.mounting[name] for name in ZERO) else vectors

    def text(self, recording):
        """The file of a drive whose rows are in the vehicle's axes; `recording` holds what is known of the import."""
        tables = {**{table: getattr(self, table) for table in KEYS}, **recording, "mounting": ZERO, "recording.mounting": self.whole()}
        lines = []
        for table, entries in tables.items():
            lines += [f"[{table}]", *(f"{_key(key)} = {_value(value)}" for key, value in entries.items() if value is not None), ""]
        lines += ["[columns]"]
        for name, column in self.columns.items():
            fields = ", ".join(f"{key} = {_value(value)}" for key, value in column.items() if value is not None)
            lines.append(f"{_key(name)} = {{ {fields} }}")
        return "\n".join(lines) + "\n"


def _column(path, key, entry):
    """Name and unit of a column of ours; under the name of a log's column or channel, its unit alone."""
    entry = {"name": entry} if isinstance(entry, str) else entry
    if not isinstance(entry, dict) or not entry or set(entry) - {"name", "unit"} or not all(isinstance(value, str) and value for value in entry.values()):
        raise Refused(f'{path}: columns.{key}: write "NAME" or {{ name = "...", unit = "..." }}')
    if key not in COLUMNS and entry.get("name") == key:
        entry = {"unit": entry["unit"]} if "unit" in entry else {}
    if key not in COLUMNS and "name" in entry or not entry:
        raise Refused(f"{path}: unknown key columns.{key}; known are {', '.join(COLUMNS)}; a log's own name has a unit alone: NAME = {{ unit = \"km/h\" }}")
    for unit in entry.get("unit", "s").split(", "):
        if not units.find(unit):
            raise Refused(f"{path}: columns.{key}: unknown unit {unit}; {units.LISTED}")
    return entry


def _matrix(mounting):
    (sr, sp, sy), (cr, cp, cy) = ([turn(np.radians(mounting[name])) for name in ZERO] for turn in (np.sin, np.cos))
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], [-sp, cp * sr, cp * cr]])


def _key(name):
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def _value(value):
    return json.dumps(value, ensure_ascii=False)

"""The vehicle file (TOML) beside a log or a drive: mounting, wheels, names of channels, DBC file and columns."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np

from gyronet.refused import Refused

RADIUS = 0.289  # m; that of the recorded car
KEYS = {
    "mounting": {"roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.0, "applied": False},
    "wheels": dict.fromkeys(["radius_m", "track_m", "front_left", "front_right", "rear_left", "rear_right"]),
    "signals": dict.fromkeys(["imu", "odometry", "position", "reference_rate"]),
    "bus": {"dbc": None},
}
WHEELS = ["front_right", "rear_right", "front_left", "rear_left"]  # the order of a drive's columns


class Vehicle:
    def __init__(self):
        self.path, self.columns, self.start = None, {}, None
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
        for table, entries in text.items():
            if table == "columns" and isinstance(entries, dict):
                vehicle.columns = {name: _column(path, name, entry) for name, entry in entries.items()}
                continue
            if table == "recording" and isinstance(entries, dict) and isinstance(entries.get("start", 0.0), (int, float)):
                vehicle.start = entries.get("start")
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

    def forget_names(self):
        """Keeps mounting and dimensions only: the channel names are those of the original logs."""
        for table in ("signals", "bus"):
            setattr(self, table, dict(KEYS[table]))
        self.wheels.update(dict.fromkeys(WHEELS))
        self.columns = {}

    @property
    def radius(self):
        return self.wheels["radius_m"] or RADIUS

    def unit_of(self, name):
        """The unit that [columns] gives a channel of that name."""
        return next((column.get("unit") for column in self.columns.values() if column["name"] == name), None)

    def turn(self, vectors):
        """Rows of x, y, z from the sensor's axes to the vehicle's, unless they are there already."""
        if self.mounting["applied"]:
            return vectors
        roll, pitch, yaw = (np.radians(self.mounting[f"{name}_deg"]) for name in ("roll", "pitch", "yaw"))
        x, y, z = vectors.T
        y, z = np.cos(roll) * y - np.sin(roll) * z, np.sin(roll) * y + np.cos(roll) * z
        x, z = np.cos(pitch) * x + np.sin(pitch) * z, np.cos(pitch) * z - np.sin(pitch) * x
        return np.column_stack([np.cos(yaw) * x - np.sin(yaw) * y, np.sin(yaw) * x + np.cos(yaw) * y, z])

    def text(self, recording):
        """The file of a drive whose rows are in the vehicle's axes; `recording` holds what is known of the import."""
        tables = {**{table: getattr(self, table) for table in KEYS}, **recording}
        tables["mounting"] = {**self.mounting, "applied": True}
        lines = []
        for table, entries in tables.items():
            lines += [f"[{table}]", *(f"{_key(key)} = {_value(value)}" for key, value in entries.items() if value is not None), ""]
        lines += ["[columns]"]
        for name, column in self.columns.items():
            fields = ", ".join(f"{key} = {_value(value)}" for key, value in column.items() if value is not None)
            lines.append(f"{_key(name)} = {{ {fields} }}")
        return "\n".join(lines) + "\n"


def _column(path, name, entry):
    if not isinstance(entry, dict) or "name" not in entry or set(entry) - {"name", "unit"}:
        raise Refused(f'{path}: columns.{name}: write {{ name = "...", unit = "..." }}')
    return entry


def _key(name):
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def _value(value):
    return json.dumps(value, ensure_ascii=False)

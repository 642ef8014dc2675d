"""Units by the names that DBC files, tables and MDF files give them. What is not known here is refused, never guessed."""

import math
import re

from gyronet.refused import Refused

DEG = math.pi / 180
# Dimension, value in SI, and names; the first name is ours.
KNOWN = [
    ("time", 1.0, "s|sec|second|seconds"),
    ("time", 1e-3, "ms|msec"),
    ("time", 1e-6, "us|µs|usec"),
    ("time", 1e-9, "ns|nsec"),
    ("acceleration", 1.0, "m/s^2|m/s2|m/s²|m/s/s|m/(s^2)|m/sec^2|ms^-2|unit_meterpersecondsquared"),
    ("acceleration", 9.80665, "g|g0|gee"),
    ("acceleration", 9.80665e-3, "mg"),
    ("rate", 1.0, "rad/s|rad/sec|rads^-1|1rad/s|radian/s|radians/s|unit_radianpersecond|unit_radpersecond"),
    ("rate", DEG, "deg/s|deg/sec|dps|degree/s|degrees/s|degrees/second|°/s|°/sec|grad/s|grad/sec|unit_degreepersecond"
                  "|unit_degreofarcpersecon|unit_degreofarcpersecond|unit_degreeofarcpersecond|degs^-1"),
    ("rate", DEG / 3600, "deg/h|°/h"),
    ("rate", 2 * math.pi / 60, "rpm|1/min|u/min|rev/min|r/min|min^-1|unit_revolutionperminute"),
    ("speed", 1.0, "m/s|m/sec|mps|ms^-1|unit_meterpersecond|unit_metrepersecond"),
    ("speed", 1 / 3.6, "km/h|kph|kmh|km/hr|kmph|km^h|kmh^-1|kilometer/h|unit_kilometerperhour|unit_kilometrperhour"
                       "|unit_kilometreperhour|unit_kilomperhour"),
    ("speed", 0.44704, "mph|mi/h|unit_mileperhour"),
    ("angle", 1.0, "rad"),
    ("angle", DEG, "deg|°|degree|degrees"),
    ("angle", 1e-7 * DEG, "1e-7deg|1e-7°|dege7|deg*1e7|1e7deg"),
    ("temperature", 1.0, "degc|°c|c|celsius|degcelsius"),
]
BY_NAME = {name: (kind, scale, names.split("|")[0]) for kind, scale, names in KNOWN for name in names.split("|")}
EXAMPLES = {"wheel": "km/h", "rate": "deg/s", "speed": "km/h", "time": "ms", "acceleration": "g", "angle": "1e-7deg", "temperature": "degC"}
LISTED = "known are " + ", ".join(names.split("|")[0] for _, _, names in KNOWN)


def find(unit):
    """Dimension, scale to SI and our name of a unit; None for one that is not known."""
    return BY_NAME.get(re.sub(r"\s+", "", (unit or "").strip().lower()))


def scale(name, unit, dimensions, what):
    """The scale to SI of a channel in one of the dimensions, its dimension and the unit's name."""
    found = find(unit)
    if found and found[0] in dimensions:
        return found[1], found[0], found[2]
    example = EXAMPLES["wheel" if "speed" in dimensions and "rate" in dimensions else dimensions[0]]
    said = f'the unit "{unit}" is not that of a {what}' if (unit or "").strip() else f"a {what} without a unit"
    said = f'the unit "{unit}" is not known' if (unit or "").strip() and not found else said
    raise Refused(f"{name}: {said}; give it: --unit {name}={example}")


class Flags(dict):
    """The units of --unit and of a vehicle file, by name and by (name, dimension); remembers which were asked for."""

    def __init__(self, flags=()):
        super().__init__()
        self.asked, self.of_file = set(), {}
        for flag in flags:
            name, equals, unit = flag.rpartition("=")
            if not equals or not name:
                raise Refused(f"--unit {flag}: write NAME=UNIT, such as WHEELS.FL=km/h")
            if not find(unit):
                raise Refused(f"--unit {flag}: unknown unit; {LISTED}")
            self[name] = self[name, find(unit)[0]] = unit

    def add(self, name, said, path):
        """Units of a channel or column by a vehicle file, where --unit gives none."""
        for unit in said.split(", "):
            key = name, find(unit)[0]
            if key not in self:
                self[key] = unit
                self.setdefault(name, unit)
                self.of_file[key] = path

    def get(self, key, default=None):
        self.asked.add(key)
        return super().get(key, default)

    def check(self, unused=()):
        """Refuses a unit that nothing asked for; a vehicle file may have those of channels that are not used."""
        for key in (key for key in self if isinstance(key, tuple)):
            path, (name, _) = self.of_file.get(key), key
            if not self.asked & {name, key} and not (path and name in unused):
                said = f"{path}: the unit {self[key]} of columns.{name}" if path else f"--unit {name}={self[key]}"
                raise Refused(f"{said}: no channel or column of that name is used with such a unit")

"""MDF files by asammdf: signals under their names; recorded CAN frames by python-can's reader of MF4."""

import re

import numpy as np
from asammdf import MDF

from gyronet import units
from gyronet.logs import can
from gyronet.vehicle import IMU_COLUMNS, NUMBERS, POSITION
from gyronet.refused import Refused, listed


def read(path, log, bus, vehicle, flags):
    try:
        with MDF(str(path)) as mdf:
            if any("CAN_DataFrame" in name for name in mdf.channels_db):
                can.read(path, "mf4", log, bus)
            else:
                Signals(path, mdf, vehicle, flags).give(log)
    except Refused:
        raise
    except Exception as error:  # asammdf raises whatever damaged blocks provoke
        reason = re.sub(r"'?<mmap[^']*'?", "it", " ".join(str(error).split()))
        raise Refused(f"{path}: asammdf cannot read this MDF file: {reason}; finalise it with the logger's or asammdf's tools") from None


class Signals:
    def __init__(self, path, mdf, vehicle, flags):
        self.path, self.mdf, self.vehicle, self.flags = path, mdf, vehicle, flags
        self.start = mdf.start_time.timestamp() if mdf.start_time else 0.0

    def get(self, name):
        """Times, values and unit of the only signal of that name; numbers where a description gives them a text."""
        places = self.mdf.channels_db[name]
        if len(places) > 1:
            raise Refused(f"{self.path}: {len(places)} signals are named {name}")
        signal = self.mdf.get(name, *places[0], raw=True, ignore_invalidation_bits=False).physical(ignore_value2text_conversions=True)
        if signal.samples.dtype.kind not in "biuf":
            raise Refused(f"{self.path}: {name}: texts, not numbers")
        master = self.mdf.groups[places[0][0]].channels[self.mdf.masters_db[places[0][0]]]
        unit = self.flags.get("t_s") or self.vehicle.columns.get("t_s", {}).get("unit") or master.unit or "s"
        scale = units.scale(f"the time of {name}", unit, ["time"], "time")[0]
        return scale * signal.timestamps + self.start, signal.samples.astype(float), signal.unit

    def give(self, log):
        log.columns, log.mapped = sorted(self.mdf.channels_db), {"t_s"}  # each group of signals has its time
        names = {ours: log.find(ours, self.vehicle, lambda name: name if name in self.mdf else None) for ours in [*IMU_COLUMNS, *POSITION, *NUMBERS]}
        for half, kind, dimension in ((IMU_COLUMNS[:3], "accel", "acceleration"), (IMU_COLUMNS[3:], "gyro", "rate"), (POSITION, "position", "angle")):
            if all(names[ours] for ours in half):
                axes, columns = [self.get(names[ours]) for ours in half], []
                if any(len(axis[0]) != len(axes[0][0]) or (axis[0] != axes[0][0]).any() for axis in axes):
                    raise Refused(f"{self.path}: {', '.join(names[ours] for ours in half)} have different time stamps")
                for ours, (_, values, unit) in zip(half, axes):
                    unit = self.vehicle.unit(self.flags, ours, names[ours]) or unit or ("deg" if kind == "position" else "")
                    columns.append(values * units.scale(names[ours], unit, [dimension], f"{kind} column")[0])
                if kind == "position":
                    columns = [*np.degrees(columns), *np.full((3, len(columns[0])), np.nan)]
                log.channel(kind, kind).extend(np.column_stack([axes[0][0], *columns]))
        signals = {ours: names[ours] for ours in NUMBERS if names[ours]}
        for ours, name in {**{name.rpartition(":")[2]: name.rpartition(":")[2] for name in log.wanted or ()}, **signals}.items():
            if name in self.mdf and ours not in log.channels:
                seconds, values, unit = self.get(name)
                log.channel(ours, "number", self.vehicle.unit(self.flags, ours, name) or unit).extend(np.column_stack([seconds, values]))
        others = set(self.mdf.channels_db) - {*log.channels, *names.values(), "t", "time"}
        log.passed.update({f"MDF signal {name}": 1 for name in sorted(others)[:64]})
        if not log.channels:
            raise Refused(f"{self.path}: none of the signals is named in the vehicle file ([columns] gyr_x = {{ name = ... }})"
                          + listed(sorted(others), "; there are "))

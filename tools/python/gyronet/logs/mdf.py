"""MDF files by asammdf: signals under their names; recorded CAN frames by python-can's reader of MF4."""

import re

import numpy as np
from asammdf import MDF

from gyronet import units
from gyronet.logs import can
from gyronet.logs.select import IMU_COLUMNS
from gyronet.refused import Refused, listed


def read(path, log, bus, vehicle, flags):
    try:
        mdf = MDF(str(path))
    except Exception as error:  # asammdf raises whatever damaged blocks provoke
        reason = re.sub(r"'?<mmap[^']*'?", "it", " ".join(str(error).split()))
        raise Refused(f"{path}: asammdf cannot read this MDF file: {reason}; finalise it with the logger's or asammdf's tools") from None
    with mdf:
        if any("CAN_DataFrame" in name for name in mdf.channels_db):
            can.read(path, "mf4", log, bus)
            return
        start = mdf.start_time.timestamp() if mdf.start_time else 0.0
        names = {ours: vehicle.columns.get(ours, {}).get("name", ours) for ours in IMU_COLUMNS}
        for half, kind in ((IMU_COLUMNS[:3], "accel"), (IMU_COLUMNS[3:], "gyro")):
            if all(names[ours] in mdf for ours in half):
                dimension = "acceleration" if kind == "accel" else "rate"
                axes = [_signal(mdf, path, names[ours]) for ours in half]
                if any(len(axis) != len(axes[0]) or (axis.timestamps != axes[0].timestamps).any() for axis in axes):
                    raise Refused(f"{path}: {', '.join(names[ours] for ours in half)} have different time stamps")
                scaled = []
                for ours, axis in zip(half, axes):
                    unit = flags.get(ours) or flags.get(axis.name) or vehicle.columns.get(ours, {}).get("unit") or axis.unit
                    scaled.append(axis.samples.astype(float) * units.scale(axis.name, unit, [dimension], f"{kind} column")[0])
                log.channel(kind, kind).extend(np.column_stack([axes[0].timestamps + start, *scaled]))
        for name in log.wanted or ():
            name = name.rpartition(":")[2]
            if name in mdf and name not in log.channels:
                signal = _signal(mdf, path, name)
                log.channel(name, "number", signal.unit).extend(
                    np.column_stack([signal.timestamps + start, signal.samples.astype(float)]))
        others = [name for name in mdf.channels_db if name not in log.channels and name not in names.values() and name not in ("t", "time")]
        log.passed.update({f"MDF signal {name}": 1 for name in others[:64]})
        if not log.channels:
            raise Refused(f"{path}: none of the signals is named in the vehicle file ([columns] gyr_x = {{ name = ... }})"
                          + listed(sorted(others), "; there are "))


def _signal(mdf, path, name):
    places = mdf.channels_db[name]
    if len(places) > 1:
        raise Refused(f"{path}: {len(places)} signals are named {name}")
    return mdf.get(name, *places[0], ignore_invalidation_bits=False)

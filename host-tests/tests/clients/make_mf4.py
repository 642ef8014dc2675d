"""Makes an MF4 of a drive with asammdf: the IMU in one group, a rear wheel every 20 ms, on stamps of its own, in another.

usage: make_mf4.py DRIVE.csv FILE.mf4
"""

import csv
import sys

import numpy as np
from asammdf import MDF, Signal

with open(sys.argv[1]) as file:
    rows = list(csv.DictReader(file))


def signal(column, name, unit, scale=1.0, step=1, late=0.0):
    values = np.array([scale * float(row[column]) for row in rows[::step]])
    return Signal(values, np.array([float(row["t_s"]) for row in rows[::step]]) + late, name=name, unit=unit)


IMU = [(f"{kind}_{axis}", unit) for kind, unit in (("acc", "m/s^2"), ("gyr", "rad/s")) for axis in "xyz"]
mdf = MDF(version="4.10")
mdf.append([signal(name, f"IMU_{name}", unit) for name, unit in IMU])
mdf.append([signal("wheel2_rate", "WheelSpeedRR", "km/h", scale=0.3 * 3.6, step=2, late=0.003)])
mdf.save(sys.argv[2], overwrite=True)

"""Drives in our CSV, made for tests: three seconds at rest, then turns, and a gyro error that the accelerometer tells."""

import numpy as np


def write_drive(path, seconds=30, seed=0):
    """Writes a drive whose gyro error follows the vertical force."""
    random = np.random.default_rng(seed)
    rows = 100 * seconds
    moving = np.arange(rows) >= 300
    force = random.normal(0, 0.3, (rows, 3)) * moving[:, None] + [0, 0, 9.8]
    truth = 0.3 * np.sin(np.arange(rows) / 150) * moving
    rate = random.normal(0, 0.001, (rows, 3))
    rate[:, 2] += truth + 0.02 * (force[:, 2] - 9.8)
    header = "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,ref_gyr_z"
    table = np.column_stack([np.arange(rows) / 100, force, rate, truth])
    np.savetxt(path, table, "%.8f", ",", header=header, comments="")
    return path

"""The heading of a drive by the gyro alone and by the board: python example.py DRIVE.csv"""

import sys

import numpy as np

from gyronet import Coprocessor

if len(sys.argv) != 2:
    sys.exit(__doc__)
path, names = sys.argv[1], ["wheel1_rate", "wheel2_rate", "wheel3_rate", "wheel4_rate"]
try:
    drive = np.atleast_1d(np.genfromtxt(path, delimiter=",", names=True))
    times, *imu = (drive[name] for name in ("t_s", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"))
    recorded = [name in drive.dtype.names for name in names]
    wheels = np.column_stack([drive[name] if has else np.full(len(drive), np.nan) for name, has in zip(names, recorded)])
except (OSError, IndexError, TypeError, ValueError) as error:
    sys.exit(f"{path}: not a drive: {str(error).splitlines()[0]}")

board = Coprocessor(wheels=recorded)
try:
    steps = board.run(times, np.column_stack(imu), wheels)
except ValueError as error:  # it starts in motion
    sys.exit(f"{path}: {error}")

sent = steps[np.isfinite(steps["delayed"]) & (steps["delayed_status"] != 0)]
if not len(sent):
    sys.exit(f"{path}: {len(drive)} rows, of which none has a corrected rate: it needs 3 s at rest first")
gyro = 0.01 * np.cumsum(sent["gyro"])
print(f"bias of the gyro {np.degrees(board.gyro_bias[2]):+.3f} deg/s, {len(sent)} corrected rates")
print(f"yaw at the end: {np.degrees(sent['yaw'][-1]):.2f} deg by the board, {np.degrees(gyro[-1]):.2f} deg by the gyro alone")
if "ref_gyr_z" in drive.dtype.names:
    truth = 0.01 * np.nansum(drive["ref_gyr_z"][sent["row"]])
    print(f"true yaw {np.degrees(truth):.2f} deg, expected error of a rate {np.degrees(np.nanmedian(sent['delayed_sigma'])):.4f} deg/s")

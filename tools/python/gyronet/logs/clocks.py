"""Clocks of several files on that of the gyro, and a look at whether each source of a yaw rate agrees with the gyro."""

import numpy as np

from gyronet.logs import align, grid
from gyronet.refused import Refused

LATE = 0.5  # s: an offset on one clock that is worth a word


def yaw_sources(drive):
    """Yaw rates beside the gyro's: channel, what it is, times and rate."""
    for used in filter(None, (drive.reference, drive.odometry)):
        yield used, used.name, used.yaw(drive.vehicle, align.LONGEST)
    for right, left in ((drive.wheels[1], drive.wheels[3]), (drive.wheels[0], drive.wheels[2])):
        if right and left and right.file == left.file:
            begin, end = max(right.span()[0], left.span()[0]), min(right.span()[1], left.span()[1])
            times = begin + grid.DT * np.arange(max(min(end - begin, align.LONGEST) / grid.DT, 1.0))
            right_speed, left_speed = (wheel.at(times)[:, 0] * (drive.vehicle.radius if wheel.dimension == "rate" else 1.0) for wheel in (right, left))
            rate = np.column_stack([times, (right_speed - left_speed) / (drive.vehicle.wheels["track_m"] or 1.5)])
            yield right, "the difference of the wheels", rate[np.isfinite(rate[:, 1])]
    if drive.position and len(drive.courses) > 1:
        step = np.diff(drive.courses[:, :2], axis=0)
        middle = drive.courses[1:, 0] - 0.5 * step[:, 0] + drive.position.offset
        yield drive.position, "the change of the course", np.column_stack([middle, step[:, 1] / step[:, 0]])[step[:, 0] < 3.0]


def settle(drive, logs, request):
    """Offsets of the other files, and remarks about sources that disagree with the gyro in time or scale."""
    gyro, done, name = None, set(), drive.gyro.name
    for used, what, rate in yaw_sources(drive):
        gyro = drive.gyro.yaw(drive.vehicle, align.LONGEST) if gyro is None else gyro
        found, why = align.offset(gyro, rate)
        foreign = used.file != drive.gyro.file and not request.same_clock and used.file not in done
        if foreign and found is None:
            raise Refused(f"{logs[used.file].path}: the clock cannot be aligned with that of {logs[drive.gyro.file].path}: {why}; "
                          "files of one clock: --same-clock")
        if found is None:
            continue
        seconds, correlation, scale = found
        if scale and 45 < 1 / abs(scale) < 70:
            raise Refused(f"{name}: the gyro turns {1 / abs(scale):.1f} times as much as {what}: degrees per second? --unit {name}=deg/s")
        if foreign:
            done.add(used.file)
            for other in drive.used():
                if other.file == used.file and other.name not in request.offsets:
                    other.offset += seconds
            drive.report.append(f"{logs[used.file].path}: clock moved by {seconds:+.3f} s, where {what} agrees with the gyro"
                                f" (correlation {correlation:.3f})")
        elif used.file not in done and abs(seconds) > LATE and correlation > 0.9 and used.role != "reference rate":
            hint = " (GPS time against UTC?)" if 17.0 < abs(seconds) < 19.0 else ""
            drive.warnings.append(f"{used.name}: {what} agrees with the gyro only when moved by {seconds:+.2f} s{hint} (correlation"
                                  f" {correlation:.3f}): --offset {used.name}={seconds:.2f}")
    lost = {used.file for used in drive.used()} - done - {drive.gyro.file}
    if lost and not request.same_clock:
        raise Refused(f"{logs[min(lost)].path}: the clock cannot be aligned with that of {logs[drive.gyro.file].path}: it has no"
                      " yaw rate to compare; name a channel with one, or pass --same-clock")

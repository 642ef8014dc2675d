"""PX4 ULog files by pyulog. The body's axes x forward, y right, z down become y left, z up."""

import contextlib
import io

import numpy as np
from pyulog import ULog

from gyronet.refused import Refused

FLIP = np.array([1.0, -1.0, -1.0])
WANTED = ["sensor_combined", "sensor_gyro", "sensor_accel", "vehicle_gps_position", "sensor_gps", "wheel_encoders"]


class Counted(io.BufferedReader):
    """A file that notes where a read found less than it asked for, other than at its end."""

    short = None

    def read(self, size=-1):
        data = super().read(size)
        if 0 < len(data) < size or not data and size > 3:
            self.short = self.tell() - len(data)
        return data


def read(path, log, bus):
    file = Counted(io.FileIO(path))
    try:
        with file, contextlib.redirect_stdout(None):  # pyulog prints what `file_corruption` says
            ulog = ULog(file, WANTED, disable_str_exceptions=True)
    except Exception as error:  # pyulog raises whatever damaged bytes provoke
        raise Refused(f"{path}: not a readable ULog: {error}") from None
    if file.short:
        log.dropped[f"damaged or truncated: the last record, at byte {file.short}, is longer than the file"] += 1
    if ulog.file_corruption:
        log.dropped["the file is damaged; reading went on where pyulog found the next record"] += 1
    for topic in ulog.data_list:
        channel = topic.name if topic.multi_id == 0 else f"{topic.name}.{topic.multi_id}"
        try:
            seconds = 1e-6 * topic.data["timestamp"].astype(float)
            for name, kind, values, unit in take(topic.name, topic.data, seconds, log):
                log.channel(channel + name, kind, unit).extend(np.column_stack([seconds, values]))
        except KeyError as error:
            log.dropped[f"{channel}: no field {error.args[0]}"] += 1


def take(name, data, seconds, log):
    def fields(*names):
        return np.column_stack([data[field].astype(float) for field in names])

    if name == "sensor_combined":
        force = fields(*(f"accelerometer_m_s2[{k}]" for k in range(3))) * FLIP
        yield "", "imu", np.hstack([force, fields(*(f"gyro_rad[{k}]" for k in range(3))) * FLIP]), ""
    elif name in ("sensor_gyro", "sensor_accel"):
        yield "", "gyro" if name == "sensor_gyro" else "accel", fields("x", "y", "z") * FLIP, ""
    elif name == "wheel_encoders":
        for field in sorted(data):
            if field.startswith("wheel_speed["):
                yield f"/{field}", "number", fields(field), "rad/s"
    else:
        degrees = fields("latitude_deg", "longitude_deg") if "latitude_deg" in data else 1e-7 * fields("lat", "lon")
        degrees[data["fix_type"] < 2] = np.nan
        unknown = np.full(len(seconds), np.nan)
        known = np.column_stack([data.get(field, unknown).astype(float) for field in ("vel_m_s", "cog_rad", "c_variance_rad")])
        # Despite its name, c_variance_rad holds the receiver's standard deviation.
        yield "", "position", np.hstack([degrees, known]), ""
        utc = data.get("time_utc_usec")
        if utc is not None and log.epoch is None and (at := np.flatnonzero(utc > 1e15)).size:
            log.epoch = float(1e-6 * utc[at[0]] - seconds[at[0]])

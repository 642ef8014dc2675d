"""`correct`: a bag whose IMU has the yaw rate that the board computes, and the board's quality beside it."""

import struct

import numpy as np

from gyronet import Coprocessor, bags
from gyronet.logs.drive import NAMES
from gyronet.progress import bar
from gyronet.refused import Refused

# A rate is corrected only where the rows of the board are this close, s.
NEAR = 0.015
STATUS = ["initialising", "ready", "degraded", "clipped", "stuck", "silent"]
QUALITY = ["good", "degraded", "initialising", "unusable"]
STANDSTILL = ["unknown", "moving", "still"]
LEVEL = [0, 1, 1, 2]  # of diagnostic_msgs: good is OK, degraded and initialising are WARN, unusable is ERROR
STALE = 3
GNSS = [NAMES.index(name) for name in ("course", "course_sigma", "gnss_speed", "gnss_lat", "gnss_lon")]


class Corrections:
    """What the board adds to each sample of the gyro, in the sensor's axes and the log's unit."""

    def __init__(self, drive, weights=None, calibration=None):
        board = Coprocessor(weights=weights, calibration=calibration, wheels=drive.seen[11:15].tolist(), radius_m=drive.vehicle.radius)
        steps, times, rates = [], [], []
        for table in drive.chunks():
            # With the digits of a drive's file, so that the rates are those of the drive that `import` writes.
            gnss = np.round(table[:, GNSS], 8) if drive.seen[GNSS].any() else None
            table = np.hstack([table[:, :1], np.round(table[:, 1:7], 7), np.round(table[:, 11:15], 6)])
            steps.append(board.run(table[:, 0], table[:, 1:7], table[:, 7:11], last=False, gnss=gnss))
            times.append(table[:, 0])
            rates.append(table[:, 4:6].astype(np.float32))
        steps = np.concatenate([*steps, board.finish()])
        if board.gyro_bias is None:
            raise Refused(f"{drive.gyro.name}: never 3 s at rest without a gap, and too little course, so the bias of the gyro is not known; --from SECONDS starts later")
        self.times = np.concatenate(times)[steps["row"]] + drive.start
        roll, pitch = np.concatenate(rates)[steps["row"]].T
        sent = np.isfinite(steps["delayed"])
        rate, sigma = (np.where(sent, steps[name], steps[live]) for name, live in (("delayed", "live"), ("delayed_sigma", "live_sigma")))
        quality = np.where(sent, steps["delayed_quality"], steps["quality"])
        added = np.column_stack([steps["roll_rate"] - roll, steps["pitch_rate"] - pitch, rate - steps["gyro"]])
        turn, scale = drive.vehicle.turn(np.eye(3)), np.ravel(drive.gyro.scales)[-1]
        self.up = turn[:, 2]
        self.added, self.sigma = (added @ turn.T / scale).astype(np.float32), (sigma / scale).astype(np.float32)
        self.usable = (quality <= 1) & np.isfinite(sigma)
        self.state = steps[["status", "quality", "standstill", "live_sigma"]].copy()
        self.stamps, self.seconds = drive.gyro.channel.stamps(), drive.gyro.seconds + drive.gyro.offset

    def at(self, stamp):
        """The number of the row at or before a message's stamp and the share of the next; None outside the rows."""
        sample = np.searchsorted(self.stamps, stamp)
        if sample == len(self.stamps) or self.stamps[sample] != stamp:
            return None
        seconds = self.seconds[sample]
        row = np.searchsorted(self.times, seconds + 1e-6) - 1
        after = min(row + 1, len(self.times) - 1)
        if row < 0 or seconds - self.times[row] > NEAR or self.times[after] - self.times[row] > 2 * NEAR:
            return None
        share = (seconds - self.times[row]) / max(self.times[after] - self.times[row], 1e-9)
        return (row, after, min(max(share, 0.0), 1.0)) if share > 1e-3 else (row, row, 0.0)


class Change:
    """Changes the messages of the gyro's topic, byte by byte where the rates and their covariance are."""

    def __init__(self, drive, corrections):
        self.topic, self.recorded, self.corrections = drive.gyro.name, drive.request.recorded, corrections
        self.corrected, self.left, self.said = 0, 0, (None, 0)
        self.progress = bar(None, f"correct {self.topic}", len(corrections.stamps))

    def __call__(self, topic, kind, recorded, data, is_ros1):
        if topic != self.topic or kind != "sensor_msgs/msg/Imu":
            return data, None
        self.progress.update()
        order, place, stamp, header = layout(data, is_ros1)
        values = np.array(struct.unpack_from(order + "12d", data, place))
        seconds = stamp if stamp > 0 and not self.recorded else 1e-9 * recorded
        found = self.corrections.at(seconds)
        said = self.quality(found, recorded, header, is_ros1)
        if found is None or not (self.corrections.usable[found[0]] and self.corrections.usable[found[1]]) or values[3] == -1:
            self.left += 1
            return data, said
        self.corrected += 1
        row, after, share = found
        added = self.corrections.added
        values[:3] += (1 - share) * added[row] + share * added[after]
        values[3:] = self.covariance(values[3:].reshape(3, 3), float(self.corrections.sigma[row]) ** 2).ravel()
        changed = bytearray(data)
        struct.pack_into(order + "12d", changed, place, *values)
        return bytes(changed), said

    def covariance(self, old, variance):
        """The board's variance about the vertical; the old covariance across it, if there was one."""
        if not old.any():
            return variance * np.eye(3)
        up = np.outer(self.corrections.up, self.corrections.up)
        across = np.eye(3) - up
        return across @ old @ across + variance * up

    def quality(self, found, recorded, header, is_ros1):
        """A diagnostic message at each change, and once a second."""
        state = self.corrections.state[found[0]] if found else None
        key = tuple(state)[:3] if found else None
        if (key, recorded // 10**9) == self.said:
            return None
        self.said = (key, recorded // 10**9)
        types, values = (bags.ROS1 if is_ros1 else bags.ROS2).types, {}
        if found:
            values = {"status": STATUS[state["status"]], "quality": QUALITY[state["quality"]], "standstill": STANDSTILL[state["standstill"]],
                      "sigma_rad_per_s": f"{state['live_sigma']:.6g}"}
        pairs = [types["diagnostic_msgs/msg/KeyValue"](key=name, value=value) for name, value in values.items()]
        status = types["diagnostic_msgs/msg/DiagnosticStatus"](
            level=LEVEL[state["quality"]] if found else STALE, name="gyronet: live yaw rate",
            message=QUALITY[state["quality"]] if found else "no rate: outside the drive, or a gap", hardware_id=self.topic, values=pairs)
        sec, nanosec, frame = header
        stamp = types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        head = types["std_msgs/msg/Header"](**({"seq": 0} if is_ros1 else {}), stamp=stamp, frame_id=frame)
        return types[bags.DIAGNOSTICS](header=head, status=[status])


def layout(data, is_ros1):
    """Byte order, place of the angular velocity, stamp in seconds, and header of an Imu message (CDR, or ROS 1)."""
    if not is_ros1 and data[1] > 1:
        raise Refused(f"the messages have the encapsulation {data[1]}, not plain CDR")
    order = "<" if is_ros1 or data[1] else ">"
    sec, nanosec, length = struct.unpack_from(order + "iII", data, 4)
    start = 16 + length
    if not is_ros1:
        start = 4 + (start - 4 + 7) // 8 * 8  # aligned, behind the four bytes of the encapsulation
    return order, start + 13 * 8, sec + 1e-9 * nanosec, (sec, nanosec, data[16 : 16 + length].rstrip(b"\0").decode("utf-8", "replace"))


def correct(drive, path, out, weights=None, calibration=None):
    """Writes the corrected copy of the bag at `path`, whose drive this is; returns what there is to say about it."""
    channel = drive.gyro.channel
    if channel.log.path != str(path) or channel.kind not in ("imu", "gyro"):
        raise Refused(f"{path}: the gyro is not a topic of this bag but {channel.name} of {channel.log.path}")
    try:
        corrections = Corrections(drive, weights, calibration)
    except ValueError as error:  # the board's own words
        raise Refused(f"{path}: {error}; --from SECONDS starts at a later rest") from None
    change = Change(drive, corrections)
    bags.copy(path, out, change)
    change.progress.close()
    return (f"{out}: {change.corrected} messages of {channel.name} corrected, {change.left} left as they are (initialising, gaps, not usable); "
            f"quality in {bags.TOPIC}")

"""Reads a log with the reference reader of its format, and prints one line for each value: channel, time, numbers.

usage: read_log.py FILE [FILE.dbc]
"""

import sys
from pathlib import Path

GRAVITY = "sensor_msgs/msg/Imu"
ODOMETRY = "nav_msgs/msg/Odometry"
FIX = "sensor_msgs/msg/NavSatFix"


def say(channel, time, *values):
    print(channel, repr(float(time)), *(repr(float(value)) for value in values))


def say_ros(topic, kind, message):
    time = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
    if kind == GRAVITY:
        a, w = message.linear_acceleration, message.angular_velocity
        say(topic, time, a.x, a.y, a.z, w.x, w.y, w.z)
    elif kind == ODOMETRY:
        say(topic, time, message.twist.twist.linear.x, message.twist.twist.angular.z)
    elif kind == FIX:
        say(topic, time, message.latitude, message.longitude)


def read_bag(path):
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC)
    with Reader(path) as bag:
        for connection, _, raw in bag.messages():
            say_ros(connection.topic, connection.msgtype, types.deserialize_ros1(raw, connection.msgtype))


def read_mcap(path):
    from mcap.reader import make_reader
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            say_ros(channel.topic, schema.name, types.deserialize_cdr(message.data, schema.name))


def read_ulog(path):
    from pyulog import ULog

    log = ULog(str(path), ["sensor_combined", "vehicle_gps_position"])
    for topic in log.data_list:
        data, name = topic.data, topic.name
        for k, stamp in enumerate(data["timestamp"]):
            time = 1e-6 * stamp
            if name == "sensor_combined":
                a, w = ([data[f"{field}[{axis}]"][k] for axis in range(3)] for field in ("accelerometer_m_s2", "gyro_rad"))
                say(name, time, a[0], -a[1], -a[2], w[0], -w[1], -w[2])
            elif data["fix_type"][k] >= 2:
                say(name, time, 1e-7 * data["lat"][k], 1e-7 * data["lon"][k])


def read_can(path, dbc):
    import can
    import cantools

    base = cantools.database.load_file(dbc)
    known = {(message.frame_id, message.is_extended_frame): message for message in base.messages}
    # Counted from the first frame: readers take the date of the file in different time zones.
    start = None
    for frame in can.LogReader(path):
        message = known.get((frame.arbitration_id, frame.is_extended_id))
        if message is None or frame.is_error_frame or frame.is_remote_frame:
            continue
        start = frame.timestamp if start is None else start
        for name, value in message.decode(bytes(frame.data), decode_choices=False, allow_truncated=True).items():
            say(f"{message.name}.{name}", frame.timestamp - start, value)


path = Path(sys.argv[1])
if path.suffix == ".bag":
    read_bag(path)
elif path.suffix == ".mcap":
    read_mcap(path)
elif path.suffix == ".ulg":
    read_ulog(path)
else:
    read_can(path, sys.argv[2])

"""Makes logs of a drive with the writers of other people's tools: an IMU in a ROS 1 bag and in an MCAP of ROS 2, the wheels
in a BLF and in text logs of CAN, on a clock of their own.

usage: make_logs.py DRIVE.csv FILE.dbc FOLDER
"""

import csv
import math
import sys
from pathlib import Path

import can
import cantools
import numpy as np
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

drive, dbc, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
with open(drive) as file:
    rows = [{name: float(text) for name, text in row.items() if text} for row in csv.DictReader(file)]
START = 1_700_000_000.0
# The bus has its own clock, and its recording begins later.
BUS_CLOCK, BUS_FROM = 86_400.0 + 4.321, 6.0
RADIUS, KIND = 0.3, "sensor_msgs/msg/Imu"


def imu(types, row, extra):
    kinds = types.types
    seconds = START + row["t_s"]
    stamp = kinds["builtin_interfaces/msg/Time"](sec=int(seconds), nanosec=round(1e9 * math.fmod(seconds, 1.0)) % 10**9)
    header = kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="imu", **extra)
    vector = lambda name: kinds["geometry_msgs/msg/Vector3"](*(row[f"{name}_{axis}"] for axis in "xyz"))
    none = np.zeros(9)
    return seconds, kinds[KIND](
        header=header,
        orientation=kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        orientation_covariance=none,
        angular_velocity=vector("gyr"),
        angular_velocity_covariance=none,
        linear_acceleration=vector("acc"),
        linear_acceleration_covariance=none,
    )


ros1 = get_typestore(Stores.ROS1_NOETIC)
(folder / "drive.bag").unlink(missing_ok=True)
bag = Writer(folder / "drive.bag")
bag.set_compression(Writer.CompressionFormat.LZ4)
with bag:
    connection = bag.add_connection("/imu", KIND, typestore=ros1)
    for k, row in enumerate(rows):
        seconds, message = imu(ros1, row, {"seq": k})
        bag.write(connection, round(1e9 * seconds), ros1.serialize_ros1(message, KIND))

ros2 = get_typestore(Stores.ROS2_HUMBLE)
with open(folder / "drive.mcap", "wb") as file:
    writer = McapWriter(file)
    writer.start(profile="ros2")
    schema = writer.register_schema(KIND, "ros2msg", b"")
    channel = writer.register_channel("/imu", "cdr", schema)
    for row in rows:
        seconds, message = imu(ros2, row, {})
        nanos = round(1e9 * seconds)
        writer.add_message(channel, nanos, bytes(ros2.serialize_cdr(message, KIND)), nanos)
    writer.finish()

message = cantools.database.load_file(dbc).get_message_by_name("WHEELS")
for name in ("bus.blf", "bus.log", "bus.asc", "bus.trc"):
    with can.Logger(folder / name) as log:
        for row in rows[::2]:
            if row["t_s"] < BUS_FROM:
                continue
            wheels = ((1, "FR"), (2, "RR"), (3, "FL"), (4, "RL"))
            data = message.encode({name: 3.6 * RADIUS * abs(row[f"wheel{k}_rate"]) for k, name in wheels})
            stamp = START + BUS_CLOCK + row["t_s"]
            log.on_message_received(
                can.Message(timestamp=stamp, arbitration_id=message.frame_id, is_extended_id=False, data=data, channel=0)
            )

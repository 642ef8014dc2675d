"""Inputs of the tests, made here by the reference libraries: a drive of known rates, its bus, and logs of each format."""

import contextlib
import io
import shutil
import struct
import tempfile
import unittest
import warnings
from pathlib import Path

import can
import numpy as np
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from gyronet.__main__ import main

START = 1_700_000_000.0
STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE1 = get_typestore(Stores.ROS1_NOETIC)
FRAME = "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\nuint8[8] data\n"
for _store in (STORE, STORE1):
    _store.register(get_types_from_msg(FRAME, "can_msgs/msg/Frame"))
WHEELS = ["FL", "FR", "RL", "RR"]


def turn(t):
    """Yaw rate, rad/s: at rest for 4 s, then bends of which no two are alike."""
    return np.clip(0.5 * (t - 4), 0, 1) * (0.3 * np.sin(0.31 * t) * np.cos(0.077 * t + 1) + 0.1 * np.sin(0.9 * t + 0.003 * t * t))


def speed(t):
    return np.where(t < 4, 0.0, np.minimum(1.5 * (t - 4), 10.0))


def imu(t, rate=1.0, force=1.0):
    noise = np.random.default_rng(1).normal(0, 0.003, (len(t), 6))
    rows = noise + np.column_stack([0 * t, 0 * t, 9.81 + 0 * t, 0 * t, 0 * t, turn(t)])
    return rows * ([force] * 3 + [rate] * 3)


def times(seconds=12.0, hz=50.0):
    return np.arange(int(seconds * hz)) / hz


def run(folder, *arguments):
    """Exit status and what was printed, in the folder."""
    out = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(out), warnings.catch_warnings():
        # As in a user's Python; unittest shows them: python-can leaves a file that it refuses to the collector.
        warnings.simplefilter("ignore", ResourceWarning)
        status = main([str(argument) for argument in arguments])
    return status, out.getvalue()


def drive(folder, name="out.csv"):
    """The columns of a drive; an empty field is NaN."""
    lines = (Path(folder) / name).read_text().splitlines()
    rows = np.array([[float(field or "nan") for field in line.split(",")] for line in lines[1:]])
    return dict(zip(lines[0].split(","), rows.T))


def table(path, t, rows, header="t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z", separator=",", form="%.5f"):
    with open(path, "w") as file:
        file.write(header + "\n")
        for seconds, row in zip(t, rows):
            file.write(separator.join(["%.6f" % seconds, *(form % value for value in row)]) + "\n")


def dbc(path, identifier=0x4B0, unit="km/h", extra="", name="WHEELS", length=8, signals=None):
    signals = signals or [f' SG_ {wheel} : {16 * k}|16@1+ (0.01,0) [0|655] "{unit}" ESP' for k, wheel in enumerate(WHEELS)]
    head = 'VERSION ""\nNS_ :\nBS_:\nBU_: ESP\n'
    Path(path).write_text(head + f"BO_ {identifier} {name}: {length} ESP\n" + "\n".join(signals) + "\n" + extra, encoding="cp1252")


VEHICLE = ("[wheels]\nradius_m = 0.3\ntrack_m = 1.5\n" + "".join(f"{long} = 'WHEELS.{short}'\n" for long, short in
           zip(["front_left", "front_right", "rear_left", "rear_right"], WHEELS)) + "[bus]\ndbc = 'car.dbc'\n")


def wheel_data(t):
    """Eight bytes of four wheels, 0.01 km/h."""
    left, right = speed(t) - 0.75 * turn(t), speed(t) + 0.75 * turn(t)
    raw = [int(max(round(360 * v), 0)) for v in (left, right, left, right)]
    return struct.pack("<4H", *raw)


def frames(seconds=12.0, identifier=0x4B0, extended=False, start=START, channel=0, data=wheel_data, hz=25.0):
    return [can.Message(start + t, identifier, extended, channel=channel, data=data(t), is_rx=True) for t in times(seconds, hz)]


def bus(path, messages):
    """Written by python-can, which knows the format by the suffix."""
    with can.Logger(str(path)) as log:
        for message in messages:
            log.on_message_received(message)


def stamp(store, seconds):
    header = {"stamp": store.types["builtin_interfaces/msg/Time"](int(seconds), int(round(seconds % 1 * 1e9)) % 10**9), "frame_id": "imu"}
    return store.types["std_msgs/msg/Header"](**({"seq": 0} if store is STORE1 else {}), **header)


def build(store, kind, seconds, **values):
    """A message whose other fields are zero."""
    def zero(name):
        fields = []
        for field, (node, detail) in store.fielddefs[name][1]:
            if node.name == "BASE":
                fields.append((field, "" if detail[0] == "string" else 0))
            elif node.name == "NAME":
                fields.append((field, zero(detail)))
            elif node.name == "ARRAY":
                dtype = {"float64": np.float64, "uint8": np.uint8}[detail[0][1][0]]
                fields.append((field, np.zeros(detail[1], dtype)))
            else:
                fields.append((field, [] if detail[0][1][0] == "string" else np.zeros(0, np.float64)))
        return store.types[name](**dict(fields))

    message = zero(kind)
    object.__setattr__(message, "header", stamp(store, seconds))
    for path, value in values.items():
        *parents, last = path.split("__")
        target = message
        for parent in parents:
            target = getattr(target, parent)
        object.__setattr__(target, last, value)
    return message


def imu_messages(t, rows, store=STORE, topic="/imu", recorded=None, start=START, **more):
    for k, (seconds, row) in enumerate(zip(t, rows)):
        values = {f"linear_acceleration__{axis}": float(row[n]) for n, axis in enumerate("xyz")}
        values |= {f"angular_velocity__{axis}": float(row[3 + n]) for n, axis in enumerate("xyz")}
        at = seconds + start
        yield topic, "sensor_msgs/msg/Imu", at if recorded is None else recorded[k], build(store, "sensor_msgs/msg/Imu", at, **values, **more)


def odometry_messages(t, store=STORE, start=START, recorded=None):
    for k, seconds in enumerate(t):
        values = {"twist__twist__linear__x": float(speed(seconds)), "twist__twist__angular__z": float(turn(seconds))}
        yield ("/odom", "nav_msgs/msg/Odometry", seconds + start if recorded is None else recorded[k],
               build(store, "nav_msgs/msg/Odometry", seconds + start, **values))


def fix_messages(t, start=START):
    """Fixes along the path; `start` is the clock of the receiver."""
    fine = times(t[-1] + 1, 1000.0)
    heading = np.cumsum(turn(fine)) / 1000
    x, y = np.cumsum(speed(fine) * np.cos(heading)) / 1000, np.cumsum(speed(fine) * np.sin(heading)) / 1000
    for seconds in t:
        k = int(round(seconds * 1000))
        east = 8 + x[k] / (111_320 * np.cos(np.radians(50)))
        yield ("/fix", "sensor_msgs/msg/NavSatFix", seconds + START,
               build(STORE, "sensor_msgs/msg/NavSatFix", seconds + start, latitude=50 + y[k] / 111_320, longitude=east))


def mcap(path, messages, compression=None, close=True, little_endian=True):
    with open(path, "wb") as file:
        writer = Writer(file, compression=compression or CompressionType.ZSTD, chunk_size=20_000)
        writer.start("ros2")
        channels = {}
        for topic, kind, recorded, message in sorted(messages, key=lambda entry: entry[2]):
            if topic not in channels:
                text, _ = STORE.generate_msgdef(kind, ros_version=2)
                channels[topic] = writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", text.encode()))
            nanos = int(recorded * 1e9)
            writer.add_message(channels[topic], nanos, bytes(STORE.serialize_cdr(message, kind, little_endian=little_endian)), nanos)
        if close:
            writer.finish()


def bag2(path, messages, storage="sqlite3", compress=None):
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()])
    if compress:
        writer.set_compression(CompressionMode[compress], CompressionFormat.ZSTD)
    _write(writer, messages, STORE, lambda message, kind: STORE.serialize_cdr(message, kind))


def bag1(path, messages):
    from rosbags.rosbag1 import Writer
    _write(Writer(path), messages, STORE1, lambda message, kind: STORE1.serialize_ros1(message, kind))


def _write(writer, messages, store, serialize):
    with writer:
        connections = {}
        for topic, kind, recorded, message in sorted(messages, key=lambda entry: entry[2]):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], int(recorded * 1e9), serialize(message, kind))


def ulog(path, topics, version=1, rubbish_at=None, rubbish=bytes(37)):
    """A PX4 ULog: topics by name, each with fields ("float x", ...), times and rows; a sync record each 50 messages."""
    def record(kind, data):
        return struct.pack("<HB", len(data), ord(kind)) + data

    sync = record("S", bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12]))
    out = bytes([0x55, 0x4C, 0x6F, 0x67, 0x01, 0x12, 0x35, version]) + struct.pack("<Q", 0)
    out += record("B", bytes(40)) if version else b""
    for name, (fields, _, _) in topics.items():
        out += record("F", f"{name}:uint64_t timestamp;{''.join(field + ';' for field in fields)}".encode())
    for number, name in enumerate(topics):
        out += record("A", struct.pack("<BH", 0, number) + name.encode())
    codes = {"float": "f", "float[3]": "3f", "double": "d", "int32_t": "i", "uint8_t": "B"}
    data = [(seconds, number, struct.pack("<HQ" + "".join(codes[field.split()[0]] for field in fields), number, int(1e6 * seconds), *row))
            for number, (fields, t, rows) in enumerate(topics.values()) for seconds, row in zip(t, rows)]
    for k, (_, _, bytes_) in enumerate(sorted(data)):
        out += record("D", bytes_) + (sync if k % 50 == 49 else b"") + (rubbish + sync if k == rubbish_at else b"")
    Path(path).write_bytes(out)


class Case(unittest.TestCase):
    """Imports of logs in a folder of its own."""

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return self.folder / name

    def imports(self, *arguments, says=()):
        status, text = run(self.folder, "import", *arguments)
        self.assertEqual(status, 0, text)
        for words in says:
            self.assertIn(words, text)
        return drive(self.folder) if "out.csv" in arguments else text

    def refuses(self, *arguments, says=()):
        before = sorted(self.folder.rglob("*"))
        status, text = run(self.folder, "import", *arguments)
        self.assertEqual(status, 1, text)
        self.assertEqual((text.count("\n"), text[:7]), (1, "error: "), text)
        for words in says:
            self.assertIn(words, text)
        self.assertEqual(sorted(self.folder.rglob("*")), before, "something was left behind")

    def has_wheels(self, drive, first=0.0):
        """The wheels of the made drive, within the bus's resolution and its 40 ms."""
        t = drive["t_s"]
        inside = (t > max(first, 4.2)) & (t < 11.8)
        for column, side in ((1, 1), (2, 1), (3, -1), (4, -1)):
            truth = (speed(t) + side * 0.75 * turn(t)) / 0.3
            self.assertLess(np.nanmax(np.abs(drive[f"wheel{column}_rate"] - truth)[inside]), 0.05)

"""ROS bags: ROS 1, ROS 2 folders (SQLite, MCAP, split, compressed) and SQLite files by rosbags; MCAP files by mcap."""

import math
import re
import tempfile
from pathlib import Path

from mcap.reader import NonSeekingReader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from gyronet.progress import bar
from gyronet.refused import Refused

REINDEX = "after a killed recorder, run: ros2 bag reindex FOLDER, and import FOLDER"
WANTED = ["sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry", "sensor_msgs/msg/NavSatFix", "geometry_msgs/msg/TwistStamped",
          "sensor_msgs/msg/JointState", "can_msgs/msg/Frame"]
CAN_FRAME = "std_msgs/Header header\nuint32 id\nbool is_rtr\nbool is_extended\nbool is_error\nuint8 dlc\nuint8[8] data\n"


def defaults():
    """Types for bags that do not describe their own."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(CAN_FRAME, "can_msgs/msg/Frame"))
    return store


def read_bag(path, log, bus, suffix=""):
    """A ROS 1 bag, a SQLite file, or a folder with metadata.yaml; rosbags knows a file by its suffix."""
    with tempfile.TemporaryDirectory() as folder:
        named = Path(path)
        if named.suffix != suffix and not named.is_dir():
            named = Path(folder) / f"log{suffix}"
            named.symlink_to(Path(path).resolve())
        try:
            with AnyReader([named], default_typestore=defaults()) as reader:
                taken = Messages(log, bus)
                connections = [connection for connection in reader.connections if connection.msgtype in WANTED]
                for connection in reader.connections:
                    if connection not in connections:
                        log.passed[connection.msgtype] += connection.msgcount
                messages = reader.messages(connections) if connections else ()
                for connection, recorded, data in bar(messages, Path(path).name, sum(c.msgcount for c in connections)):
                    taken.add(connection.topic, connection.msgtype, lambda c=connection, d=data: reader.deserialize(d, c.msgtype), recorded)
        except Exception as error:  # rosbags raises whatever damaged bytes provoke
            remedy = "a bag that was not closed: rosbag reindex FILE" if suffix == ".bag" else REINDEX
            reason = str(error).replace(str(named), str(path)) or type(error).__name__
            if not log.channels:
                raise Refused(f"{path}: the bag cannot be read: {reason}; {remedy}") from None
            log.drop(f"the bag ends early: {reason}")


def read_mcap(path, log, bus):
    taken, readers, last = Messages(log, bus), {}, None
    with open(path, "rb") as file:
        try:
            for schema, channel, message in bar(NonSeekingReader(file).iter_messages(log_time_order=False), Path(path).name):
                last = message.log_time
                if channel.id not in readers:
                    readers[channel.id] = _reader(schema, channel.message_encoding)
                kind, read = readers[channel.id]
                if read:
                    taken.add(channel.topic, kind, lambda: read(message.data, kind), message.log_time)
                else:
                    log.passed[kind] += 1
        except Exception as error:  # mcap raises whatever damaged bytes provoke
            if last is None:
                raise Refused(f"{path}: the MCAP file cannot be read: {error or type(error).__name__}; mcap recover FILE") from None
            log.drop(f"the file ends within a record ({type(error).__name__}); mcap recover FILE")


def _reader(schema, encoding):
    """The type of a channel's messages, and what reads them: None for those that no drive needs."""
    kind = re.sub(r"^(\w+)/(?!msg/)", r"\1/msg/", schema.name) if schema else "no schema"
    if encoding not in ("cdr", "ros1"):
        return f"{kind} in {encoding or 'no encoding'}", None
    if kind not in WANTED:
        return kind, None
    store, text = defaults() if not schema.data else get_typestore(Stores.EMPTY), schema.data.decode("utf-8", "replace")
    if text:
        store.register(get_types_from_idl(text) if schema.encoding == "ros2idl" else get_types_from_msg(text, kind))
    return kind, store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1


class Messages:
    """Takes what a drive can need from messages of any kind of bag."""

    def __init__(self, log, bus):
        self.log, self.bus, self.frames = log, bus, None
        self.takers = dict(zip(WANTED, [self.imu, self.odometry, self.fix, self.twist, self.joint, self.frame]))

    def add(self, topic, kind, read, recorded):
        try:
            message = read()
            stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            seconds = stamp if stamp > 0 and not self.log.recorded else 1e-9 * recorded
            self.takers[kind](topic, seconds, message)
        except Exception as error:  # whatever the bytes of one message provoke, the others are read
            self.log.drop(f"{topic}: invalid or truncated {kind} ({type(error).__name__})")

    def imu(self, topic, seconds, message):
        force, rate = message.linear_acceleration, message.angular_velocity
        force, rate = [force.x, force.y, force.z], [rate.x, rate.y, rate.z]
        # A first covariance element of -1 says that the driver has no such reading.
        if message.linear_acceleration_covariance[0] == -1:
            self.log.passed[f"sensor_msgs/msg/Imu of {topic} without acceleration (covariance -1)"] += 1
            force = [0.0] * 3
        if message.angular_velocity_covariance[0] == -1:
            self.log.passed[f"sensor_msgs/msg/Imu of {topic} without angular rate (covariance -1)"] += 1
            rate = [0.0] * 3
        self.log.add(topic, "imu", seconds, force + rate)

    def odometry(self, topic, seconds, message):
        twist = message.twist.twist
        self.log.add(topic, "odometry", seconds, (twist.linear.x, twist.angular.z))

    def twist(self, topic, seconds, message):
        self.log.add(topic, "odometry", seconds, (message.twist.linear.x, message.twist.angular.z))

    def fix(self, topic, seconds, message):
        if message.status.status < 0:
            self.log.passed[f"sensor_msgs/msg/NavSatFix of {topic} without a fix"] += 1
            return
        self.log.add(topic, "position", seconds, (message.latitude, message.longitude, math.nan, math.nan, math.nan))

    def joint(self, topic, seconds, message):
        for name, rate in zip(message.name, message.velocity):
            self.log.add(f"{topic}/{name}", "number", seconds, (rate,), "rad/s")
        if not len(message.velocity):
            self.log.passed[f"sensor_msgs/msg/JointState of {topic} with positions only (record velocities, or an odometry)"] += 1

    def frame(self, topic, seconds, message):
        self.frames = self.frames or topic
        if message.is_rtr or message.is_error:
            self.log.passed["CAN remote or error frame"] += 1
        else:
            data = bytes(message.data)[: message.dlc]
            self.bus.add(self.log, seconds, "" if topic == self.frames else topic, message.id, message.is_extended, data)

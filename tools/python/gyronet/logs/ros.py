"""ROS bags: ROS 1, ROS 2 folders (SQLite, MCAP, split, compressed) by rosbags; single MCAP and SQLite files."""

import math
import sqlite3
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from gyronet.logs.progress import Progress
from gyronet.refused import Refused

REINDEX = "after a killed recorder, run: ros2 bag reindex FOLDER"
WANTED = ["sensor_msgs/msg/Imu", "nav_msgs/msg/Odometry", "sensor_msgs/msg/NavSatFix", "geometry_msgs/msg/TwistStamped",
          "sensor_msgs/msg/JointState", "can_msgs/msg/Frame"]


CAN_FRAME = """std_msgs/Header header
uint32 id
bool is_rtr
bool is_extended
bool is_error
uint8 dlc
uint8[8] data
"""


def defaults():
    """Types for bags that do not describe their own."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(CAN_FRAME, "can_msgs/msg/Frame"))
    return store


def read_bag(path, log, bus):
    """A ROS 1 bag, or a folder with metadata.yaml."""
    path = Path(path)
    try:
        with AnyReader([path], default_typestore=defaults()) as reader:
            taken = Messages(log, bus)
            connections = [connection for connection in reader.connections if connection.msgtype in WANTED]
            for connection in reader.connections:
                if connection not in connections:
                    log.passed[connection.msgtype] += connection.msgcount
            progress = Progress(path.name, sum(connection.msgcount for connection in connections))
            for connection, recorded, data in reader.messages(connections) if connections else ():
                progress.step()
                taken.add(connection.topic, connection.msgtype, lambda c=connection, d=data: reader.deserialize(d, c.msgtype), recorded)
            progress.end()
    except Refused:
        raise
    except Exception as error:  # rosbags raises whatever damaged bytes provoke
        remedy = REINDEX if path.is_dir() else "a bag that was not closed: rosbag reindex FILE"
        if not log.channels:
            raise Refused(f"{path}: the bag cannot be read: {error or type(error).__name__}; {remedy}") from None
        log.dropped[f"the bag ends early: {error or type(error).__name__}"] += 1


def read_mcap(path, log, bus):
    from mcap.reader import NonSeekingReader

    taken, stores, last = Messages(log, bus), {}, None
    progress = Progress(Path(path).name, Path(path).stat().st_size)
    with open(path, "rb") as file:
        try:
            for schema, channel, message in NonSeekingReader(file).iter_messages(log_time_order=False):
                last = message.log_time
                progress.at(file.tell())
                kind = _full(schema.name) if schema else "no schema"
                if channel.message_encoding not in ("cdr", "ros1"):
                    kind = f"{kind} in {channel.message_encoding or 'no encoding'}"
                if kind not in WANTED:
                    log.passed[kind] += 1
                    continue
                store = stores.get(schema.id)
                if store is None:
                    store = stores[schema.id] = _store(schema, kind)
                read = store.deserialize_cdr if channel.message_encoding == "cdr" else store.deserialize_ros1
                taken.add(channel.topic, kind, lambda: read(message.data, kind), message.log_time)
        except Refused:
            raise
        except Exception as error:  # mcap raises whatever damaged bytes provoke
            if last is None:
                raise Refused(f"{path}: the MCAP file cannot be read: {error or type(error).__name__}; mcap recover FILE") from None
            log.dropped[f"the file ends within a record ({type(error).__name__}); mcap recover FILE"] += 1
    progress.end()


def read_sqlite(path, log, bus):
    """One .db3 file of a ROS 2 bag, without its metadata."""
    taken, store = Messages(log, bus), defaults()
    try:
        base = sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True)
        topics = {row[0]: row[1:] for row in base.execute("SELECT id, name, type FROM topics")}
        for topic, recorded, data in base.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp"):
            name, kind = topics.get(topic, ("", "unknown topic"))
            if kind not in WANTED or kind not in store.fielddefs:
                log.passed[kind] += 1
                continue
            taken.add(name, kind, lambda: store.deserialize_cdr(data, kind), recorded)
    except sqlite3.Error as error:
        if not log.channels:
            raise Refused(f"{path}: a SQLite file, but not a readable ROS 2 bag ({error}); {REINDEX}, then import FOLDER") from None
        log.dropped[f"the file is damaged: {error}"] += 1


def _full(kind):
    return kind if "/msg/" in kind else kind.replace("/", "/msg/", 1)


def _store(schema, kind):
    if not schema.data:
        return defaults()
    store = get_typestore(Stores.EMPTY)
    text = schema.data.decode("utf-8", "replace")
    store.register(get_types_from_idl(text) if schema.encoding == "ros2idl" else get_types_from_msg(text, kind))
    return store


class Messages:
    """Takes what a drive can need from messages of any kind of bag."""

    def __init__(self, log, bus):
        self.log, self.bus, self.joints, self.frames = log, bus, {}, None
        self.takers = dict(zip(WANTED, [self.imu, self.odometry, self.fix, self.twist, self.joint, self.frame]))

    def add(self, topic, kind, read, recorded):
        try:
            message = read()
            stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
            seconds = stamp if stamp > 0 and not self.log.recorded else 1e-9 * recorded
            self.takers[kind](topic, seconds, message)
        except Refused:
            raise
        except Exception as error:  # whatever the bytes of one message provoke, the others are read
            self.log.dropped[f"{topic}: invalid or truncated {kind} ({type(error).__name__})"] += 1

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
        variance = 0.5 * (message.position_covariance[0] + message.position_covariance[4])
        sigma = math.sqrt(variance) if message.position_covariance_type > 0 and variance > 0 else math.nan
        self.log.add(topic, "position", seconds, (message.latitude, message.longitude, sigma, math.nan, math.nan, math.nan))

    def joint(self, topic, seconds, message):
        for name, rate in zip(message.name, message.velocity):
            self.log.add(f"{topic}/{name}", "number", seconds, (rate,), "rad/s")
        if len(message.velocity):
            return
        for name, angle in zip(message.name, message.position):
            before = self.joints.get((topic, name))
            self.joints[topic, name] = (seconds, angle)
            if before is None:
                self.log.notes.append(f"{topic}/{name}: no velocity; its rate is the difference of its positions")
            elif seconds > before[0]:
                turned = angle - before[1]
                if abs(turned) > math.pi and max(abs(angle), abs(before[1])) <= math.pi + 1e-6:
                    turned -= math.copysign(math.tau, turned)
                middle, rate = 0.5 * (seconds + before[0]), turned / (seconds - before[0])
                self.log.add(f"{topic}/{name}", "number", middle, (rate,), "rad/s")

    def frame(self, topic, seconds, message):
        self.frames = self.frames or topic
        if message.is_rtr or message.is_error:
            self.log.passed["CAN remote or error frame"] += 1
        else:
            data = bytes(message.data)[: message.dlc]
            self.bus.add(self.log, seconds, "" if topic == self.frames else topic, message.id, message.is_extended, data)

"""Copies of ROS 1 and 2 bags and of MCAP files in which some messages change and one topic is added."""

import os
import shutil
from pathlib import Path

from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

from gyronet.logs.opened import MCAP, SQLITE
from gyronet.logs.ros import REINDEX
from gyronet.refused import Refused

DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
TOPIC = "/gyronet/quality"
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)


def copy(path, out, change):
    """Copies a bag. `change` takes topic, type, recording time (ns), bytes and whether they are of ROS 1;
    it returns bytes, and what TOPIC gets or None.

    A copy that fails leaves nothing behind.
    """
    path, out = Path(path), Path(out)
    copier = copier_of(path, out)
    half = out.with_name(f".{out.name}.{os.getpid()}")
    try:
        half.mkdir()
        copier(path, half / out.name, change)
        os.rename(half / out.name, out)
    except OSError as error:
        raise Refused(f"{out}: {error.strerror or error}") from None
    except Refused:
        raise
    except Exception as error:  # the libraries raise whatever damaged bytes provoke
        raise Refused(f"{path}: cannot be copied: {error or type(error).__name__}; nothing is written") from None
    finally:
        shutil.rmtree(half, ignore_errors=True)


def copier_of(path, out):
    if out.exists():
        raise Refused(f"{out}: exists already; give the corrected bag another name")
    if path.is_dir():
        head = b"folder" if (path / "metadata.yaml").is_file() else b""
    else:
        try:
            with open(path, "rb") as file:
                head = file.read(16)
        except OSError as error:
            raise Refused(f"{path}: {error.strerror}") from None
    for magic, copier in ((b"folder", bag2), (b"#ROSBAG V2.0", bag1), (MCAP, mcap)):
        if head.startswith(magic):
            return copier
    if head.startswith(SQLITE):
        raise Refused(f"{path}: of a ROS 2 bag the whole folder is copied; {REINDEX.replace('import', 'correct')}")
    raise Refused(f"{path}: not a ROS bag, bag folder or MCAP file; for other logs: import, then gyronet replay")


def check(topics):
    if TOPIC in topics:
        raise Refused(f"the bag has {TOPIC}: it is corrected already")


def bag1(path, out, change):
    with rosbag1.Reader(path) as reader, rosbag1.Writer(out) as writer:
        check(reader.topics)
        made = {c.id: writer.add_connection(c.topic, c.msgtype, msgdef=c.msgdef.data, md5sum=c.digest, callerid=c.ext.callerid,
                                            latching=c.ext.latching) for c in reader.connections}
        quality = writer.add_connection(TOPIC, DIAGNOSTICS, typestore=ROS1)
        for connection, recorded, data in reader.messages():
            data, said = change(connection.topic, connection.msgtype, recorded, data, True)
            writer.write(made[connection.id], recorded, data)
            if said:
                writer.write(quality, recorded, bytes(ROS1.serialize_ros1(said, DIAGNOSTICS)))


def bag2(path, out, change):
    with rosbag2.Reader(path) as reader:
        check(reader.topics)
        plugin = rosbag2.StoragePlugin.MCAP if any(path.glob("*.mcap*")) else rosbag2.StoragePlugin.SQLITE3
        writer = rosbag2.Writer(out, version=9, storage_plugin=plugin)
        if reader.compression_mode:
            writer.set_compression(rosbag2.CompressionMode[reader.compression_mode.upper()], rosbag2.CompressionFormat.ZSTD)
        with writer:
            made = {}
            for c in reader.connections:
                # Bags of old releases do not describe their types.
                said = {"msgdef": c.msgdef.data, "rihs01": c.digest or "RIHS01_" + 64 * "0"}
                said = {"typestore": ROS2} if not c.msgdef.data and c.msgtype in ROS2.fielddefs else said
                made[c.id] = writer.add_connection(c.topic, c.msgtype, serialization_format=c.ext.serialization_format,
                                                   offered_qos_profiles=c.ext.offered_qos_profiles, **said)
            quality = writer.add_connection(TOPIC, DIAGNOSTICS, typestore=ROS2)
            for connection, recorded, data in reader.messages():
                data, said = change(connection.topic, connection.msgtype, recorded, data, False)
                writer.write(made[connection.id], recorded, data)
                if said:
                    writer.write(quality, recorded, bytes(ROS2.serialize_cdr(said, DIAGNOSTICS)))


def mcap(path, out, change):
    from mcap import records, stream_reader, writer as writers

    with open(path, "rb") as file, open(out, "wb") as copy_:
        writer, schemas, channels, quality = writers.Writer(copy_), {0: (0, "")}, {}, None
        for record in stream_reader.StreamReader(file).records:
            if isinstance(record, records.Header):
                writer.start(record.profile, record.library)
            elif isinstance(record, records.Schema) and record.id not in schemas:
                schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data), record.name
            elif isinstance(record, records.Channel) and record.id not in channels:
                check([record.topic])
                schema, name = schemas[record.schema_id]
                made = writer.register_channel(record.topic, record.message_encoding, schema, record.metadata)
                channels[record.id] = made, record.topic, name if "/msg/" in name else name.replace("/", "/msg/", 1), record.message_encoding
            elif isinstance(record, records.Message):
                made, topic, kind, encoding = channels[record.channel_id]
                is_ros1, data, said = encoding == "ros1", record.data, None
                if encoding in ("cdr", "ros1"):
                    data, said = change(topic, kind, record.log_time, data, is_ros1)
                writer.add_message(made, record.log_time, data, record.publish_time, record.sequence)
                if said:
                    store = ROS1 if is_ros1 else ROS2
                    if quality is None:
                        text, _ = store.generate_msgdef(DIAGNOSTICS, ros_version=1 if is_ros1 else 2)
                        schema = writer.register_schema(DIAGNOSTICS, "ros1msg" if is_ros1 else "ros2msg", text.encode())
                        quality = writer.register_channel(TOPIC, encoding, schema)
                    serialize = store.serialize_ros1 if is_ros1 else store.serialize_cdr
                    writer.add_message(quality, record.log_time, bytes(serialize(said, DIAGNOSTICS)), record.log_time)
            elif isinstance(record, records.Attachment):
                writer.add_attachment(record.create_time, record.log_time, record.name, record.media_type, record.data)
            elif isinstance(record, records.Metadata):
                writer.add_metadata(record.name, record.metadata)
        writer.finish()

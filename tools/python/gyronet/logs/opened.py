"""Logs of a request: each file or folder by its first bytes, whatever its suffix says; what cannot be a log is refused in one line."""

import re
from dataclasses import dataclass, field
from pathlib import Path

from gyronet.logs import can, ros
from gyronet.logs.samples import Log
from gyronet.refused import Refused, listed
from gyronet.units import Flags
from gyronet.vehicle import NUMBERS, WHEELS, Vehicle

SUFFIXES = {".bag", ".mcap", ".db3", ".ulg", ".log", ".asc", ".blf", ".trc", ".mf4", ".mdf", ".csv", ".txt"}
ROSBAG, SQLITE, MCAP = b"#ROSBAG V2.0", b"SQLite format 3\0", b"\x89MCAP0\r\n"
REFUSED = [
    (b"\x1f\x8b", "compressed by gzip; unpack it first: gunzip FILE"),
    (b"\x28\xb5\x2f\xfd", "compressed by zstd; unpack it first: unzstd FILE (a compressed ROS 2 bag: import its folder)"),
    (b"version https://git-lfs", "a Git LFS pointer, not the file itself; run: git lfs pull"),
    (b"PK\x03\x04", "a ZIP archive or an Excel file; unpack it, or save the sheet as CSV"),
    ((b"\xff\xfe", b"\xfe\xff"), "UTF-16 text; save it as UTF-8"),
    (b"#ROSBAG V1", "a bag of version 1; convert it: rosbag fix OLD.bag NEW.bag"),
    (b"\x7fELF", "a program, not a log"),
    (b"GYROFLOW", "a Gyroflow log, whose numbers are scaled by its head: write a table in SI, headed t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z"),
]


@dataclass
class Request:
    files: list
    vehicle: Vehicle = field(default_factory=Vehicle)
    same_clock: bool = False
    recorded: bool = False  # the recording times of a bag in place of the header stamps
    start: float = 0.0  # s after the first sample
    to: float | None = None
    units: Flags = field(default_factory=Flags)
    offsets: dict = field(default_factory=dict)
    rate: float | None = None

    def wanted(self):
        names = [self.vehicle.wheels[wheel] for wheel in WHEELS] + [self.vehicle.signals["reference_rate"]]
        return [name for name in names if name] + NUMBERS


def expand(paths):
    """Files and bag folders of the given paths: a folder without metadata.yaml stands for the logs in it."""
    found = []
    for path in map(Path, paths):
        if not path.exists():
            raise Refused(f"{path}: no such file or folder")
        if not path.is_dir() or (path / "metadata.yaml").is_file():
            found.append(path)
            continue
        logs = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES)
        inside = [file for file in logs if file.suffix.lower() not in (".csv", ".txt")]
        if not inside:
            lacks = "a folder of text tables: name those of one drive" if logs else "a folder with neither metadata.yaml (a ROS 2 bag) nor a log file in it"
            raise Refused(f"{path}: {lacks}" + listed(map(str, logs), ": ", 8))
        found += inside
    if len({path.resolve() for path in found}) != len(found):
        raise Refused("a file is given twice")
    return found


def read(path, request, bus, several):
    """The channels of one file or bag folder."""
    log, head = Log(str(path), request.wanted(), request.recorded, several), b""
    if not path.is_dir():
        try:
            with open(path, "rb") as file:
                head = file.read(4096)
        except OSError as error:
            raise Refused(f"{path}: {error.strerror}") from None
        if not head:
            raise Refused(f"{path}: is empty")
    for magic, reason in REFUSED:
        if head.startswith(magic):
            raise Refused(f"{path}: {reason}")
    text = head.decode("utf-8", "replace").lstrip("\ufeff").lstrip()
    if text[:200].lower().startswith(("<!doctype", "<html", "<?xml")):
        raise Refused(f"{path}: a web page, not a log: the download went wrong")
    if head.startswith(MCAP):
        ros.read_mcap(path, log, bus)
    elif not head or head.startswith((SQLITE, ROSBAG)):
        ros.read_bag(path, log, bus, ".bag" if head.startswith(ROSBAG) else ".db3")
    elif head.startswith(b"ULog\x01\x12\x35"):
        from gyronet.logs import ulog
        ulog.read(path, log, bus)
    elif head.startswith((b"MDF     ", b"UnFinMF ")):
        from gyronet.logs import mdf
        mdf.read(path, log, bus, request.vehicle, request.units)
    elif kind := can_kind(head, text):
        can.read(path, kind, log, bus)
    else:
        from gyronet.logs import table
        table.read(path, log, request.vehicle, request.units, request.rate)
    return log.close()


def check_columns(vehicle, logs):
    """Refuses a column that the vehicle file names and no table has; returns a remark if there is no table."""
    tables, named = [log for log in logs if log.columns], [ours for ours in vehicle.columns if vehicle.column(ours)]
    if named and not tables:
        return [f"{vehicle.path}: [columns] is for text tables and MDF files; the logs are neither"]
    for ours in named:
        if not any(ours in log.mapped for log in tables):
            there = listed([f"{Path(log.path).name}:{name}" for log in tables for name in log.columns])
            raise Refused(f"{vehicle.path}: no file has a column {vehicle.column(ours)}, which it names for {ours}{there}")
    return []


def merged(logs):
    """Joins the parts of a split recording: the same channels, one after the other."""
    whole = []
    for log in sorted(logs, key=lambda log: min([channel.first for channel in log.channels.values()], default=0.0)):
        before = next((other for other in whole if _goes_on(other, log)), None)
        if before is None:
            whole.append(log)
            continue
        before.notes.append(f"{log.path} goes on where {before.path} ends")
        for name, channel in log.channels.items():
            before.channels.setdefault(name, channel).append(channel)
        before.dropped.update(log.dropped)
        before.passed.update(log.passed)
    return whole


def _goes_on(before, log):
    common = set(before.channels) & set(log.channels)
    same = common and not common & {"imu", "gyro", "accel", "position"}
    return same and all(log.channels[name].first >= before.channels[name].last - 1.0 for name in common)


def can_kind(head, text):
    """The format of a CAN log by its first line, of TRC by its remarks; None for another."""
    if head.startswith(b"LOGG"):
        return "blf"
    is_trc = re.search(r";\$fileversion|message number|pcan|time offset of message", text, re.IGNORECASE)
    for kind, form in (("candump", r"\(.*#"), ("screen", r"\(.*\["), ("asc", "(date|base) "), ("trc", ";")):
        if re.match(form, text, re.IGNORECASE) and (kind != "trc" or is_trc):
            return kind
    return None

"""A file or folder by its first bytes, whatever its suffix says; what cannot be a log is refused in one line."""

import gzip
import shutil
import tempfile
from pathlib import Path

from gyronet.logs.samples import Log
from gyronet.refused import Refused

SUFFIXES = {".bag", ".mcap", ".db3", ".ulg", ".log", ".asc", ".blf", ".trc", ".mf4", ".mdf", ".csv", ".txt", ".gcsv"}
ZSTD, GZIP, SQLITE, MCAP = b"\x28\xb5\x2f\xfd", b"\x1f\x8b", b"SQLite format 3\0", b"\x89MCAP0\r\n"
REFUSED = [
    (b"version https://git-lfs", "a Git LFS pointer, not the file itself; run: git lfs pull"),
    (b"PK\x03\x04", "a ZIP archive; unpack it first"),
    (b"#ROSBAG V1", "a bag of version 1; convert it: rosbag fix OLD.bag NEW.bag"),
    (b"\x7fELF", "a program, not a log"),
]


def expand(paths):
    """Files and bag folders of the given paths: a folder without metadata.yaml stands for the logs in it."""
    found = []
    for path in map(Path, paths):
        if not path.exists():
            raise Refused(f"{path}: no such file or folder")
        if not path.is_dir() or (path / "metadata.yaml").is_file():
            found.append(path)
            continue
        inside = sorted(file for file in path.iterdir() if file.suffix.lower() in SUFFIXES - {".csv", ".txt"})
        if not inside:
            raise Refused(f"{path}: a folder with neither metadata.yaml (a ROS 2 bag) nor a log file in it; name the files")
        found += inside
    if len({path.resolve() for path in found}) != len(found):
        raise Refused("a file is given twice")
    return found


def read(path, request, bus, several):
    """The channels of one file."""
    log = Log(str(path), request.wanted(), request.recorded)
    if path.is_dir():
        from gyronet.logs import ros
        ros.read_bag(path, log, bus)
        return log.close()
    try:
        with open(path, "rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise Refused(f"{path}: {error.strerror}") from None
    if head.startswith((GZIP, ZSTD)):
        with tempfile.TemporaryDirectory() as folder:
            inner = Path(folder) / (path.stem if path.suffix in (".gz", ".zst") else path.name)
            unpack(path, head, inner)
            with open(inner, "rb") as file:
                dispatch(inner, file.read(4096), log, request, bus, several)
            return log.close()
    dispatch(path, head, log, request, bus, several)
    return log.close()


def unpack(path, head, inner):
    try:
        if head.startswith(GZIP):
            with gzip.open(path) as packed, open(inner, "wb") as file:
                shutil.copyfileobj(packed, file)
        else:
            import zstandard
            with open(path, "rb") as packed, open(inner, "wb") as file:
                zstandard.ZstdDecompressor().copy_stream(packed, file)
    except Exception as error:  # a truncated or damaged archive
        raise Refused(f"{path}: cannot be unpacked: {error}") from None


def dispatch(path, head, log, request, bus, several):
    if not head:
        raise Refused(f"{path}: is empty")
    for magic, reason in REFUSED:
        if head.startswith(magic):
            raise Refused(f"{path}: {reason}")
    text = head.decode("utf-8", "replace").lstrip("\ufeff").lstrip()
    if text[:200].lower().startswith(("<!doctype", "<html", "<?xml")):
        raise Refused(f"{path}: a web page, not a log: the download went wrong")
    if head.startswith((MCAP, SQLITE, b"#ROSBAG V2.0")):
        from gyronet.logs import ros
        (ros.read_mcap if head.startswith(MCAP) else ros.read_sqlite if head.startswith(SQLITE) else ros.read_bag)(path, log, bus)
    elif head.startswith(b"ULog\x01\x12\x35"):
        from gyronet.logs import ulog
        ulog.read(path, log, bus)
    elif head.startswith((b"MDF     ", b"UnFinMF ")):
        from gyronet.logs import mdf
        mdf.read(path, log, bus, request.vehicle, request.units)
    elif (kind := can_kind(head, text)):
        from gyronet.logs import can
        can.read(path, kind, log, bus)
    else:
        from gyronet.logs import table
        table.read(path, log, request.vehicle, request.units, request.rate, several)


def can_kind(head, text):
    lines = [line.strip() for line in text.lower().splitlines() if line.strip()]
    first = lines[0] if lines else ""
    if head.startswith(b"LOGG"):
        return "blf"
    if first.startswith("(") and "#" in first:
        return "candump"
    if first.startswith("(") and "[" in first:
        return "screen"
    if first.startswith(("date ", "base ")):
        return "asc"
    is_trc = any(
        ";$fileversion" in line or "message number" in line or "pcan" in line or "time offset of message" in line
        for line in lines
    )
    return "trc" if first.startswith(";") and is_trc else None

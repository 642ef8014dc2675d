"""CAN logs by python-can, and their signals by cantools."""

import re
from collections import Counter
from datetime import datetime, timezone
from pathlib import Path

import can

from gyronet import dbc
from gyronet.progress import bar
from gyronet.refused import Refused, listed

SCREEN = re.compile(r"\s*\(([^)]+)\)\s+(\S+)\s+(?:[RT]X\s+\S+\s+\S+\s+|[RT]X\s+)?([0-9A-Fa-f]{3,8})\s+\[(\d+)\]\s*(.*)")
FIRST_IS_0 = {"asc": 1, "blf": 1}  # python-can counts the channels of these from 0


class Bus:
    """The wanted signals of a DBC file; without one, frames are counted only."""

    def __init__(self, path, wanted):
        self.path, self.notes, self.messages, self.groups = path, [], {}, {}
        self.names, self.seen, self.unmatched = {}, {}, Counter()
        if not path:
            return
        self.database = dbc.load(path, self.notes)
        for message in self.database.messages:
            taken = [(signal, f"{message.name}.{signal.name}", dbc.codes(signal)) for signal in message.signals
                     if any(re.split(r"@", want.rpartition(":")[2])[0] == f"{message.name}.{signal.name}" for want in wanted)]
            self.messages[message.frame_id, message.is_extended_frame] = (message, taken)
            self.names[message.name] = message
            if dbc.is_j1939(self.database, message):
                self.groups[dbc.group(message.frame_id)] = (message, taken)

    def add(self, log, seconds, bus, identifier, extended, data):
        if not self.path:
            log.passed["CAN frame (pass --dbc FILE to decode signals)"] += 1
            return
        found = self.messages.get((identifier, extended))
        if found is None and extended:
            found = self.groups.get(dbc.group(identifier))
        if found is None:
            self.unmatched[f"{identifier:08X}" if extended else f"{identifier:03X}"] += 1
            log.passed["CAN message that is not in the DBC file"] += 1
            return
        message, taken = found
        self.seen[f"{message.name}@{bus}" if bus else message.name] = message
        if not taken:
            log.passed[f"CAN message {message.name}"] += 1
            return
        try:
            raw = message.decode(data, decode_choices=False, scaling=False, allow_truncated=True)
        except Exception:  # a multiplexer value without signals, a container that is cut
            log.drop(f"{message.name}: cannot be decoded")
            return
        for signal, name, codes in taken:
            value = raw.get(signal.name)
            if value is None:
                log.passed[f"frame of {message.name} without {signal.name} (another multiplexer value, or too short)"] += 1
            elif value in codes:
                log.drop(f"{name}: marked as no value ({codes[value]})")
            else:
                physical = float(signal.conversion.raw_to_scaled(value, decode_choices=False))
                log.add(f"{name}@{bus}" if bus else name, "number", seconds, (physical,), signal.unit or "")

    def candidates(self):
        """Signals of the messages that were seen, for errors."""
        for name, message in self.seen.items():
            at, bus = ("@", name.partition("@")[2]) if "@" in name else ("", "")
            yield from (f"{message.name}.{signal.name}{at}{bus}" for signal in message.signals)

    def missing(self, name):
        """Why no frame gave a signal of that name."""
        if not self.path:
            return "; frames were counted only: pass --dbc FILE" if self.unmatched else ""
        message = self.names.get(name.partition(".")[0])
        if message is None:
            return listed(self.names, f"; the messages of {self.path} are ")
        if name.partition("@")[0].partition(".")[2] not in [signal.name for signal in message.signals]:
            return listed([signal.name for signal in message.signals], f"; the signals of {message.name} are ")
        passed = [f"{frame} ({count})" for frame, count in self.unmatched.most_common()]
        return f"; no frame {message.frame_id:X} of {message.name} gave it" + listed(passed, "; passed over: ", 8)


def screen(path):
    """What candump prints on a screen: `(stamp) can0 123 [2] 01 02`; the stamp may be a date (-tA), taken as UTC."""
    with open(path, encoding="utf-8", errors="replace") as file:
        for line in file:
            found = SCREEN.match(line)
            if not found or "remote" in found[5]:
                yield None
                continue
            stamp = found[1].strip()
            date = "-" in stamp[1:] and datetime.fromisoformat(stamp).replace(tzinfo=timezone.utc)
            data = bytes.fromhex("".join(found[5].split()[: int(found[4])]))
            yield can.Message(date.timestamp() if date else float(stamp), int(found[3], 16), len(found[3]) > 3, data=data, channel=found[2],
                              is_fd=len(data) > 8, check=False)


def read(path, kind, log, bus):
    """A log of the kind candump, screen, asc, blf, trc or mf4."""
    readers = {"candump": can.CanutilsLogReader, "screen": screen, "asc": can.ASCReader, "blf": can.BLFReader, "trc": can.TRCReader,
               "mf4": can.MF4Reader}
    first, frames, before = None, 0, len(log.passed)
    try:
        for message in bar(readers[kind](str(path)), Path(path).name):
            frames += 1
            if message is None:
                log.drop("lines that are not a frame")
            elif message.is_error_frame or message.is_remote_frame:
                log.passed["CAN error frame" if message.is_error_frame else "CAN remote frame"] += 1
            else:
                first = message.channel if first is None else first
                channel = message.channel + FIRST_IS_0.get(kind, 0) if isinstance(message.channel, int) else message.channel
                own = channel is None or (channel <= 1 if isinstance(channel, int) else channel == first)
                bus.add(log, message.timestamp, "" if own else str(channel), message.arbitration_id, message.is_extended_id, bytes(message.data))
    except Exception as error:  # the libraries raise whatever a damaged line provokes
        hint = ""
        if kind == "asc" and isinstance(error, ValueError) and "invalid literal" in str(error):
            hint = "; lines with names of messages in place of identifiers are not read: export them as numbers"
        if not frames:
            raise Refused(f"{path}: no frame of this {kind} log can be read: {error}{hint}") from None
        log.drop(f"damaged after {frames} frames, the rest is not read: {error}{hint}")
    if not frames and len(log.passed) == before:
        raise Refused(f"{path}: no frame in this {kind} log; its lines are not of the form that its beginning says")

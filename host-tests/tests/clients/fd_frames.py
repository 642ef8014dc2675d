"""Reads a candump log with cantools: each CAN FD frame of the yaw says what the three classic ones before it say.

Argument: DBC file. Standard input: the log. Prints the number of CAN FD frames.
"""

import re
import sys

import cantools

database = cantools.database.load_file(sys.argv[1])
classic, frames = {}, 0
for line in sys.stdin:
    identifier, fast, data = re.match(r"\([\d.]+\) can0 ([0-9A-F]{3})#(#1)?([0-9A-F]*)", line).groups()
    message = database.get_message_by_frame_id(int(identifier, 16))
    values = message.decode(bytes.fromhex(data))
    if message.is_fd != bool(fast):
        sys.exit(f"{message.name}: the file and the bus disagree")
    if not fast:
        classic.update(values)
        continue
    if values != classic:
        sys.exit(f"{values} is not {classic}")
    classic, frames = {}, frames + 1
print(frames, "CAN FD frames")

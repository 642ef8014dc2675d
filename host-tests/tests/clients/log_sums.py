"""Reads a candump log with cantools: the rates of 0x1A0, summed, against the accumulated angle of 0x1A1.

Argument: DBC file. Standard input: the log. Prints frames, the sum, the angle and their difference, deg.
"""

import re
import sys

import cantools

database = cantools.database.load_file(sys.argv[1])
PERIOD = 0.01
INITIALISING = 2
total, first, last, frames, quality = 0.0, None, None, 0, INITIALISING
for line in sys.stdin:
    identifier, data = re.match(r"\([\d.]+\) can0 ([0-9A-F]{3})#([0-9A-F]*)", line).groups()
    identifier = int(identifier, 16)
    values = database.get_message_by_frame_id(identifier).decode(bytes.fromhex(data), decode_choices=False)
    frames += 1
    if identifier == 0x1A0:
        quality = values["Quality"]
        if quality < INITIALISING:
            total += values["Rate"] * PERIOD
    elif identifier == 0x1A1 and quality < INITIALISING:
        last = values["Yaw"]
        if first is None:
            # The first angle holds the first rate.
            first = last - total
if first is None:
    sys.exit("no angle message behind the initialisation")
print(frames, "frames, sum", total, "deg, angle", last - first, "deg, off by", abs(total - (last - first)))

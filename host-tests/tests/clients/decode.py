"""Decodes frames with cantools, for a test that knows what was put in.

Argument: DBC file. Standard input: one frame a line, identifier and data in hexadecimal. Prints
message, signal and physical value of each signal.
"""

import sys

import cantools

database = cantools.database.load_file(sys.argv[1])
for line in sys.stdin:
    identifier, data = line.split()
    message = database.get_message_by_frame_id(int(identifier, 16))
    signals = message.decode(bytes.fromhex(data), decode_choices=False)
    for name, value in signals.items():
        print(message.name, name, repr(float(value)))

"""Reads SLCAN with python-can, decodes with cantools, sums up the yaw rates.

Arguments: channel, DBC file, number of samples. Prints the sums in degrees.
"""

import sys

import can
import cantools

PERIOD_S = 0.01
WRAP = 360.0

channel, dbc, samples = sys.argv[1], sys.argv[2], int(sys.argv[3])
database = cantools.database.load_file(dbc)
bus = can.Bus(interface="slcan", channel=channel, bitrate=500000, sleep_after_open=0.1)
print("version", *bus.get_version(timeout=5))
print("serial", bus.get_serial_number(timeout=5))
drop_in = full = turned = last = 0.0
counters = set()
angles = frames = 0
while angles < samples:
    message = bus.recv(timeout=10)
    if message is None:
        sys.exit(f"silence after {frames} frames")
    frames += 1
    signals = database.decode_message(message.arbitration_id, message.data)
    if "YawRate" in signals:
        drop_in += signals["YawRate"] * PERIOD_S
    elif "Rate" in signals:
        full += signals["Rate"] * PERIOD_S
        counters.add(signals["Rate_Counter"])
        quality = signals["Quality"]
    elif "Yaw" in signals:
        turned += (signals["Yaw"] - last + WRAP / 2) % WRAP - WRAP / 2
        last = signals["Yaw"]
        angles += 1
print("frames", frames)
print("counters", len(counters), quality)
print("drop_in", f"{drop_in:.9f}")
print("full", f"{full:.9f}")
print("yaw", f"{turned:.9f}")
bus.shutdown()

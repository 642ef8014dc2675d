"""Reads SLCAN with python-can, decodes with cantools, sums up the yaw rates.

Arguments: channel, DBC file, number of samples. Prints the sums in degrees, over what is marked
good or degraded; "plain" is what the drop-in message would give if each were rounded by itself.
"""

import sys

import can
import cantools

PERIOD_S = 0.01
DROP_IN_LSB = 0.005
WRAP = 360.0
# An answer comes behind all frames that wait to be read: a megabyte, a byte a call.
LIMIT_S = 300

channel, dbc, samples = sys.argv[1], sys.argv[2], int(sys.argv[3])
database = cantools.database.load_file(dbc)
bus = can.Bus(interface="slcan", channel=channel, bitrate=500000, sleep_after_open=0.1)
print("version", *bus.get_version(timeout=LIMIT_S))
print("serial", bus.get_serial_number(timeout=LIMIT_S))
drop_in = full = plain = turned = last = 0.0
counters = set()
details = frames = good = 0
quality = None
names = {}
while details < samples:
    message = bus.recv(timeout=LIMIT_S)
    if message is None:
        sys.exit(f"silence after {frames} frames")
    frames += 1
    # An identifier that the file does not know, or a wrong length, is an error here.
    signals = database.decode_message(message.arbitration_id, message.data)
    name = database.get_message_by_frame_id(message.arbitration_id).name
    names[name] = names.get(name, 0) + 1
    if "YawRate" in signals and signals["YawRate_STAT"] == "ok":
        drop_in += signals["YawRate"] * PERIOD_S
    elif "Rate" in signals:
        counters.add(signals["Rate_Counter"])
        quality = signals["Quality"]
        if quality in ("good", "degraded"):
            good += 1
            full += signals["Rate"] * PERIOD_S
            plain += round(signals["Rate"] / DROP_IN_LSB) * DROP_IN_LSB * PERIOD_S
    elif "Yaw" in signals:
        turned += (signals["Yaw"] - last + WRAP / 2) % WRAP - WRAP / 2
        last = signals["Yaw"]
    elif "Latency" in signals:
        details += 1
print("frames", frames, *(f"{name}:{names[name]}" for name in sorted(names)))
print("counters", len(counters), quality)
print("good", good)
print("drop_in", f"{drop_in:.9f}")
print("full", f"{full:.9f}")
print("plain", f"{plain:.9f}")
print("yaw", f"{turned:.9f}")
bus.shutdown()

"""Reads an MCAP of `gyronet replay --mcap` with the reference reader, checks every message against the schema in the file,
and prints the sums of what is in it as JSON.

usage: read_replay.py FILE.mcap
"""

import json
import sys
from collections import Counter

from mcap.reader import make_reader


def fits(value, schema):
    kinds = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    return any(fits_kind(value, kind, schema) for kind in kinds)


def fits_kind(value, kind, schema):
    if kind == "object":
        properties = schema["properties"]
        return isinstance(value, dict) and value.keys() == properties.keys() and all(
            fits(value[name], properties[name]) for name in properties
        )
    if kind == "array":
        return isinstance(value, list) and all(fits(item, schema["items"]) for item in value)
    types = {"number": (int, float), "integer": int, "string": str, "boolean": bool, "null": type(None)}
    return isinstance(value, types[kind]) and (kind == "boolean" or not isinstance(value, bool))


counts, statuses, frames = Counter(), [], []
yaw, last = 0.0, 0
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        value = json.loads(message.data)
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        assert fits(value, json.loads(schema.data)), (schema.name, value)
        stamp = value["timestamp"]
        assert message.log_time == 10**9 * stamp["sec"] + stamp["nsec"]
        counts[f"{channel.topic} {schema.name}"] += 1
        if channel.topic == "/rate":
            yaw = value["yaw"]
        elif channel.topic == "/status":
            statuses.append(value["message"])
        elif channel.topic == "/can":
            us, width = stamp["nsec"] // 1000, 8 if value["extended"] else 3
            frames.append(f"({stamp['sec']}.{us:06}) can0 {value['id']:0{width}X}#{value['data']}")
print(json.dumps({"counts": counts, "statuses": statuses, "yaw": yaw, "frames": frames}))

"""`wheels from-dbc`: settings of wheel frames from a DBC file. What the board's settings cannot say is a remark or a refusal."""

import json
import re
import sys
import tomllib
from pathlib import Path

from gyronet import dbc
from gyronet import units
from gyronet.refused import Refused, listed

WHEELS = ["front-left", "front-right", "rear-left", "rear-right"]
WHEEL_NAME = re.compile(r"wh(ee)?l|rad|speed|spd|geschw|[fr][lr]$|[vh][lr]$", re.IGNORECASE)
SAYS_VALID = re.compile(r"valid|qf|qual|stat|fault|fail|err|inv|gult|gült", re.IGNORECASE)
SAYS_FAULT = re.compile(r"fault|fail|err|inv|fehl|ung(ue|ü)lt|not", re.IGNORECASE)
SAYS_GOOD = re.compile(r"valid$|vld$|g(ue|ü)ltig|\bok\b|\bgood\b|normal", re.IGNORECASE)
SAYS_BACK = re.compile(r"back|revers|r(ue|ü)ckw", re.IGNORECASE)
MOST_CODES = 3
SLOWEST_RANGE, LARGEST = 150.0, 400.0  # km/h: a range that ends below says nothing of a car's speeds; the board's own
SAYS_DIRECTION = re.compile(r"dir|richt|revers|backw|forw", re.IGNORECASE)


def from_dbc(path, signals, flags=()):
    """The settings file's text and remarks; `signals` is a name, SIGNAL or MESSAGE.SIGNAL, by wheel; `flags` give units."""
    flags = units.Flags(flags)
    for left, right in (WHEELS[:2], WHEELS[2:]):
        if (left in signals) != (right in signals):
            raise Refused(f"--{left} and --{right}: both wheels of an axle are needed")
    remarks, frames, used = [], {}, set()
    database = dbc.load(path, remarks)
    for wheel in WHEELS:
        if wheel in signals:
            message, signal = find(path, database, signals[wheel], remarks)
            frames.setdefault((message.frame_id, message.is_extended_frame), (message, []))[1].append(
                entry(path, wheel, message, signal, flags, remarks, used)
            )
    lines = ["timeout_ms = 100", "still_speed_kmh = 0.1", "still_for_ms = 500"]
    for (identifier, extended), (message, entries) in frames.items():
        lines += ["", f"[[frame]] # {message.name}", f"id = {identifier:#x}", *(["extended = true"] if extended else [])]
        for one in entries:
            lines += ["", "[[frame.signal]]", *(f"{key} = {value}" for key, value in one.items())]
        remarks += about(database, message, used)
    flags.check()
    return "\n".join(lines) + "\n", list(dict.fromkeys(remarks))


def find(path, database, name, remarks):
    message_name, _, signal_name = name.rpartition(".")
    found = [(message, signal) for message in database.messages for signal in message.signals
             if signal.name == signal_name and message_name in ("", message.name)]
    if len(found) == 1:
        return found[0]
    if found:
        raise Refused(f"{path}: {name} is in {', '.join(message.name for message, _ in found)}: name one as MESSAGE.SIGNAL")
    near = [f"{message.name}.{signal.name}" for message in database.messages for signal in message.signals
            if WHEEL_NAME.search(signal.name) or signal_name.lower() in signal.name.lower()]
    raise Refused(f"{path}: no signal {name}" + listed(near, "; there are ", 8) + listed(remarks, "; "))


def entry(path, wheel, message, signal, flags, remarks, used):
    """One wheel's signal in the settings."""
    name = f"{message.name}.{signal.name}"

    def refuse(reason):
        raise Refused(f"{path}: {name}: {reason}")

    if message.is_fd or message.length > 8:
        refuse(f"the message has {message.length} bytes (CAN FD); the board receives classic frames of up to 8")
    if signal.multiplexer_ids is not None or signal.is_multiplexer:
        refuse("is multiplexed; the board reads frames with one layout")
    if signal.is_float:
        refuse("is a floating-point number; the board reads integers")
    unit = units.find(flags.get(name) or flags.get(signal.name) or signal.unit)
    if not unit or unit[0] != "speed":
        refuse(f'the unit "{signal.unit or ""}" is not km/h, m/s or mph; give it: --unit {signal.name}=km/h')
    place = signal.start if signal.byte_order == "little_endian" else 8 * (signal.start // 8) + 7 - signal.start % 8
    if signal.length > 32 or place + signal.length > 64:
        refuse(f"{signal.length} bits from bit {signal.start} on: the board reads up to 32 bits in 8 bytes")
    kmh = unit[1] * 3.6
    factor, offset = (round(number * kmh, 12) for number in (signal.scale, signal.offset))
    if not 0 < abs(factor) < 100:
        refuse(f"a factor of {factor} km/h; the board takes below 100, not 0")
    result = {
        "wheel": f'"{wheel}"',
        "start_bit": signal.start,
        "bits": signal.length,
        "order": '"intel"' if signal.byte_order == "little_endian" else '"motorola"',
        **({"signed": "true"} if signal.is_signed else {}),
        "factor_kmh": float(factor),
        "offset_kmh": float(offset),
    }
    codes = {raw & (1 << signal.length) - 1: text for raw, text in sorted(dbc.codes(signal).items())}
    kept = sorted(codes, reverse=True)[:MOST_CODES]
    if kept:
        result["invalid"] = hex(kept[0]) if len(kept) == 1 else f"[{', '.join(map(hex, kept))}]"
    for raw in sorted(set(codes) - set(kept)):
        value = raw - (1 << signal.length) if signal.is_signed and raw >> signal.length - 1 else raw
        remarks.append(f"{name}: {raw:#x} ({codes[raw]}) is no speed either, but the settings hold {MOST_CODES} codes: the board reads "
                       f"{value * factor + offset:.1f} km/h")
    # Half a count beyond, since the board rounds factor and offset.
    low, high = ((limit or 0.0) * kmh + side * 0.5 * abs(factor) for limit, side in ((signal.minimum, -1), (signal.maximum, 1)))
    if high >= SLOWEST_RANGE and low <= 0.0:
        limits = [round(max(low, -LARGEST), 6), round(min(high, LARGEST), 6)]
        result.update({"range_kmh": limits} if limits != [-LARGEST, LARGEST] else {})
    elif signal.maximum:
        remarks.append(f"{name}: its range, {signal.minimum or 0:g} to {signal.maximum:g}, is not used, since a car leaves it")
    for key, value_of in (("valid_when", valid_value), ("reverse_when", reverse_value)):
        beside = [(other, value_of(other)) for other in message.signals if other.name.startswith(signal.name) and other.name != signal.name]
        beside = [(other, value) for other, value in beside if value is not None]
        if len(beside) == 1:
            other, value = beside[0]
            order = result["order"] if other.byte_order == signal.byte_order else '"intel"' if signal.byte_order == "big_endian" else '"motorola"'
            result[key] = f"{{ start_bit = {other.start}, bits = {other.length}, order = {order}, value = {value} }}"
            used.add(other.name)
    return result


def valid_value(signal):
    """The value of a field that says "valid"; None where the DBC file does not tell."""
    if signal.length > 4 or not SAYS_VALID.search(signal.name):
        return None
    good = [int(raw) for raw, text in (signal.choices or {}).items() if SAYS_GOOD.search(str(text)) and not SAYS_FAULT.search(str(text))]
    if signal.choices:
        return good[0] if len(good) == 1 else None
    return 0 if SAYS_FAULT.search(signal.name) else 1 if SAYS_GOOD.search(signal.name) and signal.length == 1 else None


def reverse_value(signal):
    """The value of a field that says "backwards"."""
    back = [int(raw) for raw, text in (signal.choices or {}).items() if SAYS_BACK.search(str(text))]
    return back[0] if len(back) == 1 and signal.length <= 4 else None


def about(database, message, used):
    """What the DBC file says of a message beyond its speeds, and the settings do not."""
    if dbc.is_j1939(database, message) and message.frame_id & 0xFF == 0xFE:
        yield (
            f"{message.name}: address FE stands for any sender, but the board compares the whole identifier: set the"
            " sender's address in id"
        )
    for signal in message.signals:
        if signal.name not in used and signal.length <= 4 and (SAYS_VALID.search(signal.name) or SAYS_DIRECTION.search(signal.name)):
            what = "a direction" if SAYS_DIRECTION.search(signal.name) else "validity"
            yield f"{message.name}.{signal.name} (bit {signal.start}, {signal.length} bits) seems to be {what}: not read, since the DBC file does not say which value means what: add it by hand"
    if any(re.search(r"crc|checks|chks|counter|alive|\bcnt", signal.name, re.IGNORECASE) for signal in message.signals):
        yield f"{message.name} has a checksum or a counter: add it by hand, since a DBC file does not say how it is computed"


def listing(path):
    """The messages with a signal that could be a wheel's speed, with all their signals."""
    database = dbc.load(path)
    messages = [message for message in database.messages
                if any((units.find(signal.unit) or [""])[0] == "speed" and WHEEL_NAME.search(signal.name) for signal in message.signals)]
    for message in messages or database.messages:
        yield f"{message.name} ({message.frame_id:#x}, {message.length} bytes)"
        for signal in message.signals:
            codes = "".join(f', {raw} "{text}"' for raw, text in (signal.choices or {}).items())
            yield (f"  {message.name}.{signal.name}: {signal.length} bits from {signal.start}, {'signed, ' if signal.is_signed else ''}"
                   f'x {signal.scale:g} {signal.offset:+g} "{signal.unit or ""}"{codes}')


def run(args):
    signals = {wheel: name for wheel in WHEELS if (name := getattr(args, wheel.replace("-", "_")))}
    if not signals:
        print("\n".join(listing(args.file)))
        raise Refused("no signal is named, nothing is written: choose with --rear-left SIGNAL --rear-right SIGNAL")
    text, remarks = from_dbc(args.file, signals, args.unit)
    if args.json and not args.out:
        print(json.dumps({**tomllib.loads(text), "remarks": remarks}))
        return
    for remark in [] if args.quiet else remarks:
        print(f"remark: {remark}", file=sys.stderr)
    if not args.out:
        print(text, end="")
        return
    try:
        Path(args.out).write_text(text, encoding="utf-8")
    except OSError as error:
        raise Refused(f"{args.out}: {error.strerror}") from None

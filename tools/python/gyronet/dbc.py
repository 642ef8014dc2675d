"""DBC files by cantools, with what its users meet: identifiers without bit 31, error codes by many names, J1939 by PGN."""

import re

import cantools

from gyronet.refused import Refused, listed

# Descriptions of raw values that are no measurement, as DBC files of several makers write them.
NO_VALUE = re.compile(
    r"inval|not[ _]?valid|not["
    r" _]?avail|\bsna\b|^sna|\bn/?a\b|unavail|err|fehl|fault|fail|init|undervolt|unterspann|unknown|undefin"
    r"|ung(ue|ü)ltig|nicht|defekt|reserv|no[ _]?(data|value|signal)|missing|default|not["
    r" _]?(used|def|known|support)|unplaus|implaus|timeout",
    re.IGNORECASE,
)


MENDED = 200  # statements that are left out at most


def load(path, notes=None):
    """The database of a DBC file, without the statements that cantools cannot read; `notes` gets what was mended."""
    try:
        with open(path, encoding="cp1252", errors="replace") as file:
            text = file.read()
    except OSError as error:
        raise Refused(f"{path}: {error.strerror}") from None
    text, wide = _with_bit_31(text)
    left_out, database = [], None
    while database is None:
        try:
            database = cantools.database.load_string(text, "dbc", strict=False)
        except Exception as error:  # cantools gives its parser's and its own errors
            text, statements = _without(text, str(error))
            left_out += statements
            if not statements or len(left_out) > MENDED or not re.search(r"^\s*BO_\s", text, re.MULTILINE):
                raise Refused(f"{path}: not a valid DBC file: {' '.join(str(error).split())}") from None
    if wide and notes is not None:
        notes.append(f"{path}: taken as 29-bit identifiers, although bit 31 is not set: {', '.join(map(hex, wide[:8]))}")
    if left_out and notes is not None:
        notes.append(f"{path}: left out, since cantools cannot read them{listed(left_out, ': ', 4)}")
    return database


def _without(text, error):
    """Empties the statement at which cantools stopped, a message with its signals; values of signals that are not there."""
    lines = text.split("\n")
    if found := re.search(r"line (\d+), column", error):
        first = behind = int(found[1]) - 1
        behind += 1
        while lines[first].lstrip().startswith("BO_ ") and behind < len(lines) and lines[behind].lstrip().startswith("SG_"):
            behind += 1
        places = range(first, behind)
    else:
        unused = re.findall(r"VAL_ (\d+) (\w+)", error)
        places = [k for k, line in enumerate(lines) if tuple(line.split()[:3]) in [("VAL_", *names) for names in unused]]
    statements = [f"line {k + 1}: {lines[k].strip()[:40]}" for k in places if lines[k].strip()]
    for k in places:
        lines[k] = ""
    return "\n".join(lines), statements


def _with_bit_31(text):
    """Sets bit 31 of identifiers that have more than 11 bits without it, wherever the file names them."""
    wide = {number for number in re.findall(r"^\s*BO_\s+(\d+)", text, re.MULTILINE) if 0x7FF < int(number) < 1 << 29}
    for number in wide:
        text = re.sub(rf"(\b(?:BO_|SG_|VAL_|SG_MUL_VAL_|SIG_VALTYPE_|SIG_GROUP_|BO_TX_BU_)\s+){number}\b",
                      rf"\g<1>{int(number) | 1 << 31}", text)
    return text, sorted(map(int, wide))


def codes(signal):
    """Raw values of a signal that are no measurement, with their descriptions: by name, or described ones at the top of the range."""
    top = (1 << signal.length - signal.is_signed) - 1
    return {int(raw): str(text) for raw, text in (signal.choices or {}).items()
            if NO_VALUE.search(str(text)) or not re.search(r"\d", str(text)) and raw >= top - max(top >> 6, 2)}


def is_j1939(database, message):
    attributes = getattr(database.dbc, "attributes", None) or {}
    protocol = str(getattr(attributes.get("ProtocolType"), "value", "")).lower()
    return message.is_extended_frame and ("j1939" in (protocol, message.protocol or "") or message.frame_id & 0xFF == 0xFE)


def group(identifier):
    """The parameter group of a J1939 identifier: without priority, source address and, under 0xF0, destination."""
    return identifier & (0x03FFFF00 if identifier >> 16 & 0xFF >= 0xF0 else 0x03FF0000)

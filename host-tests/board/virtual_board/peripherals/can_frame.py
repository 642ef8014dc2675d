"""Data and remote frames of CAN 2.0: their bits with stuffing, their length and their priority (ISO 11898-1 section 10)."""

from functools import lru_cache
from typing import NamedTuple


class Frame(NamedTuple):
    """One frame; `length` is the DLC, which a remote frame has without data."""

    identifier: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    length: int = 0

    @classmethod
    def of(cls, identifier, data=b"", extended=False, remote=False):
        """A frame whose DLC is the number of its data bytes."""
        return cls(identifier, bytes(data), extended, remote, len(data))


def priority(frame):
    """The arbitration field as a number; the lower one wins the bus."""
    if frame.extended:
        base, rest = frame.identifier >> 18, frame.identifier & 0x3_FFFF
        return base << 21 | 3 << 19 | rest << 1 | frame.remote
    return frame.identifier << 21 | frame.remote << 20


@lru_cache(maxsize=4096)
def stuffed_bits(frame):
    """Number of bits from the start of frame to the end of the CRC, stuff bits included."""
    bits = "0"
    if frame.extended:
        bits += f"{frame.identifier >> 18:011b}11{frame.identifier & 0x3_FFFF:018b}{int(frame.remote)}00"
    else:
        bits += f"{frame.identifier:011b}{int(frame.remote)}00"
    bits += f"{frame.length:04b}"
    if not frame.remote:
        bits += "".join(f"{byte:08b}" for byte in frame.data)
    bits += f"{_crc(bits):015b}"
    stuffed, run, last = len(bits), 0, ""
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed += 1
            run, last = 1, "1" if bit == "0" else "0"
    return stuffed


def _crc(bits):
    """CRC-15 with the polynomial 0x4599."""
    crc = 0
    for bit in bits:
        crc = (crc << 1) ^ (0x4599 if (crc >> 14 & 1) != (bit == "1") else 0)
        crc &= 0x7FFF
    return crc


#: CRC delimiter, acknowledge slot and its delimiter, end of frame.
TAIL_BITS = 1 + 1 + 1 + 7
INTERMISSION_BITS = 3


def frame_bits(frame):
    """Number of bits from the start of frame to the end of frame."""
    return stuffed_bits(frame) + TAIL_BITS

"""Frames of CAN 2.0 and CAN FD: their bits with stuffing, their length and their priority (ISO 11898-1 section 10)."""

import re
from functools import lru_cache
from typing import NamedTuple

#: Data bytes by DLC.
LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)


class Frame(NamedTuple):
    """One frame; `length` is the DLC, which a remote frame has although it carries no data."""

    identifier: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    length: int = 0
    #: Whether it is a CAN FD frame, and whether its data have the higher bit rate.
    fd: bool = False
    fast: bool = False

    @classmethod
    def of(cls, identifier, data=b"", extended=False, remote=False, fd=False, fast=False):
        """Returns a frame whose DLC is that of its number of data bytes."""
        return cls(identifier, bytes(data), extended, remote, LENGTHS.index(len(data)), fd, fast)


def priority(frame):
    """Returns the arbitration field as a number; the lower one wins the bus."""
    if frame.extended:
        base, rest = frame.identifier >> 18, frame.identifier & 0x3_FFFF
        return base << 21 | 3 << 19 | rest << 1 | frame.remote
    return frame.identifier << 21 | frame.remote << 20


RUNS = re.compile("0+|1+")


@lru_cache(maxsize=4096)
def stuffed_bits(frame):
    """Returns the number of bits from the start of frame to the end of the CRC, stuff bits included."""
    bits = "0"
    if frame.extended:
        bits += f"{frame.identifier >> 18:011b}11{frame.identifier & 0x3_FFFF:018b}{int(frame.remote)}00"
    else:
        bits += f"{frame.identifier:011b}{int(frame.remote)}00"
    bits += f"{frame.length:04b}"
    if not frame.remote:
        bits += "".join(f"{byte:08b}" for byte in frame.data)
    bits += f"{_crc(bits):015b}"
    return _stuffed(bits)


def _stuffed(bits):
    # After five equal bits a stuff bit is inserted, which starts the next run of equal bits.
    stuffed, first = len(bits), 0
    for run in RUNS.finditer(bits):
        equal = first + run.end() - run.start()
        stuffed += equal // 5
        first = equal % 5 == 0
    return stuffed


def _crc(bits):
    """Returns the CRC-15 with the polynomial 0x4599, which begins at 0, so that leading zeros change nothing."""
    crc = 0
    for bit in bits:
        crc = crc << 1 & 0x7FFF ^ (0x4599 if crc >> 14 ^ (bit == "1") else 0)
    return crc


#: CRC delimiter, acknowledge slot and its delimiter, end of frame.
TAIL_BITS = 1 + 1 + 1 + 7
INTERMISSION_BITS = 3


def frame_bits(frame):
    """Returns the number of bits from the start of frame to the end of frame."""
    return stuffed_bits(frame) + TAIL_BITS


def duration(frame, bit_ps, data_bit_ps):
    """Returns the time from the start of frame to the end of frame in picoseconds."""
    if not frame.fd:
        return frame_bits(frame) * bit_ps
    base = f"{frame.identifier >> 18:011b}11{frame.identifier & 0x3_FFFF:018b}" if frame.extended else f"{frame.identifier:011b}0"
    # RRS (in the base format before IDE), FDF, res, BRS: the data's bit rate begins with ESI.
    head = f"0{base}010{int(frame.fast)}"
    body = head + f"0{frame.length:04b}" + "".join(f"{byte:08b}" for byte in frame.data)
    slow = _stuffed(head)
    # The stuff count of four bits and the CRC have a fixed stuff bit before the first and after every fourth bit.
    crc = 17 if len(frame.data) <= 16 else 21
    fast = _stuffed(body) - slow + 4 + crc + 1 + (4 + crc - 1) // 4
    return (slow + TAIL_BITS) * bit_ps + fast * (data_bit_ps if frame.fast else bit_ps)

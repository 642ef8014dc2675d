"""Accesses narrower than a register are cut out of its 32-bit word, and checked against the sizes that the manual allows."""

from ..violation import Violation

WORD = (4,)
HALF_WORD = (2, 4)
ANY = (1, 2, 4)
_MASK = {1: 0xFF, 2: 0xFFFF, 4: 0xFFFF_FFFF}


def check(peripheral, offset, size, allowed):
    """An access of a size that the register's section does not allow raises `Violation`."""
    if size not in allowed:
        raise Violation(f"{peripheral.name}: access of {size} bytes at offset {offset:#x}; allowed are {allowed}")


def cut(word, offset, size):
    """A load of `size` bytes at `offset` sees this part of the register's word."""
    if size == 4:
        return word
    return (word >> (8 * (offset & 3))) & _MASK[size]


def merge(old, value, offset, size):
    """A store of `size` bytes at `offset` leaves this word in the register."""
    if size == 4:
        return value
    shift = 8 * (offset & 3)
    mask = _MASK[size] << shift
    return (old & ~mask) | ((value << shift) & mask)


def unmodelled(peripheral, offset, access):
    """An access to a register that does not exist or is left out becomes this `Violation`."""
    return Violation(f"{peripheral.name}: {access} of offset {offset:#x}, which is reserved or not modelled")

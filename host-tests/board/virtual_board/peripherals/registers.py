"""Helpers for accesses narrower than a 32-bit register, and for the access sizes that the manual allows."""

from ..violation import Violation

WORD = (4,)
HALF_WORD = (2, 4)
ANY = (1, 2, 4)
_MASK = {1: 0xFF, 2: 0xFFFF, 4: 0xFFFF_FFFF}


def check(peripheral, offset, size, allowed):
    """Raises `Violation` for an access of a size that the register's section does not allow."""
    if size not in allowed:
        raise Violation(f"{peripheral.name}: access of {size} bytes at offset {offset:#x}; allowed are {allowed}")


def cut(word, offset, size):
    """Returns the part of the register's word that a load of `size` bytes at `offset` reads."""
    if size == 4:
        return word
    return (word >> (8 * (offset & 3))) & _MASK[size]


def merge(old, value, offset, size):
    """Returns the register's word after a store of `size` bytes at `offset`."""
    if size == 4:
        return value
    shift = 8 * (offset & 3)
    mask = _MASK[size] << shift
    return (old & ~mask) | ((value << shift) & mask)


def unmodelled(peripheral, offset, access):
    """Returns the `Violation` for an access to a register that does not exist or is not modelled."""
    return Violation(f"{peripheral.name}: {access} of offset {offset:#x}, which is reserved or not modelled")

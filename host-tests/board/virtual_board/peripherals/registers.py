"""Blocks of registers: the access sizes that the manual allows, accesses narrower than a register, and what is not modelled."""

from ..peripheral import Peripheral
from ..violation import Violation

WORD = (4,)
HALF_WORD = (2, 4)
ANY = (1, 2, 4)
_MASK = {1: 0xFF, 2: 0xFFFF, 4: 0xFFFF_FFFF}


class Registers(Peripheral):
    """A block of registers by the offsets of their words. Those that need more are handled by a subclass in `load` and `store`."""

    #: Reset value and writable bits of registers that keep what is written.
    kept: dict[int, tuple[int, int]] = {}
    #: Attributes that are read, and methods that take what is written; they come before `kept`.
    readers: dict[int, str] = {}
    writers: dict[int, str] = {}
    #: The sizes that the registers' section allows.
    sizes = WORD

    def __init__(self, board):
        super().__init__(board)
        self.values = {offset: value for offset, (value, _) in self.kept.items()}

    def reset(self, cause):
        self.values = {offset: value for offset, (value, _) in self.kept.items()}

    def read(self, offset, size):
        check(self, offset, size, self.sizes)
        value = self.load(offset & ~3)
        return value if size == 4 else cut(value, offset, size)

    def write(self, offset, value, size):
        check(self, offset, size, self.sizes)
        if size != 4:
            value = merge(self.under(offset & ~3), value, offset, size)
        self.store(offset & ~3, value)

    def load(self, offset):
        """Reads a register."""
        if offset in self.readers:
            return getattr(self, self.readers[offset])
        if offset not in self.values:
            raise unmodelled(self, offset, "read")
        return self.values[offset]

    def store(self, offset, value):
        """Writes a register."""
        if offset in self.writers:
            getattr(self, self.writers[offset])(value)
            return
        if offset not in self.values:
            raise unmodelled(self, offset, "write")
        writable = self.kept[offset][1]
        self.values[offset] = self.values[offset] & ~writable | value & writable

    def under(self, offset):
        """Returns the word into which a narrower store is merged."""
        return self.values.get(offset, 0)


def check(peripheral, offset, size, allowed):
    """Raises `Violation` for an access of a size that the register's section does not allow."""
    if size not in allowed:
        raise Violation(f"{peripheral.name}: access of {size} bytes at offset {offset:#x}; allowed are {allowed}")


def cut(word, offset, size):
    """Returns the part of the register's word that a load of `size` bytes at `offset` reads."""
    return (word >> (8 * (offset & 3))) & _MASK[size]


def merge(old, value, offset, size):
    """Returns the register's word after a store of `size` bytes at `offset`."""
    shift = 8 * (offset & 3)
    mask = _MASK[size] << shift
    return (old & ~mask) | ((value << shift) & mask)


def unmodelled(peripheral, offset, access):
    """Returns the `Violation` for an access to a register that does not exist or is not modelled."""
    return Violation(f"{peripheral.name}: {access} of offset {offset:#x}, which is reserved or not modelled")

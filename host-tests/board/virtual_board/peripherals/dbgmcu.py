"""MCU debug component (RM0090 section 38.16) and the device signature (section 39).

DBGMCU_CR and the freeze registers keep their values and freeze nothing, since no debugger halts this board.
"""

from ..peripheral import Peripheral
from . import registers


class Dbgmcu(Peripheral):
    """IDCODE names an STM32F405 of revision Y; the reserved bits 15:12 read 6."""

    name, base = "DBGMCU", 0xE004_2000

    def __init__(self, board):
        super().__init__(board)
        self.idcode = 0x100F_6413
        self.values = {0x04: 0, 0x08: 0, 0x0C: 0}

    def reset(self, cause):
        """A system reset leaves these registers alone; only a power-on reset clears them (section 38.16.3)."""
        if cause == "por":
            self.values = dict.fromkeys(self.values, 0)

    def read(self, offset, size):
        registers.check(self, offset, size, registers.WORD)
        if offset == 0:
            return self.idcode
        if offset in self.values:
            return self.values[offset]
        raise registers.unmodelled(self, offset, "read")

    def write(self, offset, value, size):
        registers.check(self, offset, size, registers.WORD)
        if offset not in self.values:
            raise registers.unmodelled(self, offset, "write")
        self.values[offset] = value

    def configure(self, key, value):
        if key == "idcode":
            self.idcode = value
        else:
            super().configure(key, value)


class Signature(Peripheral):
    """The 96-bit unique identifier and the size of the flash in KiB, in system memory."""

    name, base, size = "SIGNATURE", 0x1FFF_7A00, 0x100

    def __init__(self, board):
        super().__init__(board)
        self.unique = bytes(range(0x30, 0x3C))

    def reset(self, cause):
        """System memory survives every reset."""

    def read(self, offset, size):
        page = bytearray(b"\xFF" * 0x100)
        page[0x10:0x1C] = self.unique
        page[0x22:0x24] = (1024).to_bytes(2, "little")
        if not 0x10 <= offset < 0x24:
            raise registers.unmodelled(self, offset, "read")
        return int.from_bytes(page[offset:offset + size], "little")

    def write(self, offset, value, size):
        raise registers.unmodelled(self, offset, "write")

"""MCU debug component (RM0090 section 38.16).

DBGMCU_CR and the freeze registers keep their values and freeze nothing, since no debugger halts this board. IDCODE
is that of revision Y.
"""

from ..peripheral import Peripheral
from . import registers


class Dbgmcu(Peripheral):
    """The DBGMCU registers. IDCODE names an STM32F405 of revision Y; its reserved bits 15:12 read 6."""

    name, base = "DBGMCU", 0xE004_2000

    def __init__(self, board):
        super().__init__(board)
        self.idcode = 0x100F_6413
        self.values = {0x04: 0, 0x08: 0, 0x0C: 0}

    def reset(self, cause):
        """Clears the registers after a power-on reset; a system reset does not change them (section 38.16.3)."""
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

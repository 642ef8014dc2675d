"""MCU debug component (RM0090 section 38.16).

DBGMCU_CR and the freeze registers keep their values and freeze nothing, since no debugger halts this board. IDCODE
is that of revision Y.
"""

from .registers import Registers


class Dbgmcu(Registers):
    """The DBGMCU registers. IDCODE names an STM32F405 of revision Y; its reserved bits 15:12 read 6."""

    name, base = "DBGMCU", 0xE004_2000
    kept = {0x04: (0, 0xFFFF_FFFF), 0x08: (0, 0xFFFF_FFFF), 0x0C: (0, 0xFFFF_FFFF)}
    readers, settings = {0x00: "idcode"}, {"idcode"}

    def __init__(self, board):
        super().__init__(board)
        self.idcode = 0x100F_6413

    def reset(self, cause):
        """Clears the registers after a power-on reset; a system reset does not change them (section 38.16.3)."""
        if cause == "por":
            super().reset(cause)

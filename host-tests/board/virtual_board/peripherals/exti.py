"""External interrupt and event controller (RM0090 section 12).

An edge sets its bit of PR whether or not IMR enables the interrupt; the manual's block diagram does not say. Left out: events
(EMR keeps its value; only interrupts wake WFE).
"""

from ..peripheral import Peripheral
from . import registers

LINES = 0x007F_FFFF
#: NVIC interrupt of each line (table 61).
INTERRUPTS = {**{line: 6 + line for line in range(5)}, **dict.fromkeys(range(5, 10), 23), **dict.fromkeys(range(10, 16), 40),
              16: 1, 17: 41, 18: 42, 20: 76, 21: 2, 22: 3}
_SHARED = {number: sum(1 << line for line, other in INTERRUPTS.items() if other == number) for number in set(INTERRUPTS.values())}


class Exti(Peripheral):
    """The registers of section 12.3; pins and the voltage detector drive them through `line`."""

    name, base = "EXTI", 0x4001_3C00

    def __init__(self, board):
        super().__init__(board)
        self.levels = 0
        self.imr = self.emr = self.rtsr = self.ftsr = self.swier = self.pr = 0

    def reset(self, cause):
        self.imr = self.emr = self.rtsr = self.ftsr = self.swier = self.pr = 0
        self._interrupts()

    def line(self, number, level):
        """Sets the input level of a line; a selected edge makes the line pending."""
        bit = 1 << number
        if bool(self.levels & bit) == bool(level):
            return
        self.levels ^= bit
        if (self.rtsr if level else self.ftsr) & bit:
            self.pr |= bit
            self._interrupts()

    def _interrupts(self):
        active = self.pr & self.imr
        for number, lines in _SHARED.items():
            self.board.irq(number, bool(active & lines))

    def read(self, offset, size):
        registers.check(self, offset, size, registers.WORD)
        if offset == 0x14:
            return self.pr
        if offset == 0x00:
            return self.imr
        if offset == 0x04:
            return self.emr
        if offset == 0x08:
            return self.rtsr
        if offset == 0x0C:
            return self.ftsr
        if offset == 0x10:
            return self.swier
        raise registers.unmodelled(self, offset, "read")

    def write(self, offset, value, size):
        registers.check(self, offset, size, registers.WORD)
        value &= LINES
        if offset == 0x00:
            self.imr = value
        elif offset == 0x04:
            self.emr = value
        elif offset == 0x08:
            self.rtsr = value
        elif offset == 0x0C:
            self.ftsr = value
        elif offset == 0x10:
            self.pr |= value & ~self.swier & self.imr
            self.swier |= value
        elif offset == 0x14:
            self.pr &= ~value
            self.swier &= ~value
        else:
            raise registers.unmodelled(self, offset, "write")
        self._interrupts()

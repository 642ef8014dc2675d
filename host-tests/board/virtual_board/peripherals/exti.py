"""External interrupt controller (RM0090 section 12) with the line of the voltage detector, 16.

An edge sets its bit of PR whether or not IMR enables the interrupt; the manual's block diagram does not say. Left out: all other
lines, events, and interrupts by software.
"""

from ..peripheral import Peripheral
from . import registers

LINE, INTERRUPT = 1 << 16, 1
IMR, RTSR, FTSR, PR = 0x00, 0x08, 0x0C, 0x14


class Exti(Peripheral):
    """The registers of section 12.3; the voltage detector calls `line`."""

    name, base = "EXTI", 0x4001_3C00

    def __init__(self, board):
        super().__init__(board)
        self.level = False
        self.words = dict.fromkeys((IMR, RTSR, FTSR, PR), 0)

    def reset(self, cause):
        self.words = dict.fromkeys(self.words, 0)
        self._interrupt()

    def line(self, level):
        """Sets the level of the voltage detector; a selected edge makes the line pending."""
        if level != self.level:
            self.level = level
            self.words[PR] |= self.words[RTSR if level else FTSR]
            self._interrupt()

    def _interrupt(self):
        self.board.irq(INTERRUPT, bool(self.words[PR] & self.words[IMR]))

    def read(self, offset, size):
        registers.check(self, offset, size, registers.WORD)
        if offset not in self.words:
            raise registers.unmodelled(self, offset, "read")
        return self.words[offset]

    def write(self, offset, value, size):
        registers.check(self, offset, size, registers.WORD)
        if offset not in self.words or value & ~LINE:
            raise registers.unmodelled(self, offset, f"write of {value:#x}")
        self.words[offset] = self.words[PR] & ~value if offset == PR else value
        self._interrupt()

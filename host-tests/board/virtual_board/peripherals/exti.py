"""External interrupt controller (RM0090 section 12) with the line of the voltage detector, 16.

An edge sets its bit of PR whether or not IMR enables the interrupt; the manual's block diagram does not say. Left out: all other
lines, events, and interrupts by software.
"""

from .registers import Registers, unmodelled

LINE, INTERRUPT = 1 << 16, 1
IMR, RTSR, FTSR, PR = 0x00, 0x08, 0x0C, 0x14


class Exti(Registers):
    """The registers of section 12.3; the voltage detector calls `line`."""

    name, base = "EXTI", 0x4001_3C00
    kept = dict.fromkeys((IMR, RTSR, FTSR, PR), (0, LINE))

    def __init__(self, board):
        super().__init__(board)
        self.level = False

    def reset(self, cause):
        super().reset(cause)
        self._interrupt()

    def line(self, level):
        """Sets the level of the voltage detector; a selected edge makes the line pending."""
        if level != self.level:
            self.level = level
            self.values[PR] |= self.values[RTSR if level else FTSR]
            self._interrupt()

    def _interrupt(self):
        self.board.irq(INTERRUPT, bool(self.values[PR] & self.values[IMR]))

    def store(self, offset, value):
        if value & ~LINE:
            raise unmodelled(self, offset, f"write of {value:#x}")
        super().store(offset, self.values[PR] & ~value if offset == PR else value)
        self._interrupt()

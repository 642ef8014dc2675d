"""SysTick (DDI0403 B3.3): a 24-bit counter whose value is computed from the board time, never stepped.

The counter takes the value RELOAD one clock after it was 0, so that a period is RELOAD + 1 clocks. With TICKINT it makes the
exception pending when it goes from 1 to 0. It counts the core's clocks. Left out: the external clock, COUNTFLAG, CALIB.
"""

from .nvic import SYSTICK
from .violation import Violation

ENABLE, TICKINT, CLKSOURCE = 1, 2, 4


class SysTick:
    """The counter. `start` is the board time at which it was at `value`."""

    base, size = 0xE000E010, 0x10

    def __init__(self, board):
        self.board = board
        self.event = None
        self.reset()

    def reset(self) -> None:
        """Stops the counter."""
        self.control = 0
        self.reload = 0
        self.value = 0
        self.start = 0
        self.period_ps = 1
        self._cancel()

    def _cancel(self) -> None:
        if self.event:
            self.event.cancel()
        self.event = None

    def hold(self) -> None:
        """Stores the counter's value, so that counting continues from here after a change of the clock."""
        if self.control & ENABLE:
            self.value = self.current()
        self.start = self.board.now
        #: The duration of one clock, in picoseconds. Valid until the next call.
        self.period_ps = round(1e12 / self.board.rcc.core_hz)

    def current(self) -> int:
        """Returns the counter's value now."""
        if not self.control & ENABLE:
            return self.value
        clocks = (self.board.now - self.start) // self.period_ps
        if clocks <= self.value:
            return self.value - clocks
        if not self.reload:
            return 0
        return (self.reload - (clocks - self.value - 1)) % (self.reload + 1)

    def plan(self) -> None:
        """Schedules the next step to 0."""
        self._cancel()
        if self.control & ENABLE and (self.value or self.reload):
            clocks = self.value or self.reload + 1
            due = self.start + clocks * self.period_ps
            self.event = self.board.schedule(due - self.board.now, self._reached_zero)

    def _reached_zero(self) -> None:
        self.start += (self.value or self.reload + 1) * self.period_ps
        self.value = 0
        if self.control & TICKINT:
            self.board.nvic.pend(SYSTICK)
        self.plan()

    def read(self, offset: int, size: int) -> int:
        """Reads RVR or CVR, or CSR without COUNTFLAG."""
        if size != 4 or offset > 8:
            raise Violation(f"SysTick: {size}-byte read at offset {offset}")
        return (self.control, self.reload, self.current())[offset // 4]

    def write(self, offset: int, value: int, size: int) -> None:
        """Writes CSR, RVR, or CVR, where any value clears the counter."""
        if size != 4:
            raise Violation(f"SysTick: {size}-byte write")
        self.hold()
        if offset == 0:
            if value & ENABLE and not value & CLKSOURCE:
                raise Violation("SysTick: the external clock is not modelled")
            self.control = value & 7
            self.hold()
        elif offset == 4:
            self.reload = value & 0xFF_FFFF
        elif offset == 8:
            self.value = 0
        self.plan()

"""The cycle counter and the debug registers that software may read (DDI0403 C1.6 and C1.8).

CYCCNT counts core clocks while DEMCR.TRCENA and DWT_CTRL.CYCCNTENA are set, and stops while the core sleeps (FCLK runs on, but
the STM32F405 gates HCLK in sleep; RM0090 section 5.3.2 does not mention the counter). No debugger is attached.
"""

from .violation import Violation

TRCENA = 1 << 24
CYCCNTENA = 1
#: Four comparators, no trace packets lost: NUMCOMP = 4, the rest as implemented on a Cortex-M4.
CONTROL_FIXED = 0x4000_0000


class Dwt:
    """DWT_CTRL and DWT_CYCCNT."""

    base, size = 0xE0001000, 0x1000

    def __init__(self, board):
        self.board = board
        self.reset()

    def reset(self) -> None:
        """Stops the counter."""
        self.control = 0
        self.trace = False
        self.count = 0
        self.start = 0
        self.hz = 1

    def _running(self) -> bool:
        return self.trace and bool(self.control & CYCCNTENA)

    def hold(self) -> None:
        """Stores the count, so that counting continues from here after a change of the clock or a sleep."""
        self.count = self.current()
        self.start = self.board.now
        self.hz = self.board.rcc.core_hz

    def skip(self, duration: int) -> None:
        """Excludes a period of sleep from the count."""
        self.start += duration

    def current(self) -> int:
        """Returns the count now."""
        if not self._running():
            return self.count
        clocks = (self.board.now - self.start) * self.hz // 10**12
        return self.count + clocks & 0xFFFF_FFFF

    def read(self, offset: int, size: int) -> int:
        """Reads CTRL or CYCCNT."""
        if size == 4 and offset == 0:
            return CONTROL_FIXED | self.control
        if size == 4 and offset == 4:
            return self.current()
        raise Violation(f"DWT: {size}-byte read at offset 0x{offset:X} is not modelled")

    def write(self, offset: int, value: int, size: int) -> None:
        """Writes CTRL, only CYCCNTENA."""
        self.hold()
        if size == 4 and offset == 0 and not value & 0x0FFF_FFFE:
            self.control = value & CYCCNTENA
        else:
            raise Violation(f"DWT: write of 0x{value:X} at offset 0x{offset:X} is not modelled")


class CoreDebug:
    """DHCSR, DCRSR, DCRDR and DEMCR as software sees them without a debugger."""

    base, size = 0xE000EDF0, 0x10
    #: S_RETIRE_ST and S_REGRDY; C_DEBUGEN is 0.
    DHCSR = 0x0101_0000

    def __init__(self, board):
        self.board = board
        self.demcr = 0

    def power_on(self) -> None:
        """Clears DEMCR, which only a power-on reset clears."""
        self.demcr = 0

    def read(self, offset: int, size: int) -> int:
        """Reads DHCSR or DEMCR."""
        if size == 4 and offset in (0, 0xC):
            return self.demcr if offset else self.DHCSR
        raise Violation(f"CoreDebug: {size}-byte read at offset 0x{offset:X} is not modelled")

    def write(self, offset: int, value: int, size: int) -> None:
        """Writes DEMCR.TRCENA."""
        if size != 4 or offset != 0xC or value & ~TRCENA:
            raise Violation(f"CoreDebug: write of 0x{value:X} at offset 0x{offset:X} is not modelled")
        self.board.dwt.hold()
        self.demcr = value
        self.board.dwt.trace = bool(value & TRCENA)

"""The interrupt controller (DDI0403 B3.4) and the priorities of all exceptions (B1.5.4).

Exceptions are numbered as in IPSR: 2 NMI, 3 HardFault, 11 SVCall, 14 PendSV, 15 SysTick, and from 16 on the external
interrupts. Sets of exceptions are integers with one bit each. The chips have 4 priority bits (RM0090 section 12.1).
"""

from .violation import Violation

PRIORITY_MASK = 0xF0
NMI, HARD_FAULT, SVCALL, PENDSV, SYSTICK = 2, 3, 11, 14, 15
#: The execution priority of Thread mode with nothing masked.
LOWEST = 256


def bits(mask: int):
    """Yields the positions of the bits that are set."""
    while mask:
        lowest = mask & -mask
        yield lowest.bit_length() - 1
        mask ^= lowest


class Nvic:
    """Holds which exceptions are enabled, pending and active, and their priorities."""

    base, size = 0xE000E100, 0xC00

    def __init__(self, board):
        self.board = board
        self.count = 16 + board.chip.interrupts
        self.reset()

    def reset(self) -> None:
        """Disables, ends and clears all exceptions. Interrupt lines keep their level, since the peripherals drive them."""
        self.enabled = 1 << NMI | 1 << HARD_FAULT | 1 << SVCALL | 1 << PENDSV | 1 << SYSTICK
        self.pending = 0
        self.active = 0
        self.lines = getattr(self, "lines", 0)
        self.priority = [LOWEST] * 2 + [-2, -1] + [0] * (self.count - 4)
        self.priorities_changed()

    def priorities_changed(self) -> None:
        """Clears the cached levels, which depend on the priorities."""
        #: The execution priority without masks, by the set of active exceptions.
        self._levels: dict[int, int] = {0: LOWEST}

    def set_line(self, number: int, level: bool) -> None:
        """Drives an interrupt line. A rising edge makes the interrupt pending; if it is active, it runs once more after its end."""
        bit = 1 << 16 + number
        if not 16 <= 16 + number < self.count:
            raise ValueError(f"interrupt {number}")
        if not level:
            self.lines &= ~bit
        elif not self.lines & bit:
            self.lines |= bit
            self.pend(16 + number)

    def pend(self, number: int) -> None:
        """Makes an exception pending."""
        self.pending |= 1 << number
        if self.enabled >> number & 1 and self.board.in_slice:
            self.board.interrupt_raised()

    def highest_pending(self) -> tuple[int, int] | None:
        """Returns number and priority of the pending, enabled exception that is taken first."""
        ready = self.pending & self.enabled
        if not ready:
            return None
        if not ready & ready - 1:
            number = ready.bit_length() - 1
            return number, self.priority[number]
        return min(((self.priority[n], n) for n in bits(ready)))[::-1]

    def preempting(self) -> int | None:
        """Returns the pending exception that preempts the active ones, ignoring the masks."""
        ready = self.pending & self.enabled
        if not ready:
            return None
        number = self.highest_pending()[0] if ready & ready - 1 else ready.bit_length() - 1
        level = self._levels.get(self.active)
        return number if self.priority[number] < (self.level() if level is None else level) else None

    def level(self) -> int:
        """Returns the execution priority that results from the active exceptions."""
        level = self._levels.get(self.active)
        if level is None:
            level = self._levels[self.active] = min(self.priority[n] for n in bits(self.active))
        return level

    def execution_priority(self, primask: int, basepri: int, faultmask: int) -> int:
        """Returns the priority below which an exception must be to be taken."""
        lowest = self.level()
        if basepri & PRIORITY_MASK:
            lowest = min(lowest, basepri & PRIORITY_MASK)
        if primask & 1:
            lowest = min(lowest, 0)
        if faultmask & 1:
            lowest = min(lowest, -1)
        return lowest

    def read(self, offset: int, size: int) -> int:
        """Reads ISER, ICER, ISPR, ICPR, IABR and IPR."""
        block, word = offset >> 7, offset >> 2 & 0x1F
        if block in (0, 1, 2, 3, 4) and size == 4 and word < 16:
            source = (self.enabled, self.enabled, self.pending, self.pending, self.active)[block]
            return source >> 16 + 32 * word & 0xFFFF_FFFF
        if 0x300 <= offset < 0x3F0:
            first = 16 + offset - 0x300
            values = (self.priority[n] if n < self.count else 0 for n in range(first, first + size))
            return int.from_bytes(bytes(values), "little")
        raise Violation(f"NVIC: {size}-byte read at offset 0x{offset:X} is not modelled")

    def write(self, offset: int, value: int, size: int) -> None:
        """Writes the registers that `read` supports, and STIR."""
        block, word = offset >> 7, offset >> 2 & 0x1F
        if block in (0, 1, 2, 3) and size == 4 and word < 16:
            chosen = (value << 16 + 32 * word) & ((1 << self.count) - 1)
            if block == 0:
                self.enabled |= chosen
            elif block == 1:
                self.enabled &= ~chosen
            elif block == 2:
                self.pending |= chosen
            else:
                # A line that is high keeps an inactive interrupt pending.
                self.pending &= ~chosen | self.lines & ~self.active
        elif 0x300 <= offset < 0x3F0:
            for n in range(size):
                if 16 + offset - 0x300 + n < self.count:
                    self.priority[16 + offset - 0x300 + n] = value >> 8 * n & PRIORITY_MASK
            self.priorities_changed()
        elif offset == 0xE00 and size == 4:
            if 16 + (value & 0x1FF) < self.count:
                self.pending |= 1 << 16 + (value & 0x1FF)
        else:
            raise Violation(f"NVIC: {size}-byte write at offset 0x{offset:X} is not modelled")
        self.board.interrupt_raised()

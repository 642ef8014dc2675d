"""Window watchdog (RM0090 section 22), counted by PCLK1 / 4096."""

from ..peripheral import Peripheral
from . import registers

PS = 1_000_000_000_000
WDGA, EWI = 1 << 7, 1 << 9


class Wwdg(Peripheral):
    """CR, CFR and SR of section 22.6."""

    name, base, clock, interrupt = "WWDG", 0x4000_2C00, "WWDG", 0

    def __init__(self, board):
        super().__init__(board)
        self.events = []
        self._registers()

    def _registers(self):
        self.active, self.counter, self.since = False, 0x7F, 0
        self.cfr, self.sr = 0x7F, 0

    def reset(self, cause):
        self._cancel()
        self._registers()
        self.board.irq(self.interrupt, False)

    def _cancel(self):
        for handle in self.events:
            handle.cancel()
        self.events = []

    def _tick_ps(self):
        return 4096 * (1 << (self.cfr >> 7 & 3)) * PS // self.board.rcc.clock_hz("PCLK1")

    def _value(self):
        steps = (self.board.now - self.since) // self._tick_ps() if self.active else 0
        return self.counter - steps & 0x7F

    def _arm(self):
        """Schedules the warning at counter value 0x40, and the reset at 0x3F."""
        self._cancel()
        if not self.active:
            return
        tick = self._tick_ps()
        warning = self.counter - 0x40
        if warning >= 0:
            self.events.append(self.board.schedule(warning * tick, self._warn))
        self.events.append(self.board.schedule(max(warning + 1, 0) * tick, self._expire))

    def _warn(self):
        self.sr = 1
        self.board.irq(self.interrupt, bool(self.cfr & EWI))

    def _expire(self):
        self._cancel()
        self.board.request_reset("wwdg")

    def clocks_changed(self):
        """Handles a change of the bus clock: the remaining steps are timed with the new clock."""
        if self.active and self.events:
            self._arm()

    def read(self, offset, size):
        registers.check(self, offset, size, registers.HALF_WORD)
        if offset == 0x00:
            return self._value() | (WDGA if self.active else 0)
        if offset == 0x04:
            return self.cfr
        if offset == 0x08:
            return self.sr
        raise registers.unmodelled(self, offset, "read")

    def write(self, offset, value, size):
        registers.check(self, offset, size, registers.HALF_WORD)
        if offset == 0x00:
            early = self.active and self._value() > self.cfr & 0x7F
            self.active = self.active or bool(value & WDGA)
            self.counter, self.since = value & 0x7F, self.board.now
            if early or self.active and not value & 0x40:
                self._expire()
            else:
                self._arm()
        elif offset == 0x04:
            counter = self._value()
            self.cfr = value & 0x3FF | self.cfr & EWI
            self.counter, self.since = counter, self.board.now
            self._arm()
        elif offset == 0x08:
            self.sr &= value
            self.board.irq(self.interrupt, bool(self.sr and self.cfr & EWI))
        else:
            raise registers.unmodelled(self, offset, "write")

"""Random number generator (RM0090 section 24): a number of 32 bits every 40 periods of the 48 MHz clock of the PLL.

Settings: `seed_error` (the noise is a constant: SECS), `stuck` (a number that is repeated forever, or
None), `clock_error` (its clock has failed: CECS). The noise continues through resets, as that of an analogue source does.
"""

from random import Random

from .registers import Registers

IE, RNGEN = 1 << 3, 1 << 2
SEIS, CEIS, SECS, CECS, DRDY = 1 << 6, 1 << 5, 1 << 2, 1 << 1, 1 << 0
PLLRDY = 1 << 25
PERIODS = 40
HASH_RNG = 80


class Rng(Registers):
    """CR, SR and DR of section 24.4. The manual does not say what DR holds while no number is ready; here, the last number read."""

    name, base, clock = "RNG", 0x5006_0800, "RNG"
    readers = {0x00: "cr"}
    interrupt, settings = HASH_RNG, {"seed_error", "clock_error", "stuck"}

    def __init__(self, board):
        super().__init__(board)
        self.random = Random(24)
        self.seed_error, self.stuck, self.clock_error = False, None, False
        self.cr, self.flags, self.data, self.ready, self.pending = 0, 0, 0, False, None

    def reset(self, cause):
        super().reset(cause)
        self.cr, self.flags, self.data, self.ready = 0, 0, 0, False
        self._stop()

    def _stop(self):
        if self.pending:
            self.pending.cancel()
        self.pending = None

    def _clock_hz(self):
        """Returns PLL48CLK: the PLL's VCO divided by Q (section 7.3.2); 0 while the PLL is not ready."""
        rcc = self.board.rcc
        if not rcc.cr & PLLRDY:
            return 0
        return rcc.pll_hz("q")

    def _clock_error(self):
        return self.clock_error or self._clock_hz() < self.board.rcc.clock_hz("HCLK") / 16

    def _start(self):
        if self.cr & RNGEN and not self.pending and not self._errors():
            self.pending = self.board.schedule(PERIODS * 10**12 // self._clock_hz(), self._generated)

    def _errors(self):
        """Returns the current errors, and sets their flags (section 24.3.2)."""
        if not self.cr & RNGEN:
            return 0
        current = (SECS if self.seed_error else 0) | (CECS if self._clock_error() else 0)
        self.flags |= (SEIS if current & SECS else 0) | (CEIS if current & CECS else 0)
        return current

    def _generated(self):
        self.pending = None
        if not self._errors():
            self.data = self.random.getrandbits(32) if self.stuck is None else self.stuck
            self.ready = True
        self._interrupt()

    def _interrupt(self):
        self.board.irq(self.interrupt, bool(self.cr & IE and (self.ready or self.flags)))

    def load(self, offset):
        if offset == 0x04:
            return self._errors() | self.flags | (DRDY if self.ready else 0)
        if offset == 0x08:
            self.ready = False
            self._start()
            self._interrupt()
            return self.data
        return super().load(offset)

    def store(self, offset, value):
        if offset == 0x00:
            self.cr = value & (IE | RNGEN)
            if not self.cr & RNGEN:
                self._stop()
                self.ready = False
        elif offset == 0x04:
            # Cleared by writing 0; the other bits are read-only.
            self.flags &= value
        else:
            super().store(offset, value)
        self._start()
        self._interrupt()

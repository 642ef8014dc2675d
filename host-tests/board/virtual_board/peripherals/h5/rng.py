"""Random number generator of the STM32H563: four words at a time, conditioned, with a configuration that CONDRST opens.

Witnesses: the SVD for reset values and what each bit does, the HAL (stm32h5xx_hal_rng.c) for the order of a start: HTCR and NSCR
are written while CONDRST is set, and only then here. Assumed: the time of four words, and that CECS means a clock below HCLK / 32 as
on ST's other generators of this kind. Settings as on the STM32F405.
"""

from ..rng import IE, RNGEN
from ..rng import Rng as Shared

CR, DR, NSCR, HTCR = 0x00, 0x08, 0x0C, 0x10
CED, CONDRST, CONFIGLOCK = 1 << 5, 1 << 30, 1 << 31
#: CED, ARDIS, RNG_CONFIG3, NISTC, RNG_CONFIG2, CLKDIV and RNG_CONFIG1, which an access writes that sets CONDRST.
CONFIGURATION = 0x03FF_FFA0
CLKDIV = 0xF << 16
WORDS, WORDS_PERIODS = 4, 412


class Rng(Shared):
    """CR, SR, DR, NSCR and HTCR."""

    base, interrupt = 0x420C_0800, 114
    kept = {NSCR: (0x0003_FFFF, 0xFFFF_FFFF), HTCR: (0x0000_72AC, 0xFFFF_FFFF)}

    def reset(self, cause):
        super().reset(cause)
        self.cr, self.left = 0x0087_1F00, 0

    def _clock_hz(self):
        return self.board.rcc.clock_hz("RNG") >> (self.cr >> 16 & 15)

    def _clock_error(self):
        if self.cr & CED:
            return False
        return self.clock_error or self._clock_hz() < self.board.rcc.clock_hz("HCLK") / 32

    def _start(self):
        if self.cr & RNGEN and not self.cr & CONDRST and not self.pending and not self.left and not self._errors() and self._clock_hz():
            self.pending = self.board.schedule(WORDS_PERIODS * 10**12 // self._clock_hz(), self._generated)

    def _generated(self):
        super()._generated()
        self.left = WORDS if self.ready else 0

    def _conditioned(self):
        self.cr &= ~CONDRST
        self._start()

    def load(self, offset):
        if offset != DR:
            return super().load(offset)
        if not self.left:
            return 0
        self.left -= 1
        value = self.data
        self.data = self.random.getrandbits(32) if self.stuck is None else self.stuck
        self.ready = bool(self.left)
        self._start()
        self._interrupt()
        return value

    def store(self, offset, value):
        if offset in self.kept and (not self.cr & CONDRST or self.cr & CONFIGLOCK):
            self.board.record("ignored_write", register=f"RNG {offset:#x}", value=value)
        elif offset == CR:
            self._write_cr(value)
        else:
            super().store(offset, value)

    def _write_cr(self, value):
        configured = value & CONDRST and not self.cr & CONFIGLOCK
        if (value ^ self.cr) & CONFIGURATION and not configured or (value ^ self.cr) & CLKDIV and self.cr & RNGEN:
            self.board.record("ignored_write", register="RNG_CR", value=value)
            configured = False
        ends = self.cr & CONDRST and not value & CONDRST
        configuration = value if configured else self.cr
        self.cr = value & (IE | RNGEN) | configuration & CONFIGURATION | (self.cr | value) & (CONDRST | CONFIGLOCK)
        if self.cr & CONDRST:
            self.flags = 0
        if not self.cr & RNGEN or self.cr & CONDRST:
            self._stop()
            self.ready, self.left = False, 0
        if ends and self._clock_hz():
            periods = 1 / self.board.rcc.clock_hz("HCLK") + 1 / self._clock_hz()
            self.board.schedule(round(2 * periods * 10**12), self._conditioned)
        self._start()
        self._interrupt()

"""Power control (RM0090 section 5) with the supply that the test sets: voltage detector, brown-out and power-on reset.

Thresholds are those of DS8626 table 19 (embedded reset and power control block); typical ones count.
Left out: Stop and Standby, scale 2, the backup domain and its regulator, and the time that the voltage detector needs to start.

Settings: `supply_mv`.
"""

from .registers import HALF_WORD, Registers, unmodelled

#: Falling and rising thresholds in millivolts by PLS.
PVD = ((2040, 2140), (2190, 2300), (2350, 2450), (2510, 2600), (2660, 2760), (2840, 2930), (2930, 3030), (3030, 3140))
#: The same for BOR_LEV; 3 is off, 0 is level 3 (section 3.9.10).
BOR = {2: (2190, 2290), 1: (2500, 2590), 0: (2830, 2920)}
POWER_ON = (1680, 1720)
#: TRSTTEMPO, the time from a sufficient supply to the start.
RESET_TIME_PS = 1_500_000_000
UNTIL_THE_SUPPLY_RETURNS = 10**21

PVDE, PLS, VOS = 1 << 4, 7 << 5, 1 << 14
PVDO, VOSRDY = 1 << 2, 1 << 14


class Pwr(Registers):
    """The registers of section 5.4 (STM32F405) and the supply monitors of section 5.2."""

    name, base, clock = "PWR", 0x4000_7000, "PWR"
    sizes, readers = HALF_WORD, {0x00: "cr"}

    def __init__(self, board):
        super().__init__(board)
        self.supply_mv = 3300
        self.held = None
        self.release = None
        self.cr, self.low = VOS, False

    def reset(self, cause):
        self.cr = VOS
        self._detect()
        if self.held:
            self.board.stall(self.board.now + UNTIL_THE_SUPPLY_RETURNS)

    def power_off(self):
        """Cancels the hold; the board handles the next start."""
        self.held = self.release = None

    def load(self, offset):
        if offset == 4:
            return VOSRDY | (PVDO if self.low else 0)
        return super().load(offset)

    def store(self, offset, value):
        if offset or value & ~(PVDE | PLS) != VOS:
            raise unmodelled(self, offset, f"write of {value:#x}")
        self.cr = value
        self._detect()

    def _detect(self):
        """Updates PVDO by comparing the supply with the selected level, with hysteresis, and drives EXTI line 16 (section 5.2.3)."""
        falling, rising = PVD[self.cr >> 5 & 7]
        if not self.cr & PVDE:
            low = False
        elif self.supply_mv < falling:
            low = True
        else:
            low = self.low and self.supply_mv < rising
        if low != self.low:
            self.low = low
            self.board.record("pvd", low=low, supply_mv=self.supply_mv)
            self.board.peripherals["EXTI"].line(low)

    def _brown_out(self):
        return BOR.get(self.board.peripherals["FLASH"].bor_level)

    def _monitor(self):
        """Holds the part in reset while the supply is too low, and lets it start when the supply has returned."""
        brown_out = self._brown_out()
        supply = self.supply_mv
        cause = None
        if supply < POWER_ON[0]:
            cause = "por"
        elif brown_out and supply < brown_out[0]:
            cause = "bor"
        if cause and self.held != "por" and cause != self.held:
            self.held = cause
            self.board.record("supply_reset", cause=cause, supply_mv=supply)
            self.board.request_reset(cause)
            self.board.stall(self.board.now + UNTIL_THE_SUPPLY_RETURNS)
        if not self.held:
            return
        enough = supply >= POWER_ON[1] and (not brown_out or supply >= brown_out[1])
        if enough and not self.release:
            self.release = self.board.schedule(RESET_TIME_PS if self.held == "por" else 0, self._start)
        elif not enough and self.release:
            self.release.cancel()
            self.release = None

    def _start(self):
        cause, self.held, self.release = self.held, None, None
        self.board.request_reset(cause)

    def configure(self, key, value):
        if key == "supply_mv":
            self.supply_mv = int(value)
            self._detect()
            self._monitor()
        else:
            super().configure(key, value)

"""Reset and clock control (RM0090 section 7): oscillators, PLL, prescalers, clock gates and reset flags.

Every frequency of the board follows from these registers and from the environment: the crystal, if one is fitted, the error
of the HSI oscillator and the frequency of the LSI. Times are those of DS8626 (tables 33 to 43).

Left out: the I2S PLL, spread spectrum, HSI trimming, the clock outputs MCO1 and MCO2, gates in Sleep mode, interrupts of oscillators,
the backup domain and its LSE crystal, switching the HSI off, accesses to parts of registers.
Assumed where the manual is silent: without CSS a core that runs from a dead crystal stops until a reset; a system clock changes 0.2 us after its source is ready.

Settings: `hsi_error_percent`, `crystal_hz` (None: no crystal), `crystal_stop` (True stops the crystal; False lets it start again,
though a core that it stopped stays stopped until a reset), `lsi_hz`.
"""

from ..violation import Violation
from .clock_names import ENABLE, RESET, RESET_VALUES
from .registers import Registers

PS = 1_000_000_000_000
HSI_NOMINAL = 16_000_000

HSION, HSIRDY, HSEON, HSERDY, CSSON = 1 << 0, 1 << 1, 1 << 16, 1 << 17, 1 << 19
PLLON, PLLRDY = 1 << 24, 1 << 25
HSE_START_PS, PLL_LOCK_PS = 2_000_000_000, 300_000_000
PLLSRC_HSE = 1 << 22
CSSF, CSSC = 1 << 7, 1 << 23
LSION, LSIRDY, RMVF = 1 << 0, 1 << 1, 1 << 24
#: Flags of RCC_CSR (section 7.3.21) for each cause; NRST is pulled low by every internal reset (section 7.1.1).
RESET_FLAGS = {"por": 0x0E00_0000, "bor": 0x0600_0000, "pin": 0x0400_0000, "software": 0x1400_0000,
               "iwdg": 0x2400_0000, "wwdg": 0x4400_0000, "lowpower": 0x8400_0000}
CFGR_WRITABLE = 0xFFFF_FCF3
AHB_SHIFT = {8: 1, 9: 2, 10: 3, 11: 4, 12: 6, 13: 7, 14: 8, 15: 9}
APB_SHIFT = {4: 1, 5: 2, 6: 3, 7: 4}
BUS_OF_ENABLE = {0x30: "HCLK", 0x34: "HCLK", 0x38: "HCLK", 0x40: "PCLK1", 0x44: "PCLK2"}
OSCILLATOR_SWITCH_PS = 200_000


class Rcc(Registers):
    """The clock tree of section 7.2 with its gates and flags."""

    name, base = "RCC", 0x4002_3800
    kept = {offset: (value, 0xFFFF_FFFF) for offset, value in RESET_VALUES.items()}
    readers = {0x00: "cr", 0x04: "pllcfgr", 0x08: "clock_configuration", 0x0C: "cir", 0x74: "control_status"}
    writers = {0x00: "_write_cr", 0x04: "_write_pllcfgr", 0x08: "_write_cfgr", 0x0C: "_write_cir", 0x74: "_write_csr"}

    def __init__(self, board):
        super().__init__(board)
        self.hsi_error_percent = 0.0
        self.crystal_hz = 25_000_000
        self.crystal_stopped = False
        self.lsi_hz = 32_000
        self.pending = {}
        self.flags = 0
        self._power_on()

    # -- for other parts of the board --------------------------------------------------------------------------------

    def enabled(self, name):
        """Returns the gate's state for an access now. An access within two bus cycles of the enabling write is recorded (ES0182)."""
        if self.settle_until:
            now = self.board.now
            until = self.settling.get(name, 0)
            if now < until:
                self.board.record("early_access", peripheral=name, ps_left=until - now)
            elif now >= self.settle_until:
                self.settle_until = 0
                self.open = self.gates | {None}
        return name in self.gates

    def is_on(self, name):
        """Returns the gate's state, without counting as an access."""
        return name in self.gates

    def clock_hz(self, name):
        """Returns a bus or timer clock in hertz: HCLK, PCLK1, PCLK2, TIM_APB1 or TIM_APB2."""
        return self.hz[name]

    @property
    def nmi_line(self):
        """Returns the NMI line, which the clock security system holds high as long as CSSF is set (section 7.2.7)."""
        return bool(self.cir & CSSF)

    @property
    def hse_hz(self):
        """Returns the HSE frequency while the oscillator runs, otherwise 0."""
        swings = self.crystal_hz and not self.crystal_stopped and self.cr & HSERDY
        return self.crystal_hz if swings else 0

    def hse_rtc_hz(self):
        """Returns HSE divided by RTCPRE in hertz as (numerator, denominator); (0, 1) if there is no output (section 7.3.3)."""
        divider = (self.cfgr >> 16) & 0x1F
        return (self.hse_hz, divider) if divider >= 2 else (0, 1)

    @property
    def lsi_ready(self):
        """Returns whether the LSI's clock can be used."""
        return bool(self.csr & LSIRDY)

    @property
    def lsi_runs(self):
        """Returns whether the LSI runs: LSION requests it, or the independent watchdog has been started (section 7.2.5)."""
        return bool(self.csr & LSION) or self.lsi_forced

    # -- resets ------------------------------------------------------------------------------------------------------

    def _power_on(self):
        self.cr, self.pllcfgr, self.cfgr, self.cir, self.csr = 0x83, 0x2400_3010, 0, 0, 0
        self.gates = set()
        self.settling, self.settle_until = {}, 0
        self.lsi_forced = False
        self.source = "HSI"
        self._open_gates()
        self._compute()

    def reset(self, cause):
        for handle in self.pending.values():
            handle.cancel()
        self.pending = {}
        before = dict(self.hz)
        if cause == "por":
            self.flags = 0
        self.flags |= RESET_FLAGS.get(cause, 0)
        super().reset(cause)
        self._power_on()
        if before != self.hz:
            self.announce_clocks()

    def _open_gates(self):
        #: Gates that need no check at an access; `None` stands for a block that is always clocked.
        self.open = {None}
        self.settle_until = max(self.settle_until, 1)
        self.gates = {name for offset, names in ENABLE.items() for bit, name in names.items()
                      if self.values[offset] >> bit & 1}
        for offset, names in RESET.items():
            for bit, held in names.items():
                if self.values[offset] >> bit & 1:
                    self.gates.difference_update(held)

    # -- frequencies -------------------------------------------------------------------------------------------------

    def pll_hz(self, output="p"):
        """Returns an output of the PLL in hertz from its nominal input: P for the system, Q for PLL48CLK (section 7.3.2)."""
        source = self.crystal_hz if self.pllcfgr & PLLSRC_HSE else HSI_NOMINAL
        m, n = self.pllcfgr & 0x3F, (self.pllcfgr >> 6) & 0x1FF
        divider = 2 * ((self.pllcfgr >> 16 & 3) + 1) if output == "p" else self.pllcfgr >> 24 & 15
        return (source or 0) * n // (m * divider)

    def _compute(self):
        """Computes all clocks from the source and the prescalers, also the nominal frequencies, with which the limits are compared."""
        if self.source == "PLL":
            nominal, of_hsi = self.pll_hz(), not self.pllcfgr & PLLSRC_HSE
        elif self.source == "HSE":
            nominal, of_hsi = self.crystal_hz or 0, False
        else:
            nominal, of_hsi = HSI_NOMINAL, True
        hclk = nominal >> AHB_SHIFT.get(self.cfgr >> 4 & 15, 0)
        shift1, shift2 = APB_SHIFT.get(self.cfgr >> 10 & 7, 0), APB_SHIFT.get(self.cfgr >> 13 & 7, 0)
        tree = {"SYSCLK": nominal, "HCLK": hclk, "PCLK1": hclk >> shift1, "PCLK2": hclk >> shift2,
                "TIM_APB1": hclk >> max(shift1 - 1, 0), "TIM_APB2": hclk >> max(shift2 - 1, 0)}
        self.nominal = tree
        ratio = 1 + self.hsi_error_percent / 100 if of_hsi else 1
        self.hz = tree if ratio == 1 else {name: round(hz * ratio) for name, hz in tree.items()}
        self.core_hz = self.hz["HCLK"]

    def check_limits(self):
        """Checks the clocks against DS8626 table 14 and the flash latency against RM0090 table 10 (2.7 to 3.6 V)."""
        flash = self.board.peripherals.get("FLASH")
        for name, most in (("HCLK", 168_000_000), ("PCLK1", 42_000_000), ("PCLK2", 84_000_000)):
            if self.nominal[name] > most:
                raise Violation(f"RCC: {name} at {self.nominal[name]} Hz is above {most} Hz")
        if flash is not None and self.nominal["HCLK"] > 30_000_000 * (flash.latency + 1):
            raise Violation(f"RCC: HCLK at {self.nominal['HCLK']} Hz with {flash.latency} flash wait states")

    def _update(self):
        """Computes the tree again after a change of source or prescaler, and calls everything that counts."""
        before = self.hz
        self._compute()
        self.check_limits()
        if before != self.hz:
            self.announce_clocks()

    # -- oscillators -------------------------------------------------------------------------------------------------

    def _later(self, key, delay_ps, callback):
        self._drop(key)
        self.pending[key] = self.board.schedule(delay_ps, callback)

    def _drop(self, key):
        handle = self.pending.pop(key, None)
        if handle:
            handle.cancel()

    def _start_hse(self):
        if self.cr & HSEON and self.crystal_hz and not self.crystal_stopped and not self.cr & HSERDY:
            self._later("hse", HSE_START_PS, self._hse_ready)

    def _hse_ready(self):
        self.pending.pop("hse", None)
        self.cr |= HSERDY
        self._start_pll()
        self._try_switch()

    def _start_pll(self):
        source_ready = self.cr & (HSERDY if self.pllcfgr & PLLSRC_HSE else HSIRDY)
        if not self.cr & PLLON or self.cr & PLLRDY or not source_ready:
            return
        source = self.crystal_hz if self.pllcfgr & PLLSRC_HSE else HSI_NOMINAL
        m, n, q = self.pllcfgr & 0x3F, self.pllcfgr >> 6 & 0x1FF, self.pllcfgr >> 24 & 15
        if m < 2 or not 50 <= n <= 432 or q < 2:
            raise Violation(f"RCC: PLLM {m}, PLLN {n} or PLLQ {q} is a wrong configuration (section 7.3.2)")
        if not 950_000 <= source / m <= 2_100_000:
            raise Violation(f"RCC: PLL input of {source / m:.0f} Hz is outside 0.95 to 2.1 MHz")
        if not 100_000_000 <= source * n / m <= 432_000_000:
            raise Violation(f"RCC: PLL oscillator at {source * n / m:.0f} Hz is outside 100 to 432 MHz")
        self._later("pll", PLL_LOCK_PS, self._pll_ready)

    def _pll_ready(self):
        self.pending.pop("pll", None)
        self.cr |= PLLRDY
        self._try_switch()

    def _uses(self, oscillator):
        """Returns whether the oscillator is the system clock, directly or through the PLL."""
        through = "HSE" if self.pllcfgr & PLLSRC_HSE else "HSI"
        return self.source == oscillator or (self.source == "PLL" and through == oscillator)

    def _try_switch(self):
        wanted = ("HSI", "HSE", "PLL")[self.cfgr & 3]
        ready = self.cr & {"HSI": HSIRDY, "HSE": HSERDY, "PLL": PLLRDY}[wanted]
        if wanted != self.source and ready and "switch" not in self.pending:
            self._later("switch", OSCILLATOR_SWITCH_PS, self._switch)

    def _switch(self):
        self.pending.pop("switch", None)
        wanted = ("HSI", "HSE", "PLL")[self.cfgr & 3]
        if self.cr & {"HSI": HSIRDY, "HSE": HSERDY, "PLL": PLLRDY}[wanted]:
            self.source = wanted
            self._update()

    def _crystal_lost(self):
        """Handles a stopped crystal: with CSS the part falls back to HSI (section 7.2.7), without it what HSE clocks stops."""
        self._drop("hse")
        was_ready = self.cr & HSERDY
        self.cr &= ~HSERDY
        if not was_ready:
            return
        if not self.cr & CSSON:
            if self._uses("HSE"):
                self.board.record("clock_dead", source=self.source)
                self.board.stall(self.board.now + 1_000_000 * PS)
            return
        used = self._uses("HSE")
        self.cr &= ~HSEON
        if used:
            if self.source == "PLL":
                self.cr &= ~(PLLON | PLLRDY)
            self.cfgr &= ~3
            self._drop("switch")
            self.source = "HSI"
            self._update()
        self.cir |= CSSF
        self.board.nmi()

    # -- registers ---------------------------------------------------------------------------------------------------

    @property
    def clock_configuration(self):
        """Returns CFGR with SWS, the clock in use."""
        return self.cfgr & ~0xC | {"HSI": 0, "HSE": 4, "PLL": 8}[self.source]

    @property
    def control_status(self):
        """Returns CSR with the reset flags."""
        return self.csr | self.flags

    def store(self, offset, value):
        if offset in self.kept:
            self._write_gate(offset, value)
        else:
            super().store(offset, value)

    def _write_cr(self, value):
        if value & ~0x030B_00FB or value & 0xF9 != 0x81:
            raise Violation(f"RCC: CR {value:#x}: trimming, no HSI, a clock instead of the crystal and the I2S PLL are not modelled")
        old = self.cr
        new = old & (HSIRDY | HSERDY | PLLRDY) | value & (0xF8 | HSION | HSEON | CSSON | PLLON)
        if self._uses("HSE"):
            new |= old & HSEON
        if self.source == "PLL":
            new |= old & PLLON
        if not new & HSEON:
            self._drop("hse")
            new &= ~HSERDY
        if not new & PLLON:
            self._drop("pll")
            new &= ~PLLRDY
        self.cr = new
        if new & HSEON and not old & HSEON:
            self._start_hse()
        if new & PLLON and not old & PLLON:
            self._start_pll()

    def _write_pllcfgr(self, value):
        if self.cr & PLLON:
            self.board.record("ignored_write", register="RCC_PLLCFGR", value=value)
            return
        self.pllcfgr = value & 0x0F43_7FFF | 0x2000_0000

    def _write_cfgr(self, value):
        if value & 3 == 3:
            raise Violation("RCC: SW = 11 is not allowed (section 7.3.3)")
        self.cfgr = value & CFGR_WRITABLE
        self._update()
        self._try_switch()

    def _write_cir(self, value):
        if value & ~CSSC:
            raise Violation("RCC: interrupts of the oscillators are not modelled")
        if value & CSSC:
            self.cir &= ~CSSF

    def _write_gate(self, word, value):
        if word in ENABLE:
            mask = sum(1 << bit for bit in ENABLE[word])
            risen = value & mask & ~self.values[word]
            self.values[word] = value & mask
            self._open_gates()
            if risen:
                until = self.board.now + 2 * PS // max(self.hz[BUS_OF_ENABLE[word]], 1)
                self.settling = {name: end for name, end in self.settling.items() if end > self.board.now}
                self.settling.update({name: until for bit, name in ENABLE[word].items() if risen >> bit & 1})
                self.settle_until = max(self.settle_until, until)
        else:
            risen = value & ~self.values[word]
            self.values[word] = value
            self._open_gates()
            for bit, names in RESET[word].items():
                if risen >> bit & 1:
                    for name in names:
                        if name in self.board.peripherals:
                            self.board.peripherals[name].reset("rcc")

    def _write_csr(self, value):
        if value & RMVF:
            self.flags = 0
        self.csr = self.csr & ~LSION | value & LSION
        self._lsi_changed()

    def force_lsi(self):
        """Keeps the LSI on, after the independent watchdog has been started (section 21.3)."""
        self.lsi_forced = True
        self._lsi_changed()

    def _lsi_changed(self):
        if not self.lsi_runs:
            self._drop("lsi")
            self.csr &= ~LSIRDY
        elif not self.csr & LSIRDY and "lsi" not in self.pending:
            self._later("lsi", 40_000_000, self._lsi_ready)

    def _lsi_ready(self):
        self.pending.pop("lsi", None)
        self.csr |= LSIRDY
        watchdog = self.board.peripherals.get("IWDG")
        if watchdog:
            watchdog.lsi_ready()

    # -- environment -------------------------------------------------------------------------------------------------

    def configure(self, key, value):
        if key == "hsi_error_percent":
            self.hsi_error_percent = float(value)
            self._update()
        elif key == "crystal_hz":
            self.crystal_hz = value
            if value is None:
                self._crystal_lost()
            else:
                self._start_hse()
        elif key == "crystal_stop":
            self.crystal_stopped = bool(value)
            if value:
                self._crystal_lost()
            else:
                self._start_hse()
        elif key == "lsi_hz":
            if not 17_000 <= value <= 47_000:
                raise ValueError(f"LSI of {value} Hz; DS8626 table 42 gives 17 to 47 kHz")
            self.lsi_hz = int(value)
            watchdog = self.board.peripherals.get("IWDG")
            if watchdog:
                watchdog.clocks_changed()
        else:
            super().configure(key, value)

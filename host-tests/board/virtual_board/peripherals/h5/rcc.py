"""Reset and clock control of the STM32H563: oscillators, PLL1, prescalers, kernel clocks, clock gates and reset flags.

The frequencies follow from the registers and from the environment. Limits: HCLK by voltage scale and flash latency by HCLK (ST's
LL driver, stm32h5xx_ll_utils.c). Code was the only witness: the header for places, the SVD for reset values (CR 0x23, by which HSI runs
undivided; RM0481 is said to give 0x2B, half as fast), the HAL for the PLL's ranges. Left out: PLL2, PLL3, CSI, LSE, the crystal's security system, MCO, and gates in Sleep
mode. Assumed: oscillators start as on the STM32F405, and the LSI needs no access to the backup domain.

Settings: `hse_hz` (None: the probe supplies no clock), `lsi_hz`.
"""

from ...violation import Violation
from ..rcc import AHB_SHIFT, APB_SHIFT
from ..rcc import RESET_FLAGS as F405_FLAGS
from ..registers import Registers

PS = 1_000_000_000_000
HSI_HZ = 64_000_000
HSION, HSIRDY, HSI48ON, HSI48RDY, HSEON, HSERDY, HSEBYP, HSEEXT, PLLON, PLLRDY = (
    1 << bit for bit in (0, 1, 12, 13, 16, 17, 18, 20, 24, 25))
#: The ready bits of oscillators that are left out; they must stay off.
ABSENT = 1 << 8 | 1 << 19 | 1 << 26 | 1 << 28
CR, CFGR1, CFGR2, PLL1CFGR, PLL1DIVR, PLL1FRACR, BDCR, RSR = 0x00, 0x1C, 0x20, 0x28, 0x34, 0x38, 0xF0, 0xF4
CCIPR1, CCIPR3, CCIPR5 = 0xD8, 0xE0, 0xE8
LSION, LSIRDY, RMVF = 1 << 26, 1 << 27, 1 << 23
#: A power-on and a brown-out have one flag.
RESET_FLAGS = {**F405_FLAGS, "por": 0x0C00_0000, "bor": 0x0C00_0000}
#: Gates by enable register; the reset registers are 0x28 bytes before them, those for Sleep mode 0x28 behind.
ENABLE = {0x88: {0: "GPDMA1", 1: "GPDMA2", 8: "FLITF", 28: "BKPRAM", 30: "DCACHE1", 31: "SRAM1"},
          0x8C: {**{bit: f"GPIO{letter}" for bit, letter in enumerate("ABCDEFGHI")}, 18: "RNG", 30: "SRAM2", 31: "SRAM3"},
          0x94: {}, 0x9C: {0: "TIM2", 17: "USART2", 18: "USART3"}, 0xA0: {9: "FDCAN"}, 0xA4: {12: "SPI1", 14: "USART1"},
          0xA8: {1: "SBS", 21: "RTCAPB"}}
DISTANCE = 0x28
RESET_VALUES = {0x88: 0xD000_0100, 0x8C: 0xC000_0000, 0xB0: 0xF13A_D103, 0xB4: 0xC01F_1DFF, 0xBC: 0x0011_1880,
                0xC4: 0xDFFE_C9FF, 0xC8: 0x4080_022B, 0xCC: 0x017F_7800, 0xD0: 0x0030_F9E2, PLL1DIVR: 0x0101_0280}
#: All other registers with words to keep: prescalers, PLL1, gates, kernel clocks.
KEPT = (CFGR1, CFGR2, PLL1CFGR, PLL1DIVR, PLL1FRACR, 0x2C, 0x30, *(gate + step for gate in ENABLE for step in (-DISTANCE, 0, DISTANCE)),
        *range(CCIPR1, CCIPR5 + 4, 4))
SOURCES = ("HSI", "CSI", "HSE", "PLL1")
#: HCLK in hertz at most, and for each flash wait state, by VOS.
MOST = ((100_000_000, 20_000_000), (150_000_000, 30_000_000), (200_000_000, 34_000_000), (250_000_000, 42_000_000))
#: Input range of PLL1RGE and range of the VCO by PLL1VCOSEL, hertz.
PLL_INPUT = ((1e6, 2e6), (2e6, 4e6), (4e6, 8e6), (8e6, 16e6))
PLL_VCO = ((192e6, 836e6), (150e6, 420e6))


class Rcc(Registers):
    """The clock tree with its gates and flags."""

    name, base = "RCC", 0x4402_0C00
    kept = {offset: (RESET_VALUES.get(offset, 0), 0xFFFF_FFFF) for offset in KEPT}
    readers, writers = {CR: "cr", BDCR: "bdcr", RSR: "flags"}, {CR: "_write_cr", BDCR: "_write_bdcr"}
    settings = {"hse_hz", "lsi_hz"}

    def __init__(self, board):
        super().__init__(board)
        self.hse_hz, self.lsi_hz = 8_000_000, 32_000
        self.flags = 0
        self._registers()

    def _registers(self):
        self.cr, self.bdcr = 0x23, 0
        self.source, self.lsi_forced = "HSI", False
        self._open_gates()
        self._compute()

    def reset(self, cause):
        self.flags = RESET_FLAGS.get(cause, 0) | (0 if cause == "por" else self.flags)
        super().reset(cause)
        self._registers()
        self.announce_clocks()

    # -- for other parts of the board --------------------------------------------------------------------------------

    def enabled(self, name):
        """Returns whether a gate is open."""
        return name in self.open

    def clock_hz(self, name):
        """Returns a bus, timer or kernel clock in hertz; 0 while it stands."""
        if name == "FDCAN":
            source = self.values[CCIPR5] >> 8 & 3
            if source > 1:
                raise Violation("RCC: FDCAN's clock from PLL2 is not modelled")
            return self.pll_hz(16) if source else self.hse_hz if self.cr & HSERDY else 0
        if name == "RNG":
            source = self.values[CCIPR5] >> 4 & 3
            if source > 1:
                raise Violation("RCC: the RNG's clock from the LSE or LSI is not modelled")
            return self.pll_hz(16) if source else 48_000_000 if self.cr & HSI48RDY else 0
        if name == "SPI1":
            if self.values[CCIPR3] & 7:
                raise Violation("RCC: of SPI1's clocks only PLL1's Q is modelled")
            return self.pll_hz(16)
        if name == "USART1" and self.values[CCIPR1] & 7:
            raise Violation("RCC: of USART1's clocks only PCLK2 is modelled")
        return self.hz["PCLK2" if name == "USART1" else name]

    @property
    def lsi_ready(self):
        """Returns whether the LSI runs."""
        return bool(self.bdcr & LSIRDY)

    def force_lsi(self):
        """Starts the LSI for the independent watchdog."""
        self.lsi_forced = True
        self._start_lsi()

    def _open_gates(self):
        self.open = {None, *(name for offset, names in ENABLE.items() for bit, name in names.items()
                             if self.values[offset] >> bit & 1 and not self.values[offset - DISTANCE] >> bit & 1)}

    # -- frequencies -------------------------------------------------------------------------------------------------

    def pll_hz(self, shift):
        """Returns an output of PLL1 in hertz: 9 for P, 16 for Q, 24 for R; 0 while it is off."""
        config, dividers = self.values[PLL1CFGR], self.values[PLL1DIVR]
        if not self.cr & PLLRDY or not config >> {9: 16, 16: 17, 24: 18}[shift] & 1:
            return 0
        return self._vco_hz() // ((dividers >> shift & 0x7F) + 1)

    def _input_hz(self):
        return {1: self._hsi_hz(), 3: self.hse_hz or 0}.get(self.values[PLL1CFGR] & 3, 0)

    def _vco_hz(self):
        return self._input_hz() * ((self.values[PLL1DIVR] & 0x1FF) + 1) // max(self.values[PLL1CFGR] >> 8 & 0x3F, 1)

    def _hsi_hz(self):
        return HSI_HZ >> (self.cr >> 3 & 3)

    def _compute(self):
        system = {"HSI": self._hsi_hz(), "HSE": self.hse_hz or 0, "PLL1": self.pll_hz(9)}[self.source]
        prescalers = self.values[CFGR2]
        hclk = system >> AHB_SHIFT.get(prescalers & 15, 0)
        shifts = [APB_SHIFT.get(prescalers >> 4 * bus & 7, 0) for bus in (1, 2, 3)]
        self.hz = {"HCLK": hclk, **{f"PCLK{bus + 1}": hclk >> shift for bus, shift in enumerate(shifts)},
                   "TIM_APB1": hclk >> max(shifts[0] - 1, 0), "TIM_APB2": hclk >> max(shifts[1] - 1, 0)}
        self.core_hz = hclk

    def check_limits(self):
        """Checks HCLK against the voltage scale, and the flash latency against both."""
        flash, power = self.board.peripherals["FLASH"], self.board.peripherals["PWR"]
        most, for_each = MOST[power.scale]
        hclk = self.hz["HCLK"]
        if hclk > most:
            raise Violation(f"RCC: HCLK at {hclk} Hz is above {most} Hz")
        if hclk > for_each * (flash.latency + 1):
            raise Violation(f"RCC: HCLK at {hclk} Hz with {flash.latency} flash wait states")

    def _update(self):
        before = dict(self.hz)
        self._compute()
        if before != self.hz:
            self.check_limits()
        self.announce_clocks()

    # -- oscillators -------------------------------------------------------------------------------------------------

    def _ready(self, on, bit):
        """Sets a ready bit, if its oscillator is still wanted."""
        if self.cr & on:
            self.cr |= bit
            if bit == HSERDY and self.cr & PLLON:
                self._start_pll()
            self._switch()
            self.announce_clocks()

    def _start_pll(self):
        config = self.values[PLL1CFGR]
        if not (self.cr & HSIRDY if config & 3 == 1 else self.cr & HSERDY if config & 3 == 3 else 0):
            return
        reference = self._input_hz() / max(config >> 8 & 0x3F, 1)
        low, high = PLL_INPUT[config >> 2 & 3]
        if not config >> 8 & 0x3F or not low <= reference <= high or self.values[PLL1FRACR] or config & 0x10:
            raise Violation(f"RCC: PLL1 with an input of {reference:.0f} Hz and PLL1CFGR {config:#x}")
        low, high = PLL_VCO[config >> 5 & 1]
        if not low <= self._vco_hz() <= high:
            raise Violation(f"RCC: PLL1's oscillator at {self._vco_hz()} Hz")
        self.board.schedule(100_000_000, lambda: self._ready(PLLON, PLLRDY))

    def _switch(self):
        wanted = SOURCES[self.values[CFGR1] & 3]
        ready = {"HSI": HSIRDY, "HSE": HSERDY, "PLL1": PLLRDY}.get(wanted)
        if ready is None:
            raise Violation("RCC: CSI is not modelled")
        if wanted != self.source and self.cr & ready:
            self.source = wanted
            self._update()

    def _uses(self, oscillator):
        through = {1: "HSI", 3: "HSE"}.get(self.values[PLL1CFGR] & 3)
        return oscillator == self.source or self.source == "PLL1" and oscillator == through

    def _write_cr(self, value):
        if value & ABSENT:
            raise Violation(f"RCC: CR {value:#x} starts an oscillator that is not modelled")
        old = self.cr
        held = (HSION if self._uses("HSI") else 0) | (HSEON if self._uses("HSE") else 0) | (PLLON if self.source == "PLL1" else 0)
        self.cr = (value & (HSION | 0x1C | HSI48ON | HSEON | HSEBYP | HSEEXT | PLLON) | old & (HSIRDY | HSI48RDY | HSERDY | PLLRDY)
                   | old & held | 0x20)
        for on, bit in ((HSION, HSIRDY), (HSI48ON, HSI48RDY), (HSEON, HSERDY), (PLLON, PLLRDY)):
            if not self.cr & on:
                self.cr &= ~bit
        risen = self.cr & ~old
        if risen & HSION:
            self.board.schedule(2_200_000, lambda: self._ready(HSION, HSIRDY))
        if risen & HSI48ON:
            self.board.schedule(2_200_000, lambda: self._ready(HSI48ON, HSI48RDY))
        if risen & HSEON and self.hse_hz:
            if not self.cr & HSEBYP:
                raise Violation("RCC: the board has no crystal at HSE, but the clock of its probe (HSEBYP)")
            self.board.schedule(1_000_000, lambda: self._ready(HSEON, HSERDY))
        if risen & PLLON:
            self._start_pll()
        self._update()

    def _start_lsi(self):
        if not self.bdcr & LSIRDY:
            self.board.schedule(130_000_000, self._lsi_started)

    def _lsi_started(self):
        if (self.bdcr & LSION or self.lsi_forced) and not self.bdcr & LSIRDY:
            self.bdcr |= LSIRDY
            self.board.peripherals["IWDG"].lsi_ready()

    def _write_bdcr(self, value):
        if value & ~(LSION | LSIRDY | 0x0001_8300):
            raise Violation(f"RCC: BDCR {value:#x}: LSE and LSCO are not modelled")
        if (value ^ self.bdcr) & 0x0001_8300:
            if not self.board.peripherals["PWR"].backup_writable:
                self.board.record("ignored_write", register="RCC_BDCR", value=value)
                return
            self.bdcr = self.bdcr & ~0x0001_8300 | value & 0x0001_8300
        self.bdcr = self.bdcr & ~LSION | value & LSION
        if value & LSION:
            self._start_lsi()
        elif not self.lsi_forced:
            self.bdcr &= ~LSIRDY

    # -- registers ---------------------------------------------------------------------------------------------------

    def load(self, offset):
        return super().load(offset) | (SOURCES.index(self.source) << 3 if offset == CFGR1 else 0)

    def store(self, offset, value):
        if offset == RSR:
            self.flags = 0 if value & RMVF else self.flags
        elif offset in (PLL1CFGR, PLL1DIVR) and self.cr & PLLON:
            self.board.record("ignored_write", register=f"RCC {offset:#x}", value=value)
        else:
            old = self.values.get(offset, 0)
            super().store(offset, value & ~0x38 if offset == CFGR1 else value)
            if offset == CFGR1:
                self._switch()
            elif offset in (CFGR2, CCIPR5):
                self._update()
            elif offset in ENABLE or offset + DISTANCE in ENABLE:
                self._open_gates()
                for bit, name in ENABLE.get(offset + DISTANCE, {}).items():
                    if (value & ~old) >> bit & 1 and name in self.board.peripherals:
                        self.board.peripherals[name].reset("rcc")

    def configure(self, key, value):
        super().configure(key, value)
        self.board.peripherals["IWDG"].clocks_changed()

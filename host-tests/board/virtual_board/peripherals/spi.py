"""SPI master with slaves behind chip-select pins (RM0090 section 28).

A frame takes its number of bits at the bus clock divided by BR. Data reach the slave only if SCK and MOSI have the alternate
function, and come back only if MISO has it. `slow_pin`: SCK or MOSI has OSPEEDR 00 above 2 MHz (section 8.4.3; ES0182, corrupted last bit).
Left out: slave mode, receive-only and one-wire modes, CRC, TI mode, I2S.
Assumed: a chip-select line has a pull-up on the board, so a pin that is not yet an output does not select; MISO without its alternate
function reads 0, and a line that no slave drives reads 1.

Settings: `fitted` (False: no slave answers, MISO floats high); `part` (the class of the part whose dies answer, the first at the start);
settings that begin with `imu_` are passed to that part.
"""

from ..peripheral import Peripheral
from ..violation import Violation
from . import registers
from .gpio import connected

PS = 1_000_000_000_000
CPHA, CPOL, MSTR, SPE, LSBFIRST, SSI, SSM, RXONLY, DFF, CRCEN, BIDIMODE = (
    1 << bit for bit in (0, 1, 2, 6, 7, 8, 9, 10, 11, 13, 15))
RXDMAEN, TXDMAEN, SSOE, FRF, ERRIE, RXNEIE, TXEIE = (1 << bit for bit in (0, 1, 2, 4, 5, 6, 7))
RXNE, TXE, MODF, OVR, BSY = (1 << bit for bit in (0, 1, 5, 6, 7))
SLOW_PIN_HZ = 2_000_000


class Spi(Peripheral):
    """One SPI; pins are (port letter, number) of NSS, SCK, MISO and MOSI, each with its candidates."""

    def __init__(self, board, name, base, interrupt, bus, function, pins):
        super().__init__(board)
        self.name = self.clock = name
        self.base, self.interrupt, self.bus, self.function = base, interrupt, bus, function
        self.dma = "DMA2" if bus == "PCLK2" else "DMA1"
        self.nss, self.sck, self.miso, self.mosi = pins
        #: Parts that may be fitted, and of each slave its number in them.
        self.parts, self.part, self.owners = [], 0, []
        self.slaves, self.selected = [], []
        self.fitted = True
        self.departure = None
        self._registers()

    def _registers(self):
        self.cr1 = self.cr2 = 0
        self.sr = TXE
        self.rdr, self.tdr, self.shift = 0, None, None
        self.overrun_read = self.fault_read = False
        self.slow_noted = False
        self.irq_level = False

    def reset(self, cause):
        if self.departure:
            self.departure.cancel()
            self.departure = None
        self._registers()
        self.board.irq(self.interrupt, False)
        if cause == "por":
            for slave in self.slaves:
                slave.power_on()

    def power_off(self):
        """Drops the scheduled events, which are lost with the power."""
        self.departure = None
        self.selected = []
        for slave in self.slaves:
            slave.power_off()

    def attach(self, part, slaves):
        """Adds a part: slaves, each with its chip select, active low and pulled up, at a pin of a port."""
        self.parts.append(part)
        for slave, port, pin in slaves:
            port.configure("drive", (pin, True))
            port.listen(pin, Select(self, len(self.slaves)))
            self.slaves.append(slave)
            self.owners.append(len(self.parts) - 1)

    def select(self, index, active):
        """Handles a change of a chip select."""
        slave = self.slaves[index]
        if self.owners[index] != self.part:
            return
        if active:
            self.selected = [*self.selected, slave]
            if self.fitted:
                slave.select()
        elif slave in self.selected:
            self.selected = [other for other in self.selected if other is not slave]
            if self.shift is not None:
                self.board.record("deselected_in_transfer", spi=self.name)
            if self.fitted:
                slave.deselect()

    # -- transfers ---------------------------------------------------------------------------------------------------

    @property
    def bit_hz(self):
        """Returns the frequency of the serial clock in hertz."""
        return self.board.rcc.clock_hz(self.bus) >> (self.cr1 >> 3 & 7) + 1

    def _load(self):
        self.shift, self.tdr = self.tdr, None
        self.sr |= TXE | BSY
        bits = 16 if self.cr1 & DFF else 8
        divider = 2 << (self.cr1 >> 3 & 7)
        self.departure = self.board.schedule(bits * divider * PS // self.board.rcc.clock_hz(self.bus), self._finished)

    def _finished(self):
        self.departure = None
        word, self.shift = self.shift, None
        value = self._exchange(word)
        if self.sr & RXNE:
            self.sr |= OVR
            self.board.record("overrun", spi=self.name)
        else:
            self.rdr = value
            self.sr |= RXNE
        if self.tdr is not None:
            self._load()
        else:
            self.sr &= ~BSY
        self._interrupt()
        if self.cr2 & (RXDMAEN | TXDMAEN):
            self.serve_dma()

    def _exchange(self, word):
        """Returns the word that MISO delivers; a line without a driver is high."""
        if not connected(self.board, self.sck, self.function):
            return 0xFFFF if self.cr1 & DFF else 0xFF
        if self.bit_hz > SLOW_PIN_HZ and not self.slow_noted and self._slow():
            self.slow_noted = True
            self.board.record("slow_pin", spi=self.name, hz=self.bit_hz)
        heard = connected(self.board, self.mosi, self.function)
        mode = (bool(self.cr1 & CPOL), bool(self.cr1 & CPHA))
        received = 0
        for shift in ((8, 0) if self.cr1 & DFF else (0,)):
            byte = word >> shift & 0xFF if heard else 0
            if self.cr1 & LSBFIRST:
                byte = int(f"{byte:08b}"[::-1], 2)
            answer = 0xFF
            for slave in self.selected if self.fitted else ():
                answer &= slave.transfer(byte, mode, self.bit_hz)
            if self.cr1 & LSBFIRST:
                answer = int(f"{answer:08b}"[::-1], 2)
            received = received << 8 | answer
        return received if connected(self.board, self.miso, self.function) else 0

    def _slow(self):
        for letter, number in (*self.sck, *self.mosi):
            port = self.board.peripherals["GPIO" + letter]
            if port.alternate(number) == self.function and port.speed(number) == 0:
                return True
        return False

    def serve_dma(self):
        """Lets the DMA streams of this SPI move data as long as RXNE or TXE requests it."""
        if not self.cr2 & (RXDMAEN | TXDMAEN):
            return
        dma = self.board.peripherals[self.dma]
        if self.cr2 & RXDMAEN and self.sr & RXNE:
            dma.request(self.name + "_RX")
        while self.cr2 & TXDMAEN and self.sr & TXE and self.cr1 & SPE and dma.request(self.name + "_TX"):
            pass

    # -- registers ---------------------------------------------------------------------------------------------------

    def _interrupt(self):
        sr, cr2 = self.sr, self.cr2
        level = bool(cr2 & RXNEIE and sr & RXNE or cr2 & TXEIE and sr & TXE or cr2 & ERRIE and sr & (OVR | MODF))
        if level != self.irq_level:
            self.irq_level = level
            self.board.irq(self.interrupt, level)

    def read(self, offset, size):
        if offset == 0x08:
            value = self.sr
            if self.overrun_read:
                self.sr &= ~OVR
                self.overrun_read = False
                self._interrupt()
            if value & MODF:
                self.fault_read = True
            return value
        if offset == 0x0C:
            self.sr &= ~RXNE
            self.overrun_read = bool(self.sr & OVR)
            self._interrupt()
            return self.rdr & (0xFF if size == 1 else 0xFFFF)
        registers.check(self, offset, size, registers.HALF_WORD)
        if offset == 0x00:
            return self.cr1
        if offset == 0x04:
            return self.cr2
        if offset == 0x10:
            return 7
        if offset == 0x1C:
            return 0
        if offset == 0x20:
            return 2
        raise registers.unmodelled(self, offset, "read")

    def write(self, offset, value, size):
        if offset == 0x0C:
            self._write_dr(value)
            return
        registers.check(self, offset, size, registers.HALF_WORD)
        if offset == 0x00:
            self._write_cr1(value & 0xFFFF)
        elif offset == 0x04:
            self._write_cr2(value)
        elif offset == 0x1C and value & 0x800:
            raise Violation(f"{self.name}: I2S is not modelled")
        elif offset not in (0x08, 0x1C):
            raise registers.unmodelled(self, offset, "write")
        self._interrupt()

    def _write_dr(self, value):
        if not self.cr1 & SPE:
            self.board.record("ignored_write", register=self.name + "_DR", value=value)
            return
        if self.tdr is not None:
            self.board.record("transmit_overwritten", spi=self.name)
        self.tdr = value & (0xFFFF if self.cr1 & DFF else 0xFF)
        self.sr = self.sr & ~TXE | BSY
        if self.shift is None:
            self._load()
        self._interrupt()

    def _write_cr1(self, value):
        if value & (RXONLY | CRCEN | BIDIMODE):
            raise Violation(f"{self.name}: receive-only, one-wire and CRC modes are not modelled")
        if value & SPE and not value & MSTR:
            raise Violation(f"{self.name}: slave mode is not modelled")
        if self.shift is not None and (value ^ self.cr1) & ~(SSI | SPE):
            self.board.record("changed_in_transfer", spi=self.name, value=value)
        if self.shift is not None and not value & SPE:
            self.board.record("disabled_in_transfer", spi=self.name)
            self.departure.cancel()
            self.departure = self.shift = self.tdr = None
            self.sr = self.sr & ~BSY | TXE
        if self.fault_read:
            self.sr &= ~MODF
            self.fault_read = False
        if value & SPE and not self.cr1 & SPE:
            self.slow_noted = False
        self.cr1 = value
        self._master_fault()
        if value & SPE:
            self.serve_dma()

    def _master_fault(self):
        """Takes a master with a low internal NSS off the bus (section 28.3.10): SSI with SSM, otherwise the pin."""
        if not self.cr1 & MSTR or not self.cr1 & SPE:
            return
        if self.cr1 & SSM:
            low = not self.cr1 & SSI
        elif self.cr2 & SSOE:
            low = False
        else:
            low = not any(self.board.peripherals["GPIO" + letter].alternate(number) == self.function
                          and self.board.peripherals["GPIO" + letter].level(number) for letter, number in self.nss)
        if low:
            self.sr |= MODF
            self.cr1 &= ~(MSTR | SPE)
            self.board.record("mode_fault", spi=self.name)

    def _write_cr2(self, value):
        if value & FRF:
            raise Violation(f"{self.name}: TI mode is not modelled")
        self.cr2 = value & 0xE7
        self.serve_dma()

    def configure(self, key, value):
        if key == "fitted":
            self.fitted = bool(value)
        elif key == "part":
            self.part = [type(part).__name__ for part in self.parts].index(value)
        elif key.startswith("imu_") and self.parts:
            self.parts[self.part].configure(key[4:], value)
        else:
            super().configure(key, value)


class Select:
    """The listener that a port calls when a chip-select pin changes."""

    def __init__(self, spi, index):
        self.spi, self.index = spi, index

    def __call__(self, level):
        self.spi.select(self.index, not level)


def spis(board):
    """Creates the three SPIs of the STM32F405 with their candidate pins."""
    one = ((("A", 4), ("A", 15)), (("A", 5), ("B", 3)), (("A", 6), ("B", 4)), (("A", 7), ("B", 5)))
    two = ((("B", 9), ("B", 12)), (("B", 10), ("B", 13)), (("B", 14), ("C", 2)), (("B", 15), ("C", 3)))
    three = ((("A", 4), ("A", 15)), (("B", 3), ("C", 10)), (("B", 4), ("C", 11)), (("B", 5), ("C", 12)))
    return [Spi(board, "SPI1", 0x4001_3000, 35, "PCLK2", 5, one), Spi(board, "SPI2", 0x4000_3800, 36, "PCLK1", 5, two),
            Spi(board, "SPI3", 0x4000_3C00, 51, "PCLK1", 6, three)]

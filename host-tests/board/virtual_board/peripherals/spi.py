"""SPI1 as a polled master of bytes with slaves behind chip-select pins (RM0090 section 28).

A byte takes eight bits at the bus clock divided by BR. Data reach the slave only if SCK and MOSI have the alternate
function, and come back only if MISO has it. `slow_pin`: SCK or MOSI has OSPEEDR 00 above 2 MHz (section 8.4.3; ES0182, corrupted last bit).
Left out: interrupts, DMA, 16 bits, LSB first, the NSS pin, slave mode, receive-only and one-wire modes, CRC, TI mode, I2S.
Assumed: a chip-select line has a pull-up on the board, so a pin that is not yet an output does not select; MISO without its alternate
function reads 0, and a line that no slave drives reads 1.

Settings: `fitted` (False: no slave answers, MISO floats high); `part` (the class of the part whose dies answer, the first at the start);
settings that begin with `imu_` are passed to that part.
"""

from ..violation import Violation
from .gpio import connected
from .registers import HALF_WORD, Registers

PS = 1_000_000_000_000
CPHA, CPOL, MSTR, SPE, SSI, SSM = (1 << bit for bit in (0, 1, 2, 6, 8, 9))
MASTER, RATE = MSTR | SSI | SSM, 7 << 3
RXNE, TXE, OVR, BSY = (1 << bit for bit in (0, 1, 6, 7))
#: Alternate function of the pins.
FUNCTION = 5


class Spi(Registers):
    """SPI1."""

    name, base, clock = "SPI1", 0x4001_3000, "SPI1"
    sizes, settings = HALF_WORD, {"fitted"}
    #: Candidates of each pin, (port letter, number), and the fastest clock of a pin of low speed.
    sck, miso, mosi = (("A", 5), ("B", 3)), (("A", 6), ("B", 4)), (("A", 7), ("B", 5))
    slow_hz = 2_000_000
    #: Bytes that wait in each direction.
    depth = 1
    readers, writers = {0x00: "cr1", 0x08: "sr"}, {0x00: "_write_cr1"}

    def __init__(self, board):
        super().__init__(board)
        #: Parts that may be fitted, and of each slave its number in them.
        self.parts, self.part, self.owners = [], 0, []
        self.slaves, self.selected = [], []
        self.fitted = True
        self.departure = None
        self._registers()

    def _registers(self):
        self.cr1 = self.rdr = 0
        self.overrun = self.overrun_read = self.slow_noted = False
        self._empty()

    def _empty(self):
        self.received, self.waiting, self.shift = [], [], None

    def reset(self, cause):
        if self.departure:
            self.departure.cancel()
            self.departure = None
        self._registers()
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
        return self.board.rcc.clock_hz("PCLK2") >> (self.cr1 >> 3 & 7) + 1

    @property
    def mode(self):
        """Returns CPOL and CPHA."""
        return bool(self.cr1 & CPOL), bool(self.cr1 & CPHA)

    def _go_on(self):
        """Begins the next byte."""
        if self.shift is None and self.waiting:
            self.shift = self.waiting.pop(0)
            self.departure = self.board.schedule(8 * PS // self.bit_hz, self._finished)

    def _finished(self):
        self.departure = None
        byte, self.shift = self.shift, None
        value = self._exchange(byte)
        if len(self.received) == self.depth:
            self.overrun = True
            self.board.record("overrun", spi=self.name)
        else:
            self.received.append(value)
        self._go_on()

    def _exchange(self, byte):
        """Returns the byte that MISO delivers; a line without a driver is high."""
        if not connected(self.board, self.sck, FUNCTION):
            return 0xFF
        if self.bit_hz > self.slow_hz and not self.slow_noted and self._slow():
            self.slow_noted = True
            self.board.record("slow_pin", spi=self.name, hz=self.bit_hz)
        byte = byte if connected(self.board, self.mosi, FUNCTION) else 0
        answer = 0xFF
        for slave in self.selected if self.fitted else ():
            answer &= slave.transfer(byte, self.mode, self.bit_hz)
        return answer if connected(self.board, self.miso, FUNCTION) else 0

    def _slow(self):
        for letter, number in (*self.sck, *self.mosi):
            port = self.board.peripherals["GPIO" + letter]
            if port.alternate(number) == FUNCTION and port.speed(number) == 0:
                return True
        return False

    # -- registers ---------------------------------------------------------------------------------------------------

    @property
    def sr(self):
        """Returns SR."""
        busy = self.waiting or self.shift is not None
        return (RXNE if self.received else 0) | (0 if self.waiting else TXE) | (OVR if self.overrun else 0) | (BSY if busy else 0)

    def read(self, offset, size):
        if offset == 0x0C:
            self.rdr, self.received = (self.received or [self.rdr])[0], []
            self.overrun_read = self.overrun
            return self.rdr
        value = super().read(offset, size)
        if offset == 0x08 and self.overrun_read:
            self.overrun = self.overrun_read = False
        return value

    def write(self, offset, value, size):
        if offset == 0x0C:
            self._write_dr(value)
        else:
            super().write(offset, value, size)

    def _write_dr(self, value):
        if not self.cr1 & SPE:
            self.board.record("ignored_write", register=self.name + "_DR", value=value)
            return
        if self.waiting:
            self.board.record("transmit_overwritten", spi=self.name)
        self.waiting = [value & 0xFF]
        self._go_on()

    def _write_cr1(self, value):
        value &= 0xFFFF
        if value & ~(CPHA | CPOL | SPE | MASTER | RATE) or value & SPE and value & MASTER != MASTER:
            raise Violation(f"{self.name}: CR1 {value:#x} asks for a mode that is not modelled")
        if self.shift is not None and (value ^ self.cr1) & ~(SSI | SPE):
            self.board.record("changed_in_transfer", spi=self.name, value=value)
        if self.shift is not None and not value & SPE:
            self.board.record("disabled_in_transfer", spi=self.name)
            self.departure.cancel()
            self.departure, self.shift, self.waiting = None, None, []
        if value & SPE and not self.cr1 & SPE:
            self.slow_noted = False
        self.cr1 = value

    def configure(self, key, value):
        if key == "part":
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

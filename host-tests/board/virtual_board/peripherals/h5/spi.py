"""SPI1 of the STM32H563 as a polled master of bytes; slaves, chip selects and pins are those of the STM32F405's model.

Witnesses: the header (registers, bits), the SVD (reset values), the HAL (order of accesses). A transfer of no set length (TSIZE 0)
runs from CSTART to SPE's fall while the transmit FIFO holds bytes. Left out: interrupts, DMA, other lengths of words, packets and
transfers, LSB first, the NSS pin, slave mode, one-wire modes, CRC, suspension.
"""

from ...violation import Violation
from ..registers import Registers, unmodelled
from ..spi import Spi as F405

SPE, CSTART, SSI = 1, 1 << 9, 1 << 12
CR1, CR2, CFG1, CFG2, IER, SR, IFCR, TXDR, RXDR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x20, 0x30
RXP, TXP, DXP, OVR, TXC = (1 << bit for bit in (0, 1, 2, 6, 12))
#: Bits of CFG1: eight bits (DSIZE) in packets of one, CRCSIZE as after a reset; and MBR.
BYTES, RATE = 0x0007_0007, 7 << 28
MASTER, CPHA, CPOL, SSM, SSIOP = (1 << bit for bit in (22, 24, 25, 26, 28))
#: Bits of CFG2 beside: SSOE and SSOM, which concern the NSS pin alone, and AFCNTR, by which the pins stay while SPE is 0.
PIN, AFCNTR = 1 << 29 | 1 << 30, 1 << 31


class Spi(F405):
    """SPI1."""

    base, depth = 0x4001_3000, 16
    sck, miso, mosi = (("A", 5),), (("G", 9),), (("B", 5),)
    readers, writers = {CR1: "control", SR: "status"}, {CR1: "_write_control", CFG1: "_write_config", CFG2: "_write_config_2"}
    kept = {CR2: (0, 0), IER: (0, 0), IFCR: (0, 0)}

    def _registers(self):
        super()._registers()
        self.control, self.values[CFG1], self.values[CFG2] = 0, BYTES, 0

    @property
    def bit_hz(self):
        """Returns the frequency of the serial clock in hertz."""
        return self.board.rcc.clock_hz("SPI1") >> (self.values[CFG1] >> 28) + 1

    @property
    def mode(self):
        """Returns CPOL and CPHA."""
        return bool(self.values[CFG2] & CPOL), bool(self.values[CFG2] & CPHA)

    @property
    def status(self):
        """Returns SR."""
        rx, tx = bool(self.received), len(self.waiting) < self.depth
        idle = not self.waiting and self.shift is None
        return (rx and RXP) | (tx and TXP) | (rx and tx and DXP) | (self.overrun and OVR) | (idle and TXC)

    def load(self, offset):
        return self.values[offset] if offset in (CFG1, CFG2) else super().load(offset)

    def read(self, offset, size):
        if offset == RXDR:
            taken, self.received = self.received[:size], self.received[size:]
            return int.from_bytes(bytes(taken), "little")
        return Registers.read(self, offset, size)

    def write(self, offset, value, size):
        if offset != TXDR:
            Registers.write(self, offset, value, size)
        elif size != 1:
            raise Violation(f"{self.name}: only bytes are modelled")
        elif not self.control & SPE or len(self.waiting) == self.depth:
            self.board.record("ignored_write", register=self.name + "_TXDR", value=value)
        else:
            self.waiting.append(value)
            self._go_on()

    def store(self, offset, value):
        if offset == IFCR:
            self.overrun = self.overrun and not value & OVR
        elif offset in (CR2, IER) and value:
            raise unmodelled(self, offset, f"write of {value:#x}")
        else:
            super().store(offset, value)

    def _write_control(self, value):
        if value & ~(SPE | CSTART | SSI) or value & SPE and not self.values[CFG2] & MASTER:
            raise Violation(f"{self.name}: CR1 {value:#x} asks for a mode that is not modelled")
        if bool(value & SSI) == bool(self.values[CFG2] & SSIOP) and value & SPE:
            raise Violation(f"{self.name}: a master that is selected itself loses its mode, which is not modelled")
        if not value & SPE:
            if self.shift is not None:
                self.board.record("disabled_in_transfer", spi=self.name)
                self.departure.cancel()
            self.departure = None
            self._empty()
            value &= ~CSTART
        self.control = value if self.control & SPE else value & ~CSTART
        self._go_on()

    def _write_config(self, value):
        self._configure(CFG1, value, BYTES | RATE)

    def _write_config_2(self, value):
        if value and not value & SSM:
            raise Violation(f"{self.name}: the NSS pin is not modelled")
        self._configure(CFG2, value, MASTER | CPHA | CPOL | SSM | SSIOP | PIN | AFCNTR)

    def _configure(self, offset, value, allowed):
        if self.control & SPE:
            self.board.record("ignored_write", register=f"{self.name}_{offset:#x}", value=value)
        elif value & ~allowed or offset == CFG1 and value & ~RATE != BYTES:
            raise Violation(f"{self.name}: {value:#x} at {offset:#x} asks for a mode that is not modelled")
        else:
            self.values[offset] = value

    def _go_on(self):
        if self.control & CSTART:
            super()._go_on()

"""System configuration controller (RM0090 section 9): which port drives each of the EXTI lines 0 to 15.

Left out: memory remapping and the compensation cell.
"""

from ..peripheral import Peripheral
from . import registers


class Syscfg(Peripheral):
    """The four EXTICR registers of section 9.2; MEMRMP reads 0 (main flash)."""

    name, base, clock = "SYSCFG", 0x4001_3800, "SYSCFG"

    def __init__(self, board):
        super().__init__(board)
        self.exticr = [0, 0, 0, 0]

    def reset(self, cause):
        self.exticr = [0, 0, 0, 0]

    def selects(self, line, port):
        """Returns whether EXTI line `line` is connected to the pin of port number `port` (A is 0)."""
        return self.exticr[line >> 2] >> 4 * (line & 3) & 15 == port

    def read(self, offset, size):
        word = offset & ~3
        if 0x08 <= word <= 0x14:
            return registers.cut(self.exticr[(word - 8) // 4], offset, size)
        if word == 0:
            return 0
        raise registers.unmodelled(self, offset, "read")

    def write(self, offset, value, size):
        word = offset & ~3
        if not 0x08 <= word <= 0x14:
            raise registers.unmodelled(self, offset, "write")
        index = (word - 8) // 4
        self.exticr[index] = registers.merge(self.exticr[index], value, offset, size) & 0xFFFF
        for port in "ABCDEFGHI":
            gpio = self.board.peripherals.get("GPIO" + port)
            if gpio:
                gpio.drive_lines()

"""CRC calculation unit (RM0090 section 4): CRC-32 with the polynomial 0x04C11DB7, a word at a time, not reflected."""

from ..peripheral import Peripheral
from . import registers


class CrcUnit(Peripheral):
    """DR, IDR and CR of section 4.4. A word takes four bus cycles, which are not modelled."""

    name, base, clock = "CRC", 0x4002_3000, "CRC"

    def __init__(self, board):
        super().__init__(board)
        self.value, self.idr = 0xFFFF_FFFF, 0

    def reset(self, cause):
        self.value, self.idr = 0xFFFF_FFFF, 0

    def read(self, offset, size):
        if offset == 0x00:
            registers.check(self, offset, size, registers.WORD)
            return self.value
        if offset & ~3 == 0x04:
            return registers.cut(self.idr, offset, size)
        if offset == 0x08:
            return 0
        raise registers.unmodelled(self, offset, "read")

    def write(self, offset, value, size):
        if offset == 0x00:
            registers.check(self, offset, size, registers.WORD)
            crc = self.value ^ value
            for _ in range(32):
                crc = (crc << 1 ^ 0x04C1_1DB7) & 0xFFFF_FFFF if crc & 0x8000_0000 else crc << 1
            self.value = crc
        elif offset & ~3 == 0x04:
            self.idr = registers.merge(self.idr, value, offset, size) & 0xFF
        elif offset == 0x08:
            if value & 1:
                self.value = 0xFFFF_FFFF
        else:
            raise registers.unmodelled(self, offset, "write")

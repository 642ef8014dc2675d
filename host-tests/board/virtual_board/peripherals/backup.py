"""Backup domain: the twenty backup registers of the RTC and the 4 KiB of backup SRAM (RM0090 sections 5.1.2 and 26.6.20).

Both survive every reset except a power-on reset, since the battery pin is assumed to be tied to the supply unless `battery` is
set.

Settings: `battery` (True: the contents survive a loss of the supply).
"""

from ..peripheral import Peripheral
from . import registers

BACKUP = range(0x50, 0xA0)


class Rtc(Peripheral):
    """BKP0R to BKP19R; writing them requires PWR_CR.DBP."""

    name, base = "RTC", 0x4000_2800

    def __init__(self, board):
        super().__init__(board)
        self.battery = False
        self.values = [0] * 20

    def reset(self, cause):
        if cause == "por" and not self.battery:
            self.backup_reset()

    def backup_reset(self):
        """Clears the registers after BDRST or a loss of all supplies (section 26.6.20)."""
        self.values = [0] * 20

    def read(self, offset, size):
        registers.check(self, offset, size, registers.WORD)
        if offset not in BACKUP:
            raise registers.unmodelled(self, offset, "read")
        return self.values[(offset - 0x50) // 4]

    def write(self, offset, value, size):
        registers.check(self, offset, size, registers.WORD)
        if offset not in BACKUP:
            raise registers.unmodelled(self, offset, "write")
        if not self.board.peripherals["PWR"].backup_writable:
            self.board.record("ignored_write", register=f"RTC_BKP{(offset - 0x50) // 4}R", value=value)
            return
        self.values[(offset - 0x50) // 4] = value

    def configure(self, key, value):
        if key != "battery":
            super().configure(key, value)
        self.battery = bool(value)


class BackupSram(Peripheral):
    """Four KiB that BDRST does not clear. Without the backup regulator the contents are lost with the supply."""

    name, base, size, clock = "BKPSRAM", 0x4002_4000, 0x1000, "BKPSRAM"

    def __init__(self, board):
        super().__init__(board)
        self.cells = bytearray(self.size)

    def reset(self, cause):
        if cause == "por":
            self.cells = bytearray(b"\xA5" * self.size)

    def read(self, offset, size):
        return int.from_bytes(self.cells[offset:offset + size], "little")

    def write(self, offset, value, size):
        if not self.board.peripherals["PWR"].backup_writable:
            self.board.record("ignored_write", register=f"BKPSRAM {offset:#x}", value=value)
            return
        self.cells[offset:offset + size] = value.to_bytes(size, "little")

"""Power control, system configuration and debug support of the STM32H563, each with the registers that an image touches."""

from ..registers import Registers

VOSRDY, ACTVOSRDY = 1 << 3, 1 << 13
#: A new voltage scale is reached after this time, picoseconds. Assumed: the header and the SVD give none.
SCALE_PS = 20_000_000


class Pwr(Registers):
    """VOSCR, VOSSR, BDCR, DBPCR and UCPDR. Scale 0, the fastest, is VOS = 3."""

    name, base = "PWR", 0x4402_0800
    kept = {0x10: (0, 0x30), 0x14: (VOSRDY | ACTVOSRDY, 0), 0x20: (0, 0x303), 0x24: (0, 1), 0x2C: (0, 3)}

    def reset(self, cause):
        super().reset(cause)
        self.scale = 0

    @property
    def backup_writable(self):
        """Returns whether DBPCR.DBP lets the backup domain be written."""
        return bool(self.values[0x24])

    def store(self, offset, value):
        super().store(offset, value)
        wanted = self.values[0x10] >> 4
        if offset == 0x10 and wanted != self.scale:
            self.values[0x14] &= ~(VOSRDY | ACTVOSRDY)
            self.board.schedule(SCALE_PS, lambda: self._reached(wanted))

    def _reached(self, scale):
        self.scale = scale
        self.values[0x14] = VOSRDY | ACTVOSRDY | scale << 14


class Sbs(Registers):
    """The system configuration block: reset and clocked at every start, and otherwise left alone."""

    name, base, clock = "SBS", 0x4400_0400, "SBS"


class Dbgmcu(Registers):
    """DBGMCU_CR, which freezes nothing, since no debugger halts this board."""

    name, base = "DBGMCU", 0x4402_4000
    kept = {0x04: (0, 0x0000_FFF6)}

"""Embedded flash interface (RM0090 section 3): keys, erase, programming, option bytes, and the content after a power cut.

The array itself belongs to the board, which calls `program` for each store into the flash. The board is stalled until an
operation ends, because code runs from flash and a read during an operation waits for its end (section 3.6). The stall begins
with the operation even if the code runs from RAM; that is stricter than the part.
Times are those of DS8626 tables 39 and 40 for words of 32 bits, typical unless `time_factor` is set (2 gives the maximum).

Left out: read protection, the one-time programmable area, other PSIZE than x32, the mass erase, interrupts, read-while-write, stale cache
lines, accesses to parts of registers. Assumed where the manual is silent: a STRT without SER does nothing; error flags that are still
set do not stop the next operation; PG stays in force after LOCK is set; a key written while FLASH_CR is unlocked is ignored; OPTCR takes
the time of a 16 KiB erase. An interrupted erase has set, and an interrupted word has cleared, about the share of the bits by which it had
advanced.

Settings: `time_factor`, `option_bytes` (OPTCR as loaded at reset).
"""

import random

from ..violation import Violation
from .flash_keys import KEYS, OPTION_KEYS, OPTLOCK, OPTSTRT, Keyed

PG, SER, SNB, PSIZE, X32, STRT, LOCK = 1 << 0, 1 << 1, 15 << 3, 3 << 8, 2 << 8, 1 << 16, 1 << 31
EOP, OPERR, WRPERR, PGAERR, PGPERR, PGSERR, BSY = 1 << 0, 1 << 1, 1 << 4, 1 << 5, 1 << 6, 1 << 7, 1 << 16
FLAGS = EOP | OPERR | WRPERR | PGAERR | PGPERR | PGSERR
FACTORY_OPTIONS = 0x0FFF_AAED
#: Erase times in milliseconds for sectors of 16, 64 and 128 KiB.
ERASE_MS = {16: 250, 64: 550, 128: 1000}
PROGRAM_US = 16
#: Lowest supply in millivolts (table 7).
LEAST_SUPPLY_MV = 2700
MS = 1_000_000_000
US = 1_000_000
#: The main memory of the STM32F405xG, 1 MiB in twelve sectors: (address, length) of each (table 5).
BASE = 0x0800_0000
_KIB = 1024
_LENGTHS = [16 * _KIB] * 4 + [64 * _KIB] + [128 * _KIB] * 7
SECTORS = tuple((BASE + sum(_LENGTHS[:number]), length) for number, length in enumerate(_LENGTHS))
SIZE = sum(_LENGTHS)


class Flash(Keyed):
    """The registers of section 3.9 and the operations that they start."""

    base, kept = 0x4002_3C00, {0x04: (0, 0), 0x08: (0, 0)}
    locks = {0x04: ("cr", LOCK, KEYS), 0x08: ("optcr", OPTLOCK, OPTION_KEYS)}
    readers = {0x00: "acr", 0x0C: "sr", 0x10: "cr", 0x14: "optcr"}
    writers = {0x00: "_write_acr", 0x0C: "_write_sr", 0x10: "_write_cr", 0x14: "_write_optcr"}
    settings = {"time_factor", "starts_unlocked"}

    def __init__(self, board):
        super().__init__(board)
        self.time_factor = 1.0
        self.random = random.Random(405)
        self.options = FACTORY_OPTIONS
        self.operation = None
        self.done = None
        self.loaded_bor = self.options >> 2 & 3
        #: Whether a reset does not lock the controller: a fault of the chip.
        self.starts_unlocked = False
        self._registers()

    def _registers(self):
        self.acr, self.latency = 0, 0
        self.sr, self.cr = 0, 0 if self.starts_unlocked else LOCK
        self.optcr = self.options | OPTLOCK

    @property
    def bor_level(self):
        """Returns BOR_LEV as loaded from the option bytes at the last reset."""
        return self.loaded_bor

    def reset(self, cause):
        super().reset(cause)
        self._registers()
        self.loaded_bor = self.options >> 2 & 3

    # -- registers ---------------------------------------------------------------------------------------------------

    def _write_sr(self, value):
        self.sr &= ~(value & FLAGS)

    def _write_acr(self, value):
        for reset_bit, enable_bit, what in ((1 << 11, 1 << 9, "ICRST"), (1 << 12, 1 << 10, "DCRST")):
            if value & reset_bit and self.acr & enable_bit:
                raise Violation(f"FLASH: {what} is written while the cache is enabled (section 3.9.1)")
        self.acr = value & 0x1F07
        self.latency = value & 7
        self.board.rcc.check_limits()

    def _write_cr(self, value):
        if self.cr & LOCK:
            self.board.record("ignored_write", register="FLASH_CR", value=value)
            return
        if value & ~(PG | SER | SNB | PSIZE | STRT | LOCK):
            raise Violation(f"FLASH: CR {value:#x}: the mass erase and interrupts are not modelled")
        self.cr = value & ~STRT
        if value & STRT:
            self._erase()

    def _write_optcr(self, value):
        if self.optcr & OPTLOCK:
            self.board.record("ignored_write", register="FLASH_OPTCR", value=value)
            return
        if value >> 8 & 0xFF != 0xAA:
            raise Violation("FLASH: read protection is not modelled; RDP has to stay 0xAA")
        self.optcr = value & 0x0FFF_FFEF & ~OPTSTRT
        if value & OPTSTRT:
            self._begin(("options", None, value & 0x0FFF_FFEC), ERASE_MS[16] * MS)

    def _refuse(self, flag):
        """Sets the flag of an operation that cannot run."""
        self.sr |= flag
        self.board.record("flash_error", flag=flag)

    # -- operations --------------------------------------------------------------------------------------------------

    def _protected(self, sector):
        return not self.optcr >> (16 + sector) & 1

    def _enough(self):
        """Returns whether the supply is sufficient for words of 32 bits (table 7)."""
        if self.cr & PSIZE != X32:
            raise Violation("FLASH: only PSIZE x32 is modelled")
        supply = self.board.peripherals["PWR"].supply_mv
        if supply < LEAST_SUPPLY_MV:
            self.board.record("program_below_voltage", supply_mv=supply)
        return supply >= LEAST_SUPPLY_MV

    def _erase(self):
        sector = (self.cr & SNB) >> 3
        if self.cr & PG and self.cr & SER:
            raise Violation("FLASH: PG and SER are set at STRT")
        if not self.cr & SER:
            self.board.record("ignored_write", register="FLASH_CR", value=self.cr | STRT)
            return
        if sector >= len(SECTORS):
            raise Violation(f"FLASH: SNB {sector} does not exist on the STM32F405 (table 5)")
        if self._protected(sector):
            self._refuse(WRPERR)
            return
        enough = self._enough()
        self.board.record("flash_erase", sectors=[sector])
        self._begin(("erase", sector, enough), ERASE_MS[SECTORS[sector][1] // 1024] * MS)

    def program(self, address, value, size):
        """Handles a store of `size` bytes by the core at `address` in the array (section 3.6.4)."""
        if self.operation:
            self._finish()
        if not self.cr & PG:
            self._refuse(PGSERR)
        elif address % 16 + size > 16:
            self._refuse(PGAERR)
        elif size != 4:
            self._refuse(PGPERR)
        elif self._protected(sector_of(address)):
            self._refuse(WRPERR)
        else:
            enough = self._enough()
            old = int.from_bytes(self.board.memory_read(address, size), "little")
            if value & ~old:
                self.board.record("programmed_over", address=address, old=old, value=value)
            self._begin(("program", (address, size, old, old & value), enough), PROGRAM_US * US)

    def _begin(self, operation, duration_ps):
        duration = round(duration_ps * self.time_factor)
        self.operation = (*operation, self.board.now, duration)
        self.sr |= BSY
        self.done = self.board.schedule(duration, self._finish)
        self.board.stall(self.board.now + duration)

    def _finish(self):
        kind, what, detail, _, _ = self.operation
        self._end()
        if kind == "erase":
            address, length = SECTORS[what]
            self.board.memory_write(address, b"\xFF" * length if detail else self.random.randbytes(length))
        elif kind == "program":
            address, size, _, value = what
            if not detail:
                value = self.random.getrandbits(8 * size)
            self.board.memory_write(address, value.to_bytes(size, "little"))
        else:
            self.options = detail | 1

    def _end(self):
        if self.done:
            self.done.cancel()
        self.operation, self.done = None, None
        self.sr &= ~BSY

    def _interrupted(self):
        """Leaves a mixture of old and new contents after a reset or a loss of power during an operation (section 3.6.1)."""
        kind, what, _, begun, duration = self.operation
        self._end()
        share = (self.board.now - begun) / duration if duration else 1.0
        self.board.record("flash_interrupted", operation=kind, share=share)
        if kind == "erase":
            address, length = SECTORS[what]
            old = int.from_bytes(self.board.memory_read(address, length), "little")
            mixed = old | self._bits(8 * length, share)
            self.board.memory_write(address, mixed.to_bytes(length, "little"))
        elif kind == "program":
            address, size, old, value = what
            mixed = old & (value | ~self._bits(8 * size, share))
            self.board.memory_write(address, mixed.to_bytes(size, "little"))

    def _bits(self, count, share):
        """Returns a word of `count` bits of which about `share` are ones, to one part in 256."""
        bits = 0
        for place in range(8):
            word = self.random.getrandbits(count)
            bits = bits | word if int(share * 256) >> place & 1 else bits & word
        return bits

    def configure(self, key, value):
        if key == "error_flags":
            # Flags that an operation before this program has left in SR.
            self.sr |= value & FLAGS & ~EOP
        elif key == "option_bytes":
            self.options = value & 0x0FFF_FFED
            self.loaded_bor = value >> 2 & 3
            self.optcr = self.options | OPTLOCK
        else:
            super().configure(key, value)


def sector_of(address):
    """Returns the number of the sector that holds an address."""
    for number, (start, length) in enumerate(SECTORS):
        if start <= address < start + length:
            return number
    raise ValueError(f"{address:#x} is outside of the main memory")

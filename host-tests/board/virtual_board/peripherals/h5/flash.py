"""Flash interface of the STM32H563: two banks of 128 sectors of 8 KiB, of which one is read while the other is written.

A store to the array fills a buffer of sixteen bytes, which are programmed when it is full. What is executed from the bank that
is busy stalls the core. Witnesses: the header, the HAL, and for NSSR (which NSCCR clears), INCERR and an incomplete buffer what
others measured on a NUCLEO-H563ZI (w1ne/labwired-core, pull request 335). A power cut or reset during an operation leaves
quad-words whose ECC does not fit; reading one sets ECCDETR.ECCD, which is an NMI until it is cleared. A second programming of a
quad-word, whose ECC would no longer fit either, is a violation.

Of the option bytes there is SWAP_BANK, which OPTSTRT programs from OPTSR_PRG. From the next reset on addresses follow it; BKSEL
names the bank itself. Witnesses: ST's GetBank and SystemInit, which starts a change again that OPSR says a reset has interrupted,
and wolfBoot. No witness says what a power cut leaves of a change: here, either value of SWAP_BANK, and all others as they were.
(Of other families ST's manuals say that mismatching option bytes may lock the part.) Left out: all other option bytes, high-cycle
data, bank and mass erase, protection. Guessed: the times, since no data sheet (DS14258) was at hand.
"""

from ...violation import Violation
from ..flash_keys import KEYS, OPTION_KEYS, OPTLOCK, OPTSTRT, Keyed

BASE, BANK, SECTOR, QUAD = 0x0800_0000, 1 << 20, 8 << 10, 16
ACR, NSKEYR, OPTKEYR, OPSR, OPTCR, NSSR, NSCR, NSCCR, OPTSR_CUR, OPTSR_PRG, ECCDETR = (
    0x00, 0x04, 0x0C, 0x18, 0x1C, 0x20, 0x28, 0x30, 0x50, 0x54, 0x104)
BSY, WBNE, EOP, PGSERR, STRBERR, INCERR = (1 << bit for bit in (0, 1, 16, 18, 19, 20))
FLAGS = 0x00FF_0000
LOCK, PG, SER, START, BKSEL = (1 << bit for bit in (0, 1, 2, 5, 31))
#: All that NSCR keeps: PG, SER, SNB, BKSEL; the rest is not modelled.
KEPT = PG | SER | 0x7F << 6 | BKSEL
ECCD = SWAP_BANK = 1 << 31
#: OPSR.CODE_OP of a quad-word, a sector, and a change of option bytes.
WRITING, ERASING, CHANGING = 1 << 29, 3 << 29, 6 << 29
PROGRAM_PS, ERASE_PS, OPTIONS_PS = 100_000_000, 4_000_000_000, 10_000_000_000


class Flash(Keyed):
    """ACR, the keys, the status and control registers of non-secure code, and SWAP_BANK."""

    base, kept = 0x4002_2000, {ACR: (0x13, 0x13F)}
    locks = {NSKEYR: ("control", LOCK, KEYS), OPTKEYR: ("option_lock", OPTLOCK, OPTION_KEYS)}
    readers = {NSCR: "control", ECCDETR: "detected", OPSR: "interrupted", OPTSR_PRG: "wanted"}
    writers = {NSCR: "_write_control", OPTCR: "_write_options", OPTSR_PRG: "_want"}
    #: As on the STM32F405, bit 5 set: software starts the watchdog.
    options = 1 << 5

    def __init__(self, board):
        super().__init__(board)
        #: The operation: its end, address, new content (None: option bytes). The quad-words whose ECC does not fit.
        self.operation = None
        self.torn = set()
        #: SWAP_BANK, and whether the banks are swapped now.
        self.swap_bank = self.swapped = False

    def reset(self, cause):
        self.interrupted = 0
        super().reset(cause)
        self.status, self.control, self.option_lock, self.detected = 0, LOCK, OPTLOCK, 0
        self.buffer, self.at = {}, 0
        if self.swap_bank != self.swapped:
            self.swapped = self.swap_bank
            both = self.board.memory_read(BASE, 2 * BANK)
            self.board.memory_write(BASE, both[BANK:] + both[:BANK])
            self.torn = {quad ^ BANK for quad in self.torn}
        self.wanted = SWAP_BANK if self.swap_bank else 0
        self._watch()

    @property
    def latency(self):
        """Returns the wait states."""
        return self.values[ACR] & 15

    def load(self, offset):
        if offset == NSSR:
            return self.status | (BSY if self.operation else 0) | (WBNE if self.buffer else 0)
        if offset == OPTSR_CUR:
            return SWAP_BANK if self.swap_bank else 0
        if offset == OPTCR:
            return self.option_lock | (SWAP_BANK if self.swapped else 0)
        return super().load(offset)

    def store(self, offset, value):
        if offset == NSCCR:
            self.status &= ~(value & FLAGS)
        elif offset == ECCDETR:
            self.detected = 0 if value & ECCD else self.detected
        elif offset == NSSR:
            self.board.record("ignored_write", register="FLASH_NSSR", value=value)
        else:
            super().store(offset, value)

    def _want(self, value):
        if self.option_lock:
            self.board.record("ignored_write", register="FLASH_OPTSR_PRG", value=value)
        elif value & ~SWAP_BANK:
            raise Violation(f"{self.name}: OPTSR_PRG {value:#x} changes what is not modelled")
        else:
            self.wanted = value

    def _write_options(self, value):
        if self.option_lock or self.operation:
            self.board.record("ignored_write", register="FLASH_OPTCR", value=value)
            return
        if value & ~(OPTLOCK | OPTSTRT | SWAP_BANK):
            raise Violation(f"{self.name}: OPTCR {value:#x} asks for what is not modelled")
        if value & OPTSTRT:
            self.board.record("options", swap_bank=bool(self.wanted))
            self.operation = self.board.schedule(OPTIONS_PS, self._end), None, bool(self.wanted)
        self.option_lock = value & OPTLOCK

    def _write_control(self, value):
        if self.control & LOCK or self.operation:
            self.board.record("ignored_write", register="FLASH_NSCR", value=value)
            return
        if value & ~(KEPT | LOCK | START):
            raise Violation(f"{self.name}: NSCR {value:#x} asks for what is not modelled")
        self.control = value & (KEPT | LOCK)
        if value & START:
            if not value & SER or value & PG:
                raise Violation(f"{self.name}: NSCR {value:#x} starts no sector erase")
            at = (BANK if bool(value & BKSEL) != self.swapped else 0) + (value >> 6 & 0x7F) * SECTOR
            self.board.record("flash_erase", sectors=[at // SECTOR])
            self._begin(BASE + at, b"\xFF" * SECTOR, ERASE_PS)

    def program(self, address, value, size):
        """Takes a store to the array into the buffer."""
        quad = address & -QUAD
        if not self.control & PG or self.control & LOCK:
            self.status |= PGSERR
        elif self.buffer and quad != self.at:
            self.status |= INCERR
            self.buffer = {}
        elif any(address + n in self.buffer for n in range(size)):
            self.status |= STRBERR
        else:
            if self.operation:
                raise Violation(f"{self.name}: a store to the array during an operation is not modelled")
            self.at = quad
            self.buffer.update((address + n, value >> 8 * n & 0xFF) for n in range(size))
            if len(self.buffer) == QUAD:
                data = bytes(self.buffer[quad + n] for n in range(QUAD))
                self.buffer = {}
                if quad in self.torn or self.board.memory_read(quad, QUAD) != b"\xFF" * QUAD:
                    raise Violation(f"{self.name}: the quad-word at {quad:#x} is programmed a second time")
                self._begin(quad, data, PROGRAM_PS)

    def _begin(self, address, data, duration):
        self.operation = self.board.schedule(duration, self._end), address, data
        processor = getattr(self.board, "processor", None)
        if processor and (processor.get("pc") - BASE) // BANK == (address - BASE) // BANK:
            self.board.stall(self.board.now + duration)

    def _end(self):
        (_, address, data), self.operation = self.operation, None
        if address is None:
            self.swap_bank = data
            return
        self.board.memory_write(address, data)
        self.torn.difference_update(range(address, address + len(data), QUAD))
        self.status |= EOP

    def _interrupted(self):
        """Leaves the operation half done: each bit is the old or the new one."""
        (done, address, data), self.operation = self.operation, None
        done.cancel()
        self.interrupted = CHANGING if address is None else WRITING if len(data) == QUAD else ERASING
        if address is None:
            self.swap_bank = self.board.memory.random.choice((self.swap_bank, data))
            return
        noise = self.board.memory.random.randbytes(len(data))
        old = self.board.memory_read(address, len(data))
        self.board.memory_write(address, bytes(a & n | b & ~n for a, b, n in zip(old, data, noise)))
        self.torn.update(range(address, address + len(data), QUAD))

    def _watch(self):
        """Watches the reads of the array from the first quad-word on whose ECC does not fit."""
        # The hook outlives a restored snapshot, so the board keeps its range.
        end = getattr(self.board, "watched_from", BASE + 2 * BANK)
        begin = min(self.torn, default=end) & -SECTOR
        if begin < end:
            self.board.watched_from = begin
            self.board.processor.watch_reads(begin, end - 1, self._was_read)

    def _was_read(self, address):
        if address & -QUAD in self.torn and not self.detected:
            self.detected = ECCD | 1 << 22 | (address - BASE) % BANK // QUAD
            self.board.nmi()

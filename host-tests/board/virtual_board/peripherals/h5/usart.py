"""USARTs of the STM32H563: the registers of the newer generation and the FIFOs, over the lines and times of the STM32F405's.

Flags, enables and errors have the same bits in ISR as they had in SR (stm32h563xx.h); flags are cleared in ICR, and UE moved to
bit 0. Left out: DMA, the thresholds of the FIFOs, the prescaler. Assumed: eight places in each FIFO, of which the transmitter's
second to eighth are not used, since nothing modelled here sends.
"""

from collections import deque

from ...violation import Violation
from ..registers import ANY, WORD, check, cut, unmodelled
from ..usart import BRR, CR1, CR2, CR3, DMAR, DMAT, DR, RE, RXNE, TC, TE, UE, Usart

FIFOEN, TEACK, REACK = 1 << 29, 1 << 21, 1 << 22
CLEARABLE = 0x5F
PLACES = 8
#: CR2, CR3 and BRR, by where they were.
MOVED = {0x04: CR2, 0x08: CR3, 0x0C: BRR}


class NewUsart(Usart):
    """One USART."""

    def _registers(self):
        super()._registers()
        self.waiting = deque()
        self.fifo = False
        self.dma = "GPDMA1"

    def _receive(self, start, byte):
        if not (self.fifo and self.sr & RXNE and len(self.waiting) < PLACES - 1):
            super()._receive(start, byte)
            return
        # The receiver works as if its register were free, and its byte waits behind the others.
        oldest = self.rdr
        self.sr &= ~RXNE
        super()._receive(start, byte)
        self.waiting.append(self.rdr)
        self.rdr = oldest

    def read(self, offset, size):
        check(self, offset, size, ANY)
        return cut(self.load(offset & ~3), offset, size)

    def load(self, offset):
        if offset == 0x00:
            return self.cr1 & 0x9FFC | bool(self.cr1 & UE) | (FIFOEN if self.fifo else 0)
        if offset == 0x1C:
            if self.idle_armed:
                self._detect_idle(self.board.now)
            on = self.cr1 & UE
            return self.sr | (TEACK if on and self.cr1 & TE else 0) | (REACK if on and self.cr1 & RE else 0)
        if offset == 0x24:
            value = self.rdr
            if self.waiting:
                self.rdr = self.waiting.popleft()
            else:
                self.sr &= ~RXNE
            self._interrupt()
            return value
        known = {0x04: 0, 0x08: self.cr3, 0x0C: self.brr, **dict.fromkeys((0x10, 0x14, 0x18, 0x20, 0x2C), 0)}
        if offset not in known:
            raise unmodelled(self, offset, "read")
        return known[offset]

    def write(self, offset, value, size):
        check(self, offset, size, ANY if offset == 0x28 else WORD)
        if offset == 0x00:
            if value & 0xDFFF_0002:
                raise Violation(f"{self.name}: CR1 {value:#x} asks for a mode that is not modelled")
            self.fifo = bool(value & FIFOEN)
            self.store(CR1, value & 0xBFFC | (UE if value & 1 else 0))
        elif offset == 0x08 and value & (DMAR | DMAT):
            raise Violation(f"{self.name}: DMA is not modelled")
        elif offset in MOVED:
            self.store(MOVED[offset], value)
        elif offset == 0x18:
            if value & 8:
                self.waiting.clear()
                self.sr &= ~RXNE
            self._interrupt()
        elif offset == 0x20:
            self.sr &= ~(value & CLEARABLE)
            self._interrupt()
        elif offset == 0x28:
            self.seen_tc = bool(self.sr & TC)
            self.store(DR, value)
        elif offset not in (0x10, 0x14, 0x2C) or value:
            raise unmodelled(self, offset, "write")


def usarts(board):
    """Creates the USART at the Arduino connector: D0 is PB7, D1 is PB6."""
    return [NewUsart(board, "USART1", 0x4001_3800, 58, "USART1", 7, (("B", 6), ("A", 9)), (("B", 7), ("A", 10)))]

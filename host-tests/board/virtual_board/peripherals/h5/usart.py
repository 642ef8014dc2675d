"""USARTs of the STM32H563: the registers of the newer generation and the FIFOs, over the lines and times of the STM32F405's.

Flags, enables and errors have the same bits in ISR as they had in SR (stm32h563xx.h); flags are cleared in ICR, and UE moved to
bit 0. Left out: DMA, the thresholds of the FIFOs, the prescaler. Assumed: eight places in each FIFO, of which the transmitter's
second to eighth are not used, since nothing modelled here sends.
"""

from collections import deque

from ...violation import Violation
from .. import registers
from ..usart import DMAR, DMAT, RE, RXNE, TC, TE, UE, Usart

FIFOEN, TEACK, REACK = 1 << 29, 1 << 21, 1 << 22
CLEARABLE = 0x5F
PLACES = 8


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
        registers.check(self, offset, size, registers.ANY)
        word = offset & ~3
        if word == 0x00:
            value = self.cr1 & 0x9FFC | bool(self.cr1 & UE) | (FIFOEN if self.fifo else 0)
        elif word == 0x1C:
            if self.idle_armed:
                self._detect_idle(self.board.now)
            on = self.cr1 & UE
            value = self.sr | (TEACK if on and self.cr1 & TE else 0) | (REACK if on and self.cr1 & RE else 0)
        elif word == 0x24:
            value = self.rdr
            if self.waiting:
                self.rdr = self.waiting.popleft()
            else:
                self.sr &= ~RXNE
            self._interrupt()
        elif word in (0x10, 0x14, 0x18, 0x20, 0x2C):
            value = 0
        elif word in (0x04, 0x08, 0x0C):
            value = (0, self.cr3, self.brr)[word // 4 - 1]
        else:
            raise registers.unmodelled(self, offset, "read")
        return registers.cut(value, offset, size)

    def write(self, offset, value, size):
        registers.check(self, offset, size, registers.ANY if offset == 0x28 else registers.WORD)
        if offset == 0x00:
            if value & 0xDFFF_0002:
                raise Violation(f"{self.name}: CR1 {value:#x} asks for a mode that is not modelled")
            self.fifo = bool(value & FIFOEN)
            super()._write(0x0C, value & 0xBFFC | (UE if value & 1 else 0), 4)
        elif offset == 0x04:
            super()._write(0x10, value, 4)
        elif offset == 0x08:
            if value & (DMAR | DMAT):
                raise Violation(f"{self.name}: DMA is not modelled")
            super()._write(0x14, value, 4)
        elif offset == 0x0C:
            super()._write(0x08, value, 4)
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
            super()._write(0x04, value, 2)
        elif offset not in (0x10, 0x14, 0x2C) or value:
            raise registers.unmodelled(self, offset, "write")


def usarts(board):
    """Creates the USART at the Arduino connector: D0 is PB7, D1 is PB6."""
    return [NewUsart(board, "USART1", 0x4001_3800, 58, "USART1", 7, (("B", 6), ("A", 9)), (("B", 7), ("A", 10)))]

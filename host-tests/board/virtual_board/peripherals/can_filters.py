"""Acceptance filters of bxCAN: 28 banks, here each a mask of 32 bits for FIFO 0 (RM0090 section 32.7.4).

Left out: lists, filters of 16 bits, FIFO 1.
"""

from ..violation import Violation

BANKS = 28
FINIT = 1
FMR_RESET = 0x2A1C_0E01
_ALL = (1 << BANKS) - 1


def identifier_word(frame):
    """Returns identifier, IDE and RTR in the layout of CAN_RIxR and of a 32-bit filter."""
    if frame.extended:
        return frame.identifier << 3 | 4 | frame.remote << 1
    return frame.identifier << 21 | frame.remote << 1


class Filters:
    """The filter registers; CAN1 uses only banks below CAN2SB."""

    def __init__(self):
        self.fmr = FMR_RESET
        self.mode = self.scale = self.fifo = self.active = 0
        self.banks = [0] * (2 * BANKS)
        self.known = {}

    def read(self, offset):
        """Returns the value of a filter register, or None if there is no such register."""
        if 0x240 <= offset < 0x240 + 8 * BANKS:
            return self.banks[(offset - 0x240) // 4]
        return {0x200: self.fmr, 0x204: self.mode, 0x20C: self.scale, 0x214: self.fifo, 0x21C: self.active}.get(offset)

    def write(self, offset, value):
        """Writes a register; returns False if its lock makes the hardware ignore the write, None if there is no such register."""
        self.known = {}
        open_ = bool(self.fmr & FINIT)
        if 0x240 <= offset < 0x240 + 8 * BANKS:
            index = (offset - 0x240) // 4
            if not open_ and self.active >> (index // 2) & 1:
                return False
            self.banks[index] = value
        elif offset == 0x200:
            self.fmr = value & 0x3F01 | FMR_RESET & ~0x3F01
        elif offset == 0x21C:
            self.active = value & _ALL
        elif offset in (0x204, 0x20C, 0x214):
            if not open_:
                return False
            setattr(self, {0x204: "mode", 0x20C: "scale", 0x214: "fifo"}[offset], value & _ALL)
        else:
            return None
        return True

    def match(self, word):
        """Returns the filter match index for the identifier word of a frame, or None if no filter accepts it."""
        if self.fmr & FINIT:
            return None
        if word not in self.known:
            self.known[word] = self._match(word & ~1)
        return self.known[word]

    def _match(self, word):
        if self.active & (self.mode | self.fifo | ~self.scale):
            raise Violation("CAN1: lists, filters of 16 bits and FIFO 1 are not modelled")
        number = 0
        for bank in range(min(self.fmr >> 8 & 0x3F, BANKS)):
            first, second = self.banks[2 * bank], self.banks[2 * bank + 1]
            if self.active >> bank & 1 and not (first ^ word) & second & ~1:
                return number
            # An inactive filter counts, too: a bank of 16 bits has two masks.
            number += 1 if self.scale >> bank & 1 else 2
        return None

"""Acceptance filters of bxCAN: 28 banks in two scales and two modes (RM0090 section 32.7.4)."""

BANKS = 28
FINIT = 1
FMR_RESET = 0x2A1C_0E01
_ALL = (1 << BANKS) - 1


def identifier_word(frame):
    """Returns identifier, IDE and RTR in the layout of CAN_RIxR and of a 32-bit filter."""
    if frame.extended:
        return frame.identifier << 3 | 4 | frame.remote << 1
    return frame.identifier << 21 | frame.remote << 1


def _half(word):
    """Returns the identifier word in the layout of a 16-bit filter: STID, RTR, IDE, EXID[17:15]."""
    return (word >> 21) << 5 | (word >> 1 & 1) << 4 | (word >> 2 & 1) << 3 | word >> 18 & 7


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
        """Returns (FIFO, filter match index) for the identifier word of a frame, or None if no filter accepts it."""
        if self.fmr & FINIT:
            return None
        if word not in self.known:
            self.known[word] = self._match(word)
        return self.known[word]

    def _match(self, word):
        """Returns the best match: 32 bits before 16, list before mask, then the lower number (section 32.7.4, filter priority rules)."""
        best = None
        numbers = [0, 0]
        end = self.fmr >> 8 & 0x3F
        for bank in range(min(end, BANKS)):
            wide, listed, fifo = self.scale >> bank & 1, self.mode >> bank & 1, self.fifo >> bank & 1
            for hit in self._hits(bank, word, wide, listed):
                number = numbers[fifo]
                numbers[fifo] += 1
                rank = (not wide, not listed, number)
                if hit and self.active >> bank & 1 and (best is None or rank < best[0]):
                    best = (rank, fifo, number)
        return best and best[1:]

    def _hits(self, bank, word, wide, listed):
        first, second = self.banks[2 * bank], self.banks[2 * bank + 1]
        if wide:
            word &= ~1
            if listed:
                return [(first ^ word) & ~1 == 0, (second ^ word) & ~1 == 0]
            return [(first ^ word) & second & ~1 == 0]
        half = _half(word)
        parts = [first & 0xFFFF, first >> 16, second & 0xFFFF, second >> 16]
        if listed:
            return [part == half for part in parts]
        return [(parts[0] ^ half) & parts[1] == 0, (parts[2] ^ half) & parts[3] == 0]

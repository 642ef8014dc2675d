"""Transmit mailboxes of bxCAN: requests, their order and CAN_TSR (RM0090 sections 32.7.1 and 32.9.2)."""

from .can_frame import Frame

RQCP, TXOK, ALST, TERR, ABRQ = 1, 2, 4, 8, 0x80


class Mailbox:
    """The registers of one mailbox with its request and its status bits in CAN_TSR."""

    def __init__(self):
        self.tir = self.tdtr = self.tdlr = self.tdhr = 0
        self.pending = self.abort = False
        self.status = 0
        self.order = 0

    def frame(self):
        """Returns the frame that the registers describe."""
        extended, remote, length = bool(self.tir & 4), bool(self.tir & 2), min(self.tdtr & 15, 8)
        data = b"" if remote else (self.tdlr | self.tdhr << 32).to_bytes(8, "little")[:length]
        return Frame(self.tir >> 3 if extended else self.tir >> 21, data, extended, remote, length)

    def end(self, status):
        """Ends the request, with TXOK or with what ended it."""
        self.pending = self.abort = False
        self.status = RQCP | status


class Mailboxes:
    """The three mailboxes: first come, first sent (MCR.TXFP)."""

    def __init__(self):
        self.boxes = [Mailbox() for _ in range(3)]
        self.requests = 0

    def request(self, box):
        """Handles TXRQ: the status of the last request is cleared."""
        box.pending, box.status = True, 0
        self.requests += 1
        box.order = self.requests

    def next(self):
        """Returns the mailbox that is sent first, or None."""
        return min((box for box in self.boxes if box.pending), key=lambda box: box.order, default=None)

    def completed(self):
        """Returns whether a request has ended and software has not cleared it."""
        return any(box.status & RQCP for box in self.boxes)

    def tsr(self):
        """Returns CAN_TSR. CODE is the next free mailbox or, with none free, the one sent last; LOW marks that one among several."""
        value, pending = 0, []
        for number, box in enumerate(self.boxes):
            value |= (box.status | (ABRQ if box.abort else 0)) << 8 * number
            if box.pending:
                pending.append(number)
            else:
                value |= 1 << 26 + number
        if len(pending) > 1:
            lowest = max(pending, key=lambda number: self.boxes[number].order)
            value |= 1 << 29 + lowest
        code = lowest if len(pending) == 3 else next(number for number in range(3) if number not in pending)
        return value | code << 24

    def write_tsr(self, value, in_flight):
        """Handles a write: a one in RQCP clears it and its companions; ABRQ cancels a request, at once unless it is being sent."""
        for number, box in enumerate(self.boxes):
            bits = value >> 8 * number
            if bits & RQCP:
                box.status = 0
            if bits & ABRQ and box.pending:
                if box is in_flight:
                    box.abort = True
                else:
                    box.end(0)

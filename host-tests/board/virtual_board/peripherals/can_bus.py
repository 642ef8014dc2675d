"""The CAN bus and the other nodes on it: arbitration, acknowledgement, errors and faults (ISO 11898-1).

Frames follow each other on one time line. When the bus is free, the first frame of the board and the due frames of the other nodes
contend, and the lowest arbitration field wins. A frame lasts exactly as long as its bits, stuff bits included, at the sender's bit rate.
The other nodes use `bit_rate`, and `data_bit_rate` in the data of CAN FD frames; a board whose rate differs by more than 0.5 %
receives and causes error frames, and so does one that knows only classic frames when it hears a CAN FD frame. `classic` True: the
other nodes know only these, and destroy the board's CAN FD frames.

Faults: `acknowledge` False (no other node listens), `connected` False (the board is alone on its line), `short` "recessive" (CAN_H on
CAN_L: the board reads recessive whatever it sends, which ends in bus-off) or "dominant" (nothing can be sent; a frame in progress ends
in bus-off), `babble` (another node fills the bus with frames of the highest priority).
Left out: overload frames, bit errors of the medium, propagation delay, and error frames of other nodes among themselves.
"""

import heapq
from functools import partial
from typing import NamedTuple

from .can_frame import INTERMISSION_BITS, TAIL_BITS, Frame, duration, frame_bits, priority

PS = 1_000_000_000_000
RATE_TOLERANCE = 0.005
#: Error flag and delimiter, alone and with the echo of other nodes.
ERROR_BITS_ALONE, ERROR_BITS = 6 + 8, 12 + 8
#: A receiver at another rate detects a stuffing violation within the first bits.
MISMATCH_BITS = 20
#: Codes of CAN_ESR.LEC (section 32.9.2).
STUFF_ERROR, FORM_ERROR, ACKNOWLEDGE_ERROR, RECESSIVE_ERROR, DOMINANT_ERROR = 1, 2, 3, 4, 5
BABBLE = Frame.of(0, bytes(8))


class Logged(NamedTuple):
    """One frame or error frame as an observer of the bus sees it; `error` is None for a good frame."""

    start_ps: int
    end_ps: int
    frame: Frame
    source: str
    error: str | None


def _rank(entry):
    """Orders the frames of other nodes by priority, and equal ones in the order in which they were sent."""
    return priority(entry[1]), entry[0]


class CanBus:
    """The time line of the bus. `node` is the board's controller."""

    def __init__(self, board, node):
        self.board, self.node = board, node
        self.bit_rate, self.data_bit_rate = 500_000, 2_000_000
        self.acknowledge = self.connected = True
        self.classic = False
        self.short = None
        self.babble = None
        self.log = []
        self.waiting, self.ready = [], []
        self.order = 0
        self.free_at = 0
        self.event = None
        self.in_progress = None
        self.tick = None
        self.busy_ps = self.frames = 0

    # -- for tests ---------------------------------------------------------------------------------------------------

    def send(self, identifier, data=b"", extended=False, remote=False, at_ps=None, fd=False, fast=False):
        """Sends a frame of another node as soon as possible, not before `at_ps`."""
        self.order += 1
        at = self.board.now if at_ps is None else at_ps
        heapq.heappush(self.waiting, (at, self.order, Frame.of(identifier, data, extended, remote, fd, fast)))
        self.wake()

    def take_log(self):
        """Returns everything that was on the bus since the last call."""
        log, self.log = self.log, []
        return log

    def configure(self, key, value):
        """Starts or ends a fault."""
        if key == "short":
            self._short(value)
        elif key == "babble":
            self.babble = BABBLE if value is True else value or None
            self.wake()
        else:
            setattr(self, key, value)
            self.wake()

    # -- time line ---------------------------------------------------------------------------------------------------

    @property
    def bit_ps(self):
        """Returns the bit time of the other nodes."""
        return PS // self.bit_rate

    @property
    def recessive(self):
        """Returns whether the board's receiver sees a recessive level outside of frames."""
        return self.short != "dominant"

    @property
    def shared(self):
        """Returns whether other nodes receive the board's frames and acknowledge them."""
        return self.connected and self.acknowledge

    def idle_delay(self, bits):
        """Returns the time until this many recessive bits in a row, if nothing else is sent; None if never."""
        if not self.recessive:
            return None
        if self.free_at > self.board.now:
            return self.free_at - self.board.now
        return bits * self.node.bit_ps

    def wake(self):
        """Schedules the next frame for when the bus is free, after a node has a frame or a fault has ended."""
        if self.in_progress is not None:
            return
        if self.event:
            self.event.cancel()
        self.event = self.board.schedule(max(self.free_at - self.board.now, 0), self._start)

    def _start(self):
        self.event = None
        if not self.recessive:
            return
        now = self.board.now
        other, source = self._other(now)
        own = self.node.contender(now)
        if own is not None and other is not None:
            if priority(other) < priority(own):
                self.node.arbitration_lost()
                own = None
            else:
                other = None
        if own is not None:
            self._send_own(own)
        elif other is not None:
            self._send_other(other, source)
        else:
            later = [at for at in (self.waiting[0][0] if self.waiting else None, self.node.not_before(now)) if at is not None]
            if later:
                self.event = self.board.schedule(max(min(later) - now, 0), self._start)

    def _other(self, now):
        """Returns the best frame that another node has ready, and its source."""
        while self.waiting and self.waiting[0][0] <= now:
            self.ready.append(heapq.heappop(self.waiting)[1:])
        if not self.connected or self.short:
            self.ready = []
            return None, None
        best = min(self.ready, key=_rank, default=None)
        if self.babble is not None and (best is None or priority(self.babble) <= priority(best[1])):
            return self.babble, "babble"
        return (best[1], "other") if best else (None, None)

    def _taken(self, frame):
        """Removes a frame of another node, which was sent completely, from its queue."""
        best = min((entry for entry in self.ready if entry[1] == frame), default=None)
        if best is not None:
            self.ready.remove(best)

    def mismatched(self):
        """Returns whether the board's bit rate does not match the bus."""
        return abs(self.node.bit_ps * self.bit_rate / PS - 1) > RATE_TOLERANCE

    def _unreadable(self, frame):
        """Returns whether the board cannot read a CAN FD frame, and its error."""
        if not frame.fd:
            return None
        if not self.node.takes_fd:
            return FORM_ERROR
        return STUFF_ERROR if self._fast_mismatched(frame) else None

    def _fast_mismatched(self, frame):
        """Returns whether the board's bit rate of the data does not match the bus."""
        return frame.fast and abs(self.node.data_bit_ps * self.data_bit_rate / PS - 1) > RATE_TOLERANCE

    def _send_own(self, frame):
        bit = self.node.bit_ps
        whole = duration(frame, bit, self.node.data_bit_ps)
        if self.short == "recessive":
            time, error, code = (1 + ERROR_BITS_ALONE) * bit, "bit", DOMINANT_ERROR
        elif not self.shared:
            # Up to the acknowledge slot.
            time, error, code = whole + (2 - TAIL_BITS + ERROR_BITS_ALONE) * bit, "acknowledge", ACKNOWLEDGE_ERROR
        elif self.mismatched() or frame.fd and (self.classic or self._fast_mismatched(frame)):
            error = "CAN FD" if frame.fd else "bit rate"
            time, code = (MISMATCH_BITS + ERROR_BITS) * bit, RECESSIVE_ERROR
        else:
            time, error, code = whole, None, 0
        self._transmit(frame, "board", time, error, code)

    def _send_other(self, frame, source):
        heard = self.node.listens()
        if heard and self.mismatched():
            error = "bit rate" if self.node.disturbs() else None
            bits = MISMATCH_BITS + ERROR_BITS if error else frame_bits(frame)
            self._transmit(frame, source, bits * self.bit_ps, error, STUFF_ERROR)
            return
        time = duration(frame, self.bit_ps, PS // self.data_bit_rate)
        code = self._unreadable(frame) if heard else None
        if code and self.node.disturbs():
            self._transmit(frame, source, (MISMATCH_BITS + ERROR_BITS) * self.bit_ps, "CAN FD", code)
        else:
            self._transmit(frame, source, time, None, code or 0)

    def _transmit(self, frame, source, duration, error, code):
        now = self.board.now
        self.in_progress = (now, frame, source, error, code)
        bit = self.node.bit_ps if source == "board" else self.bit_ps
        self.free_at = now + duration + INTERMISSION_BITS * bit
        self.event = self.board.schedule(duration, self._end)

    def _end(self):
        start, frame, source, error, code = self.in_progress
        self.event = self.in_progress = None
        if source == "board" and error is None and not self.shared:
            error, code = "acknowledge", ACKNOWLEDGE_ERROR
        self._note(start, frame, source, error)
        if source == "board":
            if error:
                self.node.transmission_failed(code)
            else:
                self.node.transmission_done()
        else:
            if error is None and source == "other":
                self._taken(frame)
            if code:
                self.node.reception_failed(code)
            elif self.connected:
                self.node.received(frame)
        self.wake()

    def _note(self, start, frame, source, error):
        self.busy_ps += self.board.now - start
        self.frames += 1
        self.log.append(Logged(start, self.board.now, frame, source, error))

    # -- faults ------------------------------------------------------------------------------------------------------

    def cut(self, why):
        """Ends the board's frame in progress: a reset, or a line that fails. Returns whether there was one."""
        if self.in_progress and self.in_progress[2] == "board":
            start, frame, _, _, _ = self.in_progress
            self.event.cancel()
            self.in_progress = self.event = None
            self._note(start, frame, "board", why)
            self.free_at = self.board.now + ERROR_BITS * self.bit_ps
            return True
        return False

    def _short(self, kind):
        if kind not in (None, "dominant", "recessive"):
            raise ValueError(f"short is None, dominant or recessive, not {kind!r}")
        self.short = kind
        if self.tick:
            self.tick.cancel()
            self.tick = None
        transmitting = kind is not None and self.cut("short")
        if kind is not None and self.in_progress:
            self.event.cancel()
            self.in_progress = self.event = None
        if transmitting:
            self.node.transmission_failed(RECESSIVE_ERROR if kind == "dominant" else DOMINANT_ERROR)
        if kind == "dominant":
            if not transmitting and self.node.listens():
                self.node.reception_failed(STUFF_ERROR)
            self.tick = self.board.schedule(14 * self.node.bit_ps, partial(self._dominant, transmitting))
        else:
            self.free_at = max(self.free_at, self.board.now + 11 * self.bit_ps)
            self.node.bus_recovered()
            self.wake()

    def _dominant(self, transmitting):
        """Counts eight errors for each further eight dominant bits after an error flag (ISO 11898-1 section 12.1.4.2)."""
        self.tick = None
        if self.node.count_dominant(transmitting):
            self.tick = self.board.schedule(8 * self.node.bit_ps, partial(self._dominant, transmitting))

    def power_off(self):
        """Aborts what the board was sending when its power fails; the other nodes continue without it."""
        self.event = self.in_progress = self.tick = None

    def power_on(self):
        """Drops the frames that were due while the board had no power."""
        while self.waiting and self.waiting[0][0] < self.board.now:
            heapq.heappop(self.waiting)
        self.free_at = self.board.now
        self.wake()

"""The CAN bus and the other nodes on it: arbitration, acknowledgement, errors and faults (ISO 11898-1).

Frames follow each other on one time line. When the bus is free, the best frame of the board and those of the other nodes that are
due contend, and the lower arbitration field wins. A frame lasts exactly its bits, stuff bits included, at the sender's bit rate.
The other nodes work at `bit_rate`; a board whose rate differs by more than 0.5 % gets and causes error frames.

Faults: `acknowledge` False (nobody else listens), `connected` False (the board is alone on its line), `short` "recessive" (CAN_H on
CAN_L: the board reads recessive whatever it sends, which ends in bus-off) or "dominant" (nothing can be sent; a frame under way ends
in bus-off), `babble` (another node fills the bus with frames of the highest priority).
Left out: overload frames, bit errors of the medium, propagation delay, and error frames of other nodes among themselves.
"""

import heapq
from functools import partial
from typing import NamedTuple

from .can_frame import INTERMISSION_BITS, Frame, frame_bits, priority, stuffed_bits

PS = 1_000_000_000_000
RATE_TOLERANCE = 0.005
#: Error flag and delimiter, alone and with the echo of other nodes.
ERROR_BITS_ALONE, ERROR_BITS = 6 + 8, 12 + 8
#: A receiver at another rate finds a violation of the stuffing within the first bits.
MISMATCH_BITS = 20
#: Codes of CAN_ESR.LEC (section 32.9.2).
STUFF_ERROR, ACKNOWLEDGE_ERROR, RECESSIVE_ERROR, DOMINANT_ERROR = 1, 3, 4, 5
BABBLE = Frame.of(0, bytes(8))


class Logged(NamedTuple):
    """One frame or error frame as an observer of the bus sees it; `error` is None where the frame was good."""

    start_ps: int
    end_ps: int
    frame: Frame
    source: str
    error: str | None


def _rank(entry):
    """Frames of other nodes go by priority, equal ones in the order in which they were given."""
    return priority(entry[1]), entry[0]


class CanBus:
    """The time line of the bus. `node` is the board's controller."""

    def __init__(self, board, node):
        self.board, self.node = board, node
        self.bit_rate = 500_000
        self.acknowledge = self.connected = True
        self.short = None
        self.babble = None
        self.keep_log = True
        self.log = []
        self.waiting, self.ready = [], []
        self.order = 0
        self.free_at = 0
        self.event = None
        self.flight = None
        self.tick = None
        self.busy_ps = self.frames = 0

    # -- what a test does --------------------------------------------------------------------------------------------

    def send(self, identifier, data=b"", extended=False, remote=False, at_ps=None):
        """Another node sends a frame as soon as it can, not before `at_ps`."""
        self.order += 1
        at = self.board.now if at_ps is None else at_ps
        heapq.heappush(self.waiting, (at, self.order, Frame.of(identifier, data, extended, remote)))
        self.wake()

    def take_log(self):
        """Everything that was on the bus since the last call."""
        log, self.log = self.log, []
        return log

    def configure(self, key, value):
        """A fault begins or ends."""
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
        """Bit time of the other nodes."""
        return PS // self.bit_rate

    @property
    def recessive(self):
        """The level that the board's receiver sees outside of frames."""
        return self.short != "dominant"

    @property
    def shared(self):
        """Other nodes hear the board and answer it."""
        return self.connected and self.acknowledge

    def idle_delay(self, bits):
        """Time until so many recessive bits in a row have been seen, if nothing else is sent; None: never."""
        if not self.recessive:
            return None
        if self.free_at > self.board.now:
            return self.free_at - self.board.now
        return bits * self.node.bit_ps

    def wake(self):
        """Someone has a frame, or a fault has ended: the bus looks for the next frame when it is free."""
        if self.flight is not None:
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
        """The best frame that another node has ready, and who sends it."""
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
        """The frame of another node has got through and leaves its queue."""
        best = min((entry for entry in self.ready if entry[1] == frame), default=None)
        if best is not None:
            self.ready.remove(best)

    def mismatched(self):
        """The board's bit rate does not fit the bus."""
        return abs(self.node.bit_ps * self.bit_rate / PS - 1) > RATE_TOLERANCE

    def _send_own(self, frame):
        if self.short == "recessive":
            bits, error, code = 1 + ERROR_BITS_ALONE, "bit", DOMINANT_ERROR
        elif not self.shared:
            bits, error, code = stuffed_bits(frame) + 2 + ERROR_BITS_ALONE, "acknowledge", ACKNOWLEDGE_ERROR
        elif self.mismatched():
            bits, error, code = MISMATCH_BITS + ERROR_BITS, "bit rate", RECESSIVE_ERROR
        else:
            bits, error, code = frame_bits(frame), None, 0
        self._fly(frame, "board", bits * self.node.bit_ps, error, code)

    def _send_other(self, frame, source):
        heard = self.node.listens()
        if heard and self.mismatched():
            error = "bit rate" if self.node.disturbs() else None
            bits = MISMATCH_BITS + ERROR_BITS if error else frame_bits(frame)
            self._fly(frame, source, bits * self.bit_ps, error, STUFF_ERROR)
        else:
            self._fly(frame, source, frame_bits(frame) * self.bit_ps, None, 0)

    def _fly(self, frame, source, duration, error, code):
        now = self.board.now
        self.flight = (now, frame, source, error, code)
        bit = self.node.bit_ps if source == "board" else self.bit_ps
        self.free_at = now + duration + INTERMISSION_BITS * bit
        self.node.activity(source)
        self.event = self.board.schedule(duration, self._end)

    def _end(self):
        start, frame, source, error, code = self.flight
        self.event = self.flight = None
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
        if self.keep_log:
            self.log.append(Logged(start, self.board.now, frame, source, error))

    def observe_loopback(self, start, frame):
        """A frame in loop-back mode is seen on the transmit line, though the controller ignores the bus."""
        self._note(start, frame, "board", None)

    # -- faults ------------------------------------------------------------------------------------------------------

    def cut(self, why):
        """The board's frame under way ends in the middle: a reset, or a line that fails."""
        if self.flight and self.flight[2] == "board":
            start, frame, _, _, _ = self.flight
            self.event.cancel()
            self.flight = self.event = None
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
        if kind is not None and self.flight:
            self.event.cancel()
            self.flight = self.event = None
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
        """Each further eight dominant bits after an error flag count eight errors (ISO 11898-1 section 12.1.4.2)."""
        self.tick = None
        if self.node.count_dominant(transmitting):
            self.tick = self.board.schedule(8 * self.node.bit_ps, partial(self._dominant, transmitting))

    def power_off(self):
        """The board loses its power: what it was sending breaks off; the other nodes go on without it."""
        self.event = self.flight = self.tick = None

    def power_on(self):
        """Frames that were due meanwhile went past the board."""
        while self.waiting and self.waiting[0][0] < self.board.now:
            heapq.heappop(self.waiting)
        self.free_at = self.board.now
        self.wake()

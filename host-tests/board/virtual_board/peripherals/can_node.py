"""What the CAN controllers have in common: their way to the bus, the error counters and what follows from them (ISO 11898-1 12.1.4).

Settings: those of `CanBus`: `bit_rate`, `data_bit_rate`, `classic`, `acknowledge`, `connected`, `short`, `babble`.
"""

from .can_bus import ACKNOWLEDGE_ERROR, CanBus
from .gpio import connected
from .registers import Registers

FUNCTION = 9


class CanNode(Registers):
    """A controller, whose registers a subclass has."""

    #: Candidates of each pin, the interrupts, and the attributes that hold scheduled calls.
    tx_pins = rx_pins = irqs = calls = ()

    def __init__(self, board):
        super().__init__(board)
        self.bus = CanBus(board, self)
        self.bit_ps = self.data_bit_ps = 1_000_000
        self._forget_calls()
        self._registers()

    def _registers(self):
        # `filtered`: the number of good frames of other nodes that no filter accepted, for tests.
        self.tec = self.rec = self.flags = self.filtered = 0
        self.bus_off, self.sending, self.suspended_until = False, None, 0
        self.levels = [False] * len(self.irqs)

    def _forget_calls(self):
        for name in self.calls:
            setattr(self, name, None)

    def reset(self, cause):
        super().reset(cause)
        for handle in filter(None, (getattr(self, name) for name in self.calls)):
            handle.cancel()
        self._forget_calls()
        self.bus.cut("reset")
        self._registers()
        self.clocks_changed()
        for number in self.irqs:
            self.board.irq(number, False)
        if cause == "por":
            self.bus.power_on()
        else:
            self.bus.wake()

    def power_off(self):
        """Drops the scheduled calls, which are lost with the power."""
        self._forget_calls()
        self.bus.power_off()

    # -- for the bus -------------------------------------------------------------------------------------------------

    def hears(self):
        """Returns whether a receive pin has the controller's function."""
        return connected(self.board, self.rx_pins, FUNCTION)

    def listens(self):
        """Returns whether the controller takes part in the traffic on the bus."""
        return self.on_bus and self.bus.connected and self.hears()

    def disturbs(self):
        """Returns whether the controller destroys frames that it cannot read: it is error-active and not silent."""
        return not self.silent and self.tec <= 127 and self.rec <= 127

    def contender(self, now):
        """Returns the frame with which the controller enters arbitration now, or None."""
        if not self.sends() or now < self.suspended_until or not connected(self.board, self.tx_pins, FUNCTION):
            return None
        self.sending = self._next()
        return None if self.sending is None else self._frame(self.sending)

    def not_before(self, now):
        """Returns the end of the suspended transmission of an error-passive node, if a frame waits for it."""
        return self.suspended_until if self.suspended_until > now and self.sends() and self._next() is not None else None

    def arbitration_lost(self):
        """Handles lost arbitration: another node had an identifier of higher priority."""
        self._attempt_failed(None)

    def transmission_done(self):
        """Handles a frame that another node acknowledged, or that was looped back."""
        self._succeeded()
        self.tec = max(self.tec - 1, 0)
        self._sent(0)

    def transmission_failed(self, code):
        """Handles an error during transmission; an error-passive node does not count a missing acknowledgement."""
        if not (code == ACKNOWLEDGE_ERROR and self.tec > 127):
            self.tec += 8
        self._attempt_failed(code)
        self._sent(code)

    def _sent(self, code):
        """Makes an error-passive node wait eight bits after the intermission before it sends again."""
        self._count_changed(code)
        if self.tec > 127 or self.rec > 127:
            self.suspended_until = self.bus.free_at + 8 * self.bit_ps

    def received(self, frame):
        """Handles a good frame, which the filters accept or not."""
        if self.listens():
            self._accept(frame)

    def _accept(self, frame):
        self.rec = 120 if self.rec > 127 else max(self.rec - 1, 0)
        self._filter(frame)
        self._count_changed(0)

    def reception_failed(self, code):
        """Handles an unreadable frame of another node."""
        if self.listens():
            self.rec = min(self.rec + 1, 255)
            self._count_changed(code)

    def count_dominant(self, transmitting):
        """Counts eight more dominant bits; returns False when they no longer change anything."""
        if not self.on_bus:
            return False
        if transmitting:
            self.tec += 8
        else:
            self.rec = min(self.rec + 8, 255)
        self._count_changed(None)
        return transmitting or self.rec < 255

    # -- errors and interrupts ---------------------------------------------------------------------------------------

    def _count_changed(self, code):
        """Updates bus-off, the last error (None: as it was) and the interrupts after the counters have changed."""
        if self.tec > 255 and not self.bus_off:
            self.bus_off = True
            self.board.record("bus_off")
            self._went_off()
        if code is not None:
            self.lec = code
        self._interrupts()

    def _interrupts(self):
        for index, level in enumerate(self._lines()):
            if level != self.levels[index]:
                self.levels[index] = level
                self.board.irq(self.irqs[index], level)

    def configure(self, key, value):
        if key not in ("bit_rate", "data_bit_rate", "classic", "acknowledge", "connected", "short", "babble"):
            super().configure(key, value)
        self.bus.configure(key, value)

"""Independent watchdog (RM0090 section 21), clocked only by the LSI.

The counter is computed from board time; one event is scheduled for the moment at which it would reach its end. A new prescaler or
reload value takes effect five LSI periods after its write and only while the LSI runs; until then the old value is used.
Assumed where the manual is silent: a new prescaler keeps the counter's value, and the update takes the full five periods.
"""

from .registers import HALF_WORD, Registers

PS = 1_000_000_000_000
OPEN, RELOAD, START = 0x5555, 0xAAAA, 0xCCCC
PVU, RVU = 1, 2
TAKEOVER_PERIODS = 5


class Iwdg(Registers):
    """KR, PR, RLR and SR of section 21.4."""

    name, base, sizes = "IWDG", 0x4000_3000, HALF_WORD
    #: The greatest value of PR that makes a difference.
    PRESCALERS = 6

    def __init__(self, board):
        super().__init__(board)
        self.end = None
        self.takeover = {}
        self._registers()

    def _registers(self):
        self.open, self.running, self.waiting = False, False, False
        self.prescaler, self.reload = 0, 0xFFF
        self.written = {PVU: 0, RVU: 0xFFF}
        self.busy = 0
        self.counter, self.since, self.hz = 0xFFF, 0, 1

    def reset(self, cause):
        super().reset(cause)
        self._cancel()
        self._registers()

    def _cancel(self):
        for handle in (self.end, *self.takeover.values()):
            if handle:
                handle.cancel()
        self.end, self.takeover = None, {}

    def _tick_ps(self):
        """Returns one step of the counter in picoseconds times the LSI's frequency: a divider of 4 to 256 (section 21.4.2)."""
        return PS * (4 << min(self.prescaler, self.PRESCALERS))

    def _count(self):
        """Updates the counter to its value now; `since` keeps the phase within a step."""
        if not self.running or self.waiting:
            return
        steps = (self.board.now - self.since) * self.hz // self._tick_ps()
        self.counter -= steps
        self.since += -(-steps * self._tick_ps() // self.hz)

    def _arm(self):
        if self.end:
            self.end.cancel()
            self.end = None
        if self.running and not self.waiting:
            delay = -(-(self.counter + 1) * self._tick_ps() // self.hz) - (self.board.now - self.since)
            self.end = self.board.schedule(max(delay, 0), self._expired)

    def _expired(self):
        self.end = None
        self.board.record("iwdg_expired")
        self.board.request_reset("iwdg")

    def _start(self):
        if self.running:
            return
        self.running, self.waiting = True, True
        self.counter = 0xFFF
        self.board.rcc.force_lsi()
        if self.board.rcc.lsi_ready:
            self.lsi_ready()

    def lsi_ready(self):
        """Handles the start of the LSI: counting starts, and pending updates begin."""
        self.hz = self.board.rcc.lsi_hz
        if self.waiting:
            self.waiting = False
            self.since = self.board.now
            self._arm()
        for flag in (PVU, RVU):
            if self.busy & flag and flag not in self.takeover:
                self._schedule_takeover(flag)

    def clocks_changed(self):
        """Handles a change of the LSI's frequency; what was counted so far is kept."""
        if self.hz != self.board.rcc.lsi_hz:
            self._count()
            self.hz = self.board.rcc.lsi_hz
            self._arm()

    def _schedule_takeover(self, flag):
        callback = self._take_prescaler if flag == PVU else self._take_reload
        self.takeover[flag] = self.board.schedule(TAKEOVER_PERIODS * PS // self.board.rcc.lsi_hz, callback)

    def _take_prescaler(self):
        self._count()
        self.prescaler = self.written[PVU]
        self.since = self.board.now
        self._taken(PVU)
        self._arm()

    def _take_reload(self):
        self.reload = self.written[RVU]
        self._taken(RVU)

    def _taken(self, flag):
        self.busy &= ~flag
        del self.takeover[flag]

    def load(self, offset):
        current = {0x00: 0, 0x04: self.written[PVU] if self.busy & PVU else self.prescaler,
                   0x08: self.written[RVU] if self.busy & RVU else self.reload, 0x0C: self.busy}
        return current[offset] if offset in current else super().load(offset)

    def store(self, offset, value):
        if offset == 0x00:
            self._key(value & 0xFFFF)
        elif offset == 0x04:
            self._update(PVU, value & (7 if self.PRESCALERS < 8 else 15))
        elif offset == 0x08:
            self._update(RVU, value & 0xFFF)
        else:
            super().store(offset, value)

    def _key(self, key):
        self.open = key == OPEN
        if key == START:
            self._start()
        elif key == RELOAD and self.running:
            self.counter = self.reload
            self.since = self.board.now
            self._arm()

    def _update(self, flag, value):
        if not self.open or self.busy & flag:
            self.board.record("ignored_write", register="IWDG_PR" if flag == PVU else "IWDG_RLR", value=value)
            return
        self.busy |= flag
        self.written[flag] = value
        if self.board.rcc.lsi_ready:
            self._schedule_takeover(flag)

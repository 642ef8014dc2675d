"""General-purpose timers that count up and compare (RM0090 sections 18 and 19); TIM11 captures the crystal.

The counter is computed from board time; an event is scheduled only while DIER enables an interrupt. TIM11 channel 1 captures HSE
divided by RTCPRE (section 19.5.11), which lets software measure it. A prescaler that is written is loaded by UG.
Left out: counting down, one pulse, PWM outputs and the preload of CCR, slave mode, encoder, DMA requests, captures of a pin, and the
interrupts of captures.
"""

from ..violation import Violation
from .registers import HALF_WORD, Registers, cut

PS = 1_000_000_000_000
CEN, URS = 1 << 0, 1 << 2
UIF = 1
CR1, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR, CCR1, OR = 0, 0x0C, 0x10, 0x14, 0x18, 0x1C, 0x20, 0x24, 0x28, 0x2C, 0x34, 0x50


class Timer(Registers):
    """One timer of 16 or 32 bits with up to four channels."""

    sizes, kept, writers = HALF_WORD, {EGR: (0, 0)}, {EGR: "_generate"}
    readers = {CR1: "cr1", DIER: "dier", SR: "sr", CCER: "ccer", PSC: "prescaler_written", ARR: "arr"}

    def __init__(self, board, name, base, interrupt, bus, bits, channels, captures=False):
        super().__init__(board)
        self.name = self.clock = name
        self.base, self.interrupt, self.bus = base, interrupt, bus
        self.mask, self.channels = (1 << bits) - 1, channels
        self.captures = captures
        self.event = None
        self._registers()

    def _registers(self):
        self.cr1 = self.dier = self.sr = self.ccer = self.option = 0
        self.ccmr = [0, 0]
        self.ccr = [0, 0, 0, 0]
        self.prescaler = self.prescaler_written = 0
        self.arr = self.mask
        self.counter, self.since = 0, self.board.now
        self.hz = 0
        self.capture_source, self.captured = (0, 1), 0
        self.irq_level = False

    def reset(self, cause):
        if self.event:
            self.event.cancel()
            self.event = None
        self._registers()
        self.board.irq(self.interrupt, False)

    # -- counting ----------------------------------------------------------------------------------------------------

    def _steps(self, now):
        """Returns the steps of the counter since `since`; a blocked counter (ARR = 0) makes none (section 18.3.1)."""
        if not self.cr1 & CEN or not self.arr or not self.hz:
            return 0
        return (now - self.since) * self.hz // (PS * (self.prescaler + 1))

    def _to_overflow(self):
        return (self.arr if self.counter <= self.arr else self.mask) - self.counter + 1

    def _after(self, steps):
        """Returns the counter's value `steps` after `since`."""
        first = self._to_overflow()
        return self.counter + steps if steps < first else (steps - first) % (self.arr + 1)

    def _sync(self):
        """Updates the flags and the counter with everything that has happened up to now."""
        now = self.board.now
        self._capture(now)
        steps = self._steps(now)
        if not steps:
            return
        self._matches(steps)
        if steps >= self._to_overflow():
            if self.prescaler != self.prescaler_written:
                raise Violation(f"{self.name}: a prescaler that an overflow loads, not UG, is not modelled")
            self.sr |= UIF
        self.counter = self._after(steps)
        self.since += -(-steps * PS * (self.prescaler + 1) // self.hz)

    def _matches(self, steps):
        """Sets the flag of each compare channel whose value the counter passes (section 18.3.7)."""
        for channel in range(self.channels):
            if self._selection(channel):
                continue
            if self._distance(self.ccr[channel]) <= steps:
                self.sr |= 2 << channel

    def _distance(self, value):
        """Returns the steps until the counter next takes a value; more than any count if it never does."""
        first = self._to_overflow()
        if self.counter < value < self.counter + first:
            return value - self.counter
        return first + value if value <= self.arr else 1 << 70

    def _selection(self, channel):
        return self.ccmr[channel >> 1] >> 8 * (channel & 1) & 3

    def _capture(self, now):
        """Stores the time of the last edge of the divided crystal in CCR1, if there were edges since the last call."""
        if not self.captures:
            return
        # TI1_RMP = 10 connects it to channel 1.
        source = self.board.rcc.hse_rtc_hz() if self.option & 3 == 2 else (0, 1)
        if source != self.capture_source:
            self.capture_source = source
            self.captured = self._edges(now)
            return
        if not source[0] or not self.ccer & 1 or self._selection(0) != 1 or not self.cr1 & CEN:
            self.captured = self._edges(now)
            return
        divider = 1 << (self.ccmr[0] >> 2 & 3)
        fresh = (self._edges(now) - self.captured) // divider
        if fresh <= 0:
            return
        self.captured += fresh * divider
        numerator, denominator = source
        edge = -(-self.captured * denominator * PS // numerator)
        self.ccr[0] = self._after(self._steps(max(edge, self.since)))
        if self.sr & 2 or fresh > 1:
            self.sr |= 2 << 8
        self.sr |= 2

    def _edges(self, now):
        numerator, denominator = self.capture_source
        return now * numerator // (denominator * PS)

    def clocks_changed(self):
        """Handles a change of the timer's clock; what was counted at the old one is kept."""
        hz = self.board.rcc.clock_hz(self.bus)
        if hz != self.hz:
            self._sync()
            self.hz = hz
            self.since = self.board.now
            self._arm()

    # -- interrupts --------------------------------------------------------------------------------------------------

    def _interrupt(self):
        level = bool(self.sr & self.dier & 0x1F)
        if level != self.irq_level:
            self.irq_level = level
            self.board.irq(self.interrupt, level)

    def _arm(self):
        """Schedules one event for the next flag that may interrupt."""
        if self.event:
            self.event.cancel()
            self.event = None
        self._interrupt()
        if not self.dier & 0x1F or not self.cr1 & CEN or not self.hz:
            return
        delays = []
        if self.dier & UIF and not self.sr & UIF:
            delays.append(self._delay(self._to_overflow()))
        for channel in range(self.channels):
            flag = 2 << channel
            if not self.dier & flag or self.sr & flag:
                continue
            steps = self._distance(self.ccr[channel])
            if steps < 1 << 69:
                delays.append(self._delay(steps))
        if delays:
            self.event = self.board.schedule(max(min(delays), 0), self._happens)

    def _delay(self, steps):
        return -(-steps * PS * (self.prescaler + 1) // self.hz) - (self.board.now - self.since)

    def _happens(self):
        self.event = None
        self._sync()
        self._arm()

    # -- registers ---------------------------------------------------------------------------------------------------

    def read(self, offset, size):
        if offset != CNT:
            return super().read(offset, size)
        steps = self._steps(self.board.now)
        value = self.counter + steps
        # The wrap and a counter beyond ARR are rare.
        if value > self.arr:
            value = self._after(steps)
        return cut(value, offset, size)

    def load(self, offset):
        self._sync()
        if CCR1 <= offset < CCR1 + 4 * self.channels:
            channel = (offset - CCR1) // 4
            if self._selection(channel):
                self.sr &= ~(2 << channel)
                self._arm()
            return self.ccr[channel]
        if offset in (CCMR1, CCMR2) and (offset - CCMR1) // 2 < self.channels:
            return self.ccmr[(offset - CCMR1) // 4]
        return self.option if offset == OR and self.captures else super().load(offset)

    def store(self, offset, value):
        self._sync()
        if offset == CR1:
            if value & ~(CEN | URS):
                raise Violation(f"{self.name}: CR1 {value:#x} asks for a mode that is not modelled")
            if value & CEN and not self.cr1 & CEN:
                self.hz = self.board.rcc.clock_hz(self.bus)
                self.since = self.board.now
            self.cr1 = value
        elif offset == DIER:
            if value & ~0x1F or value and self.captures:
                raise Violation(f"{self.name}: DMA requests, trigger and captures that interrupt are not modelled")
            self.dier = value
        elif offset == SR:
            self.sr &= value
        elif offset in (CCMR1, CCMR2) and (offset - CCMR1) // 2 < self.channels:
            self._write_ccmr((offset - CCMR1) // 4, value)
        elif offset == CCER:
            self.ccer = value & 0xBBBB
        elif offset == CNT:
            self.counter, self.since = value & self.mask, self.board.now
        elif offset == PSC:
            self.prescaler_written = value & 0xFFFF
        elif offset == ARR:
            self.arr = value & self.mask
        elif CCR1 <= offset < CCR1 + 4 * self.channels:
            self.ccr[(offset - CCR1) // 4] = value & self.mask
        elif offset == OR and self.captures:
            self.option = value & 3
        else:
            super().store(offset, value)
        self._capture(self.board.now)
        self._arm()

    def under(self, offset):
        return {CNT: self.counter, ARR: self.arr, **{CCR1 + 4 * channel: value for channel, value in enumerate(self.ccr)}}.get(offset, 0)

    def _generate(self, value):
        """Handles UG, which restarts counter and prescaler and loads the latter (section 18.4.6)."""
        if value != UIF:
            raise Violation(f"{self.name}: EGR {value:#x} generates events that are not modelled")
        self.counter, self.since = 0, self.board.now
        self.prescaler = self.prescaler_written
        if not self.cr1 & URS:
            self.sr |= UIF

    def _write_ccmr(self, index, value):
        for half in range(2):
            setting = value >> 8 * half & 0xFF
            if not setting & 3 and setting & 8:
                raise Violation(f"{self.name}: the preload of CCR is not modelled")
            if setting & 3 and (not self.captures or index or half or setting & 3 != 1):
                raise Violation(f"{self.name}: captures of a pin are not modelled")
        self.ccmr[index] = value & 0xFFFF


def timers(board):
    """Creates the modelled timers."""
    return [Timer(board, "TIM5", 0x4000_0C00, 50, "TIM_APB1", 32, 4),
            Timer(board, "TIM11", 0x4001_4800, 26, "TIM_APB2", 16, 1, captures=True)]

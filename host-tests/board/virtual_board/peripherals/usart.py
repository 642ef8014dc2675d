"""USARTs in asynchronous mode (RM0090 section 30), each with an external line that has its own baud rate.

The duration of a byte follows from BRR and the peripheral clock. The external device sends and listens at `baud`; if the rates differ
by more than 3.5 % the receiver samples wrong bits and reports a framing error, and the device gets wrong bytes (table 140: receiver
tolerance). A byte reaches a pin only if one of the port pins of the USART has the alternate function (DS8626 table 9).
Frames have eight data bits, no parity and one stop bit, oversampled by 16.
Left out: other frames, interrupts of the transmitter, synchronous, LIN, IrDA, smartcard and half-duplex modes, flow control,
multiprocessor mute, the break character, noise.
Assumed where the manual is silent: a frame that began before RE was set is lost completely.

Settings: `baud` (of the external device). Calls of a test: `inject`, `take_sent`.
"""

from collections import deque
from itertools import takewhile

from ..violation import Violation
from .gpio import connected
from .registers import HALF_WORD, Registers

PS = 1_000_000_000_000
FE, ORE, IDLE, RXNE, TC, TXE = (1 << bit for bit in (1, 3, 4, 5, 6, 7))
ERRORS = FE | ORE | IDLE
CLEARED_BY_ZERO = RXNE | TC
RE, TE, IDLEIE, RXNEIE, UE = (1 << bit for bit in (2, 3, 4, 5, 13))
SR, DR, BRR, CR1, CR2, CR3 = range(0, 0x18, 4)
EIE, DMAR, DMAT = 1 << 0, 1 << 6, 1 << 7
TOLERANCE = 0.035
#: Bytes that arrive within this time, in picoseconds, may be received at once if only DMA notices them.
AT_ONCE = 500_000_000


class Usart(Registers):
    """One USART or UART with its interrupt, bus clock and candidate pins."""

    sizes, kept = HALF_WORD, {CR2: (0, 0)}
    readers = {BRR: "brr", CR1: "cr1", CR3: "cr3"}
    writers = {DR: "_write_dr", CR1: "_write_cr1", CR2: "_write_cr2", CR3: "_write_cr3"}

    def __init__(self, board, name, base, interrupt, bus, function, tx_pins, rx_pins):
        super().__init__(board)
        self.name = self.clock = name
        self.base, self.interrupt, self.bus = base, interrupt, bus
        self.dma = "DMA1" if bus == "PCLK1" else "DMA2"
        self.function, self.tx_pins, self.rx_pins = function, tx_pins, rx_pins
        self.baud = 115_200
        self.sent = []
        self.line = deque()
        self.line_free = 0
        self.arrival = self.departure = self.idle_event = None
        #: Whether several bytes are received at a time.
        self.at_once = False
        #: Whether DMA feeds the bytes of the scheduled departure unnoticed, and whether a test waits for single bytes.
        self.batch = self.watched = False
        #: Whether due bytes are being sent now: DMA then writes the data register.
        self.sending = False
        self.lost = 0
        self.noted = {}
        self.irq_level = False
        self._registers()

    def _registers(self):
        self.sr, self.cr1, self.cr3, self.brr = TC | TXE, 0, 0, 0
        self.rdr, self.tdr, self.shift, self.shift_end = 0, None, None, 0
        self.seen, self.seen_tc = 0, False
        self.preamble_until = 0
        self.listening_since = None
        self.last_end, self.idle_armed = 0, False
        self.bit_ps = self.frame_ps = 0
        self._compare()

    def reset(self, cause):
        self._send_due()
        self.batch = False
        for handle in (self.departure, self.idle_event):
            if handle:
                handle.cancel()
        self.departure = self.idle_event = None
        self._registers()
        self.irq_level = False
        self.board.irq(self.interrupt, False)
        if self.arrival is None and self.line:
            while self.line and self.line[0][0] < self.board.now:
                self.line.popleft()
            self._await()

    def power_off(self):
        """Drops the scheduled events, which are lost with the power; bytes that arrive meanwhile are lost."""
        self._send_due()
        self.shift, self.batch = None, False
        self.arrival = self.departure = self.idle_event = None

    # -- timing ------------------------------------------------------------------------------------------------------

    def clocks_changed(self):
        """Computes bit and frame times from BRR and the bus clock (section 30.3.4)."""
        if self.batch:
            self._send_due()
        hz = self.board.rcc.clock_hz(self.bus)
        self.bit_ps = self.brr * PS // hz if hz else 0
        self.frame_ps = 10 * self.bit_ps
        if self.batch and self.shift is not None:
            self._send()
        self._compare()

    def _compare(self):
        """Computes, from both sides' rates, the time to the middle of a byte's stop bit, and the relative difference of the rates."""
        bit = self.bit_ps or PS // self.baud
        self.sampled_ps = 9 * bit + bit // 2
        #: The relative difference between the USART's bit time and the external device's.
        self.mismatch = self.bit_ps * self.baud / PS - 1

    def _note_mismatch(self, direction, error):
        """Records the first byte at each pair of rates."""
        if self.noted.get(direction) != error:
            self.noted[direction] = error
            self.board.record("baud_mismatch", usart=self.name, direction=direction, error=error)

    # -- transmitter -------------------------------------------------------------------------------------------------

    def _load(self, now):
        """Moves the data register's byte into the shift register, which sets TXE (section 30.3.2)."""
        self.shift, self.tdr = self.tdr, None
        self.sr |= TXE
        self.shift_end = max(now, self.preamble_until) + self.frame_ps

    def _send(self):
        """Schedules the end of the shift register's byte, or of all that DMA feeds unnoticed within `AT_ONCE`."""
        if self.departure:
            self.departure.cancel()
        left = self._fed_silently()
        self.batch = left > 0
        end = self.shift_end + min(left, AT_ONCE // self.frame_ps) * self.frame_ps if left else self.shift_end
        self.departure = self.board.schedule(end - self.board.now, self._departed)

    def _fed_silently(self):
        """Returns the number of bytes that DMA will feed without an interrupt, and without a test that waits for a byte."""
        if self.watched or not self.cr3 & DMAT:
            return 0
        return self.board.peripherals[self.dma].feeds(self.name + "_TX")

    def _departed(self):
        self.departure = None
        self._send_due()
        if self.shift is not None:
            self._send()

    def _send_due(self):
        """Sends the bytes whose stop bits have ended by now."""
        if self.sending:
            return
        self.sending = True
        if self.batch and self.tdr is not None and abs(self.mismatch) <= TOLERANCE:
            self._send_many()
        while self.shift is not None and self.shift_end <= self.board.now:
            self._depart()
        self.sending = False

    def _send_many(self):
        """Sends the due bytes for which DMA still has as many to feed, all at once."""
        count = min((self.board.now - self.shift_end) // self.frame_ps + 1, self._fed_silently())
        if count <= 0:
            return
        line = [self.shift, self.tdr, *self.board.peripherals[self.dma].give(self.name + "_TX", count)]
        if connected(self.board, self.tx_pins, self.function):
            start, frame = self.shift_end, self.frame_ps
            self.sent += [(start + number * frame, value & 0xFF) for number, value in enumerate(line[:count])]
        self.shift, self.tdr = line[count:]
        self.shift_end += count * self.frame_ps

    def _depart(self):
        now, value = self.shift_end, self.shift
        self.shift = None
        mismatch = self.mismatch
        if connected(self.board, self.tx_pins, self.function):
            if abs(mismatch) > TOLERANCE:
                self._note_mismatch("tx", mismatch)
                value = _sampled(value & 0xFF, PS / self.baud, self.bit_ps)
            self.sent.append((now, value & 0xFF))
        if self.tdr is not None:
            self._load(now)
        else:
            self.sr |= TC
        self._interrupt()
        if self.cr3 & DMAT:
            self.serve_dma()

    def take_sent(self):
        """Returns the bytes that left the TX pin since the last call: (end of the stop bit in picoseconds, byte)."""
        self._send_due()
        sent, self.sent = self.sent, []
        return sent

    def watch(self):
        """Sends each byte at its time from now on, because a test waits for one."""
        self.watched = True
        self._check_batch()

    def _check_batch(self):
        """Sends what is due, and one byte at a time from now on if DMA no longer feeds the bytes unnoticed."""
        if self.batch and not self.sending:
            self._send_due()
            if self.shift is not None and not self._fed_silently():
                self._send()

    # -- receiver ----------------------------------------------------------------------------------------------------

    def inject(self, data, at_ps=None):
        """Sends bytes from the external device back to back, not before `at_ps` and after all bytes injected earlier."""
        start = max(self.line_free, self.board.now if at_ps is None else at_ps)
        frame = 10 * PS // self.baud
        for byte in data:
            self.line.append((start, byte))
            start += frame
        self.line_free = start
        if self.arrival is None:
            self._await()

    def _await(self):
        self.at_once = self._only_dma_notices()
        if self.line:
            first = last = self.line[0][0]
            if self.at_once:
                last = max(takewhile(lambda start: start - first < AT_ONCE, (start for start, _ in self.line)))
            self.arrival = self.board.schedule(last + self.sampled_ps - self.board.now, self._arrived)
        else:
            self.arrival = None

    def _only_dma_notices(self):
        """Returns whether bytes go to memory without an interrupt."""
        return bool(self.cr3 & DMAR and not self.cr1 & (RXNEIE | IDLEIE) and abs(self.mismatch) <= TOLERANCE
                    and self.board.peripherals[self.dma].serves(self.name + "_RX"))

    def _arrived(self):
        """Handles the sampling of the middle of a stop bit."""
        self.arrival = None
        self._take_due()
        self._await()
        if self.idle_armed and self.cr1 & IDLEIE:
            self._watch_idle()

    def catch_up(self):
        """Receives what has arrived while only DMA notices, and schedules the next reception again if that has changed."""
        self._check_batch()
        if self.at_once:
            self._take_due()
            if self.arrival and not self._only_dma_notices():
                self.arrival.cancel()
                self._await()

    def _take_due(self):
        """Receives the bytes whose stop bits have been sampled by now."""
        line, until = self.line, self.board.now - self.sampled_ps
        at_once, self.at_once = self.at_once, False
        if at_once and self._only_dma_notices() and not self.sr & (RXNE | ORE) and line and self._listens(line[0][0]):
            data = bytearray()
            while line and line[0][0] <= until:
                start, byte = line.popleft()
                if self.idle_armed:
                    self._detect_idle(start)
                data.append(byte)
                self.last_end, self.idle_armed = start + self.sampled_ps, True
            if data:
                self.board.peripherals[self.dma].take(self.name + "_RX", bytes(data))
                self.rdr = data[-1]
        while line and line[0][0] <= until:
            start, byte = line.popleft()
            if self._listens(start):
                self._receive(start, byte)
            else:
                self.lost += 1
        self.at_once = at_once

    def _listens(self, start):
        """Returns whether a byte that begins at `start` is received."""
        since = self.listening_since
        return since is not None and since <= start and connected(self.board, self.rx_pins, self.function)

    def _receive(self, start, byte):
        if self.idle_armed:
            self._detect_idle(start)
        value, framing = byte, abs(self.mismatch) > TOLERANCE
        if framing:
            self._note_mismatch("rx", self.mismatch)
            value = _sampled(byte, self.bit_ps, PS / self.baud)
            value = value if value != byte else value ^ 0x80
        if self.sr & RXNE:
            self.sr |= ORE
            self.board.record("overrun", usart=self.name, byte=byte)
        else:
            self.rdr = value
            self.sr |= RXNE | FE if framing else RXNE
        self.last_end, self.idle_armed = start + self.sampled_ps, True
        if not self.irq_level:
            self._interrupt()
        if self.cr3 & DMAR:
            self.serve_dma()

    def _detect_idle(self, now):
        """Sets IDLE once after a whole frame of ones since the last byte (section 30.3.3)."""
        if self.idle_armed and now >= self.last_end + self.frame_ps:
            self.idle_armed = False
            self.sr |= IDLE

    def _watch_idle(self):
        end = self.last_end + self.frame_ps
        if self.line and self.line[0][0] < end:
            return
        if self.idle_event:
            self.idle_event.cancel()
        self.idle_event = self.board.schedule(max(end - self.board.now, 0), self._idle)

    def _idle(self):
        self.idle_event = None
        self._detect_idle(self.board.now)
        self._interrupt()

    # -- registers ---------------------------------------------------------------------------------------------------

    def _interrupt(self):
        sr, cr1 = self.sr, self.cr1
        level = bool(sr & cr1 & IDLE or cr1 & RXNEIE and sr & (RXNE | ORE)
                     or self.cr3 & EIE and self.cr3 & DMAR and sr & (FE | ORE))
        if level != self.irq_level:
            self.irq_level = level
            self.board.irq(self.interrupt, level)

    def serve_dma(self):
        """Lets the DMA stream of this USART move bytes as long as RXNE or TXE requests it."""
        if not self.cr3 & (DMAR | DMAT):
            return
        dma = self.board.peripherals[self.dma]
        if self.cr3 & DMAR and self.sr & RXNE:
            dma.request(self.name + "_RX")
        while self.cr3 & DMAT and self.sr & TXE and self.cr1 & TE and dma.request(self.name + "_TX"):
            pass

    def read(self, offset, size):
        if self.at_once or self.batch:
            self.catch_up()
        # Section 30.6 requires half-words or words; the bus bridge converts all reads to words, as it does for DMA.
        return self.load(offset) if offset == DR else super().read(offset, size)

    def load(self, offset):
        if offset == SR:
            if self.idle_armed:
                self._detect_idle(self.board.now)
            self.seen, self.seen_tc = self.sr & ERRORS, True
            return self.sr
        if offset == DR:
            self.sr &= ~(RXNE | self.seen)
            self.seen = 0
            self._interrupt()
            return self.rdr
        return super().load(offset)

    def write(self, offset, value, size):
        if self.at_once or self.batch:
            self.catch_up()
        super().write(offset, value, size)
        if self.at_once or self.batch:
            self.catch_up()

    def store(self, offset, value):
        if offset == SR:
            self.sr &= value | ~CLEARED_BY_ZERO
        elif offset == BRR:
            self.brr = value & 0xFFFF
            self.clocks_changed()
        else:
            super().store(offset, value)
        self._interrupt()

    def _write_dr(self, value):
        if not self.cr1 & UE or not self.cr1 & TE:
            self.board.record("ignored_write", register=self.name + "_DR", value=value)
            return
        if not self.frame_ps:
            raise Violation(f"{self.name}: a byte is sent with BRR = 0")
        if self.seen_tc:
            self.sr &= ~TC
            self.seen_tc = False
        if self.tdr is not None:
            self.board.record("transmit_overwritten", usart=self.name, byte=self.tdr)
        self.tdr = value & 0x1FF
        self.sr &= ~TXE
        if self.shift is None:
            if self.board.now >= self.preamble_until:
                self._load(self.board.now)
                self._send()
            else:
                self.board.schedule(self.preamble_until - self.board.now, self._preamble_over)

    def _preamble_over(self):
        if self.tdr is not None and self.shift is None and self.board.now >= self.preamble_until:
            self._load(self.board.now)
            self._send()
            self._interrupt()

    def _write_cr1(self, value):
        if value & ~(RE | TE | IDLEIE | RXNEIE | UE):
            raise Violation(f"{self.name}: CR1 {value:#x} asks for a mode that is not modelled")
        old, self.cr1 = self.cr1, value
        self.clocks_changed()
        if value & UE and value & TE and not (old & UE and old & TE):
            self.preamble_until = self.board.now + self.frame_ps
        listening = value & UE and value & RE
        if not listening:
            self.listening_since = None
        elif self.listening_since is None:
            self.listening_since = self.board.now
        if self.idle_armed and value & IDLEIE and not old & IDLEIE:
            self._watch_idle()

    def _write_cr2(self, value):
        if value:
            raise Violation(f"{self.name}: CR2 {value:#x} asks for a mode that is not modelled")

    def _write_cr3(self, value):
        if value & ~(EIE | DMAR | DMAT):
            raise Violation(f"{self.name}: CR3 {value:#x} asks for a mode that is not modelled")
        self.cr3 = value
        self.serve_dma()

    def configure(self, key, value):
        if key == "baud":
            self.baud = value
            self._compare()
        else:
            super().configure(key, value)


def _sampled(byte, sampler_bit_ps, sender_bit_ps):
    """Returns the byte of a receiver that samples the middle of its own bits."""
    levels, value = [0, *(byte >> bit & 1 for bit in range(8)), 1], 0
    for bit in range(8):
        index = int((bit + 1.5) * sampler_bit_ps / sender_bit_ps)
        value |= (levels[index] if index < len(levels) else 1) << bit
    return value


def usarts(board):
    """Creates the USARTs and UARTs of the STM32F405 that a board uses, with their candidate pins."""
    table = (("USART1", 0x4001_1000, 37, "PCLK2", 7, (("A", 9), ("B", 6)), (("A", 10), ("B", 7))),
             ("USART2", 0x4000_4400, 38, "PCLK1", 7, (("A", 2), ("D", 5)), (("A", 3), ("D", 6))),
             ("USART3", 0x4000_4800, 39, "PCLK1", 7, (("B", 10), ("C", 10), ("D", 8)), (("B", 11), ("C", 11), ("D", 9))),
             ("UART4", 0x4000_4C00, 52, "PCLK1", 8, (("A", 0), ("C", 10)), (("A", 1), ("C", 11))),
             ("USART6", 0x4001_1400, 71, "PCLK2", 8, (("C", 6), ("G", 14)), (("C", 7), ("G", 9))))
    return [Usart(board, *row) for row in table]

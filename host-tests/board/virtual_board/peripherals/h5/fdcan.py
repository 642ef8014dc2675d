"""FDCAN1 of the STM32H563, a Bosch M_CAN with a fixed message RAM: modes, filters, FIFOs, errors, interrupts.

The bus behind it is `can_bus.CanBus`. Witnesses: the header (registers, bits), the SVD (reset values), the HAL (layout of the
message RAM, order of accesses), Bosch's M_CAN user's manual as remembered (what CCE resets, 129 sequences after bus-off, PSR set
by a read). Left out: tx events, high-priority messages, timeout, transmitter delay, loop-back and restricted modes, sending CAN FD.
Assumed: INIT can be read back at once; a FIFO skips requests that were cancelled.

Settings: those of `CanBus`.
"""

from ...violation import Violation
from ..can_bus import ACKNOWLEDGE_ERROR, CanBus
from ..can_frame import LENGTHS, Frame, priority
from ..gpio import connected
from ..registers import Registers, unmodelled

PS = 1_000_000_000_000
INIT, CCE, CSA, CSR, MON, DAR, TEST, FDOE = (1 << bit for bit in (0, 1, 3, 4, 5, 6, 7, 8))
CCCR_PROTECTED, ABSENT = 0xF3E4, 1 << 2 | TEST
(CREL, ENDN, DBTP, TEST_REGISTER, RWD, CCCR, NBTP, TSCC, TSCV, TOCC, TOCV, ECR, PSR, TDCR) = (
    0x00, 0x04, 0x0C, 0x10, 0x14, 0x18, 0x1C, 0x20, 0x24, 0x28, 0x2C, 0x40, 0x44, 0x48)
IR, IE, ILS, ILE, RXGFC, XIDAM, HPMS, RXF0S, RXF0A, RXF1S, RXF1A, TXBC = (
    0x50, 0x54, 0x58, 0x5C, 0x80, 0x84, 0x88, 0x90, 0x94, 0x98, 0x9C, 0xC0)
TXFQS, TXBRP, TXBAR, TXBCR, TXBTO, TXBCF, TXBTIE, TXBCIE, TXEFS, TXEFA, CKDIV = (
    0xC4, 0xC8, 0xCC, 0xD0, 0xD4, 0xD8, 0xDC, 0xE0, 0xE4, 0xE8, 0x100)
#: Registers that keep their words, with reset values; the first group is written only with INIT and CCE.
PROTECTED = {DBTP: 0x0A33, NBTP: 0x0600_0A03, TSCC: 0, TOCC: 0xFFFF_0000, TDCR: 0, RXGFC: 0, XIDAM: 0x1FFF_FFFF, TXBC: 0,
             RWD: 0, CKDIV: 0}
KEPT = {IE: 0, ILS: 0, ILE: 0, TXBTIE: 0, TXBCIE: 0}
FIXED = {CREL: 0x3214_1218, ENDN: 0x8765_4321, HPMS: 0, TXEFS: 0, TOCV: 0xFFFF, TEST_REGISTER: 0}
RFN, RFF, RFL, TC, TCF, TSW, EP, EW, BO, PEA = (1 << bit for bit in (0, 1, 2, 7, 8, 13, 17, 18, 19, 21))
#: The flags of each group that ILS assigns to an interrupt line.
GROUPS = (0x7, 0x38, 0x1C0, 0x1E00, 0xE000, 0x3_0000, 0xFC_0000)
LINES = (39, 40)
#: Message RAM, bytes from its start: filters, receive FIFOs, transmit buffers; an element of a FIFO has 18 words.
EXTENDED_FILTERS, FIFOS, BUFFERS, ELEMENT, RAM_SIZE = 0x70, (0xB0, 0x188), 0x278, 72, 0x350
PLACES = 3
FULL_QUEUE, FIFO_FULL, OVERWRITE = 1 << 21, 1 << 24, 1 << 9
RX_PINS, TX_PINS, FUNCTION = (("D", 0), ("A", 11), ("B", 8)), (("D", 1), ("A", 12), ("B", 9)), 9
SEQUENCE_BITS, RECOVERY_SEQUENCES = 11, 129
NO_CHANGE = 7


class Fdcan(Registers):
    """FDCAN1 with its registers, and CKDIV of the configuration block behind it."""

    name, base, clock = "FDCAN1", 0x4000_A400, "FDCAN"
    kept = {**{offset: (value, 0xFFFF_FFFF) for offset, value in {**PROTECTED, **KEPT}.items()},
            **{offset: (value, 0) for offset, value in {**FIXED, TXBAR: 0, RXF0A: 0, RXF1A: 0}.items()}}
    readers = {CCCR: "cccr", IR: "flags", TXBRP: "pending", TXBCR: "cancelled", TXBTO: "sent", TXBCF: "finished"}
    writers = {CCCR: "_write_cccr", TXBAR: "_request", TXBCR: "_write_cancel"}

    def __init__(self, board):
        super().__init__(board)
        self.bus = CanBus(board, self)
        self.ram = bytearray(RAM_SIZE)
        self.join_event = None
        self.bit_ps = self.data_bit_ps = 1_000_000
        self.filtered = 0
        self._registers()

    def _registers(self):
        self.cccr = INIT
        self.flags, self.lec = 0, NO_CHANGE
        self.tec = self.rec = 0
        self.bus_off, self.on_bus = False, False
        self.suspended_until = self.started = 0
        self.status = 0
        self.levels = [False, False]
        self._clear()

    def _clear(self):
        """Resets what CCE resets: requests and FIFOs."""
        self.cancelled = self.sent = self.finished = self.put = 0
        #: The requested buffers, the oldest first.
        self.queue = []
        self.sending = None
        self.fill, self.first = [0, 0], [0, 0]

    def reset(self, cause):
        if self.join_event:
            self.join_event.cancel()
        self.join_event = None
        self.bus.cut("reset")
        super().reset(cause)
        self._registers()
        for line in LINES:
            self.board.irq(line, False)
        if cause == "por":
            self.bus.power_on()
        else:
            self.bus.wake()

    def power_off(self):
        """Drops the scheduled events, which are lost with the power."""
        self.join_event = None
        self.bus.power_off()

    # -- modes -------------------------------------------------------------------------------------------------------

    @property
    def takes_fd(self):
        """Returns whether CAN FD frames are received."""
        return bool(self.cccr & FDOE)

    def clocks_changed(self):
        """Computes both bit times from the kernel clock."""
        hz = self.board.rcc.clock_hz("FDCAN")
        if hz:
            nominal, data = self.values[NBTP], self.values[DBTP]
            clocks = (nominal >> 16 & 0x1FF) + 1, (data >> 16 & 0x1F) + 1
            quanta = 3 + (nominal >> 8 & 0xFF) + (nominal & 0x7F), 3 + (data >> 8 & 0x1F) + (data >> 4 & 15)
            divider = 2 * self.values[CKDIV] or 1
            self.bit_ps, self.data_bit_ps = (divider * c * q * PS // hz for c, q in zip(clocks, quanta))

    def _check_sample_points(self):
        """Checks that bits are sampled at 80 %, as the other nodes on this bus do."""
        nominal, data = self.values[NBTP], self.values[DBTP]
        times = [("nominal", nominal >> 8 & 0xFF, nominal & 0x7F)]
        times += [("data", data >> 8 & 0x1F, data >> 4 & 15)] if self.takes_fd else []
        for name, first, second in times:
            point = 100 * (2 + first) / (3 + first + second)
            if not 75 <= point <= 85:
                raise Violation(f"{self.name}: the sample point of {name} bits is at {point:.0f} %, that of the bus at 80 %")

    def _join(self):
        """Takes part in the bus after 11 recessive bits, or after 129 times as many if it was off."""
        self.join_event = None
        delay = self.bus.idle_delay(SEQUENCE_BITS)
        if self.cccr & INIT or delay is None or not self._listens_at_pin():
            return
        if self.bus_off:
            delay = RECOVERY_SEQUENCES * SEQUENCE_BITS * self.bit_ps
        self.join_event = self.board.schedule(max(delay, 1), self._joined)

    def _joined(self):
        self.join_event = None
        if self.cccr & INIT or not self.bus.recessive:
            return
        if self.bus_off:
            self.bus_off = False
            self.tec = self.rec = self.status = 0
            self.flags |= BO
            self.board.record("bus_off_ended")
        self.on_bus = True
        self._interrupts()
        self.bus.wake()

    def _write_cccr(self, value):
        old = self.cccr
        if value & ABSENT:
            raise Violation(f"{self.name}: CCCR {value:#x} asks for a mode that is not modelled")
        may = old & INIT and old & CCE
        if (value ^ old) & CCCR_PROTECTED and not may:
            self.board.record("ignored_write", register="FDCAN_CCCR", value=value)
            value = value & ~CCCR_PROTECTED | old & CCCR_PROTECTED
        self.cccr = value & ~(CSA | CCE)
        if value & CSR:
            self.cccr |= CSA | INIT
        if self.cccr & INIT:
            self.on_bus = False
            if value & CCE and old & INIT:
                self.cccr |= CCE
                if not old & CCE:
                    self._clear()
        elif not self.on_bus and self.join_event is None:
            self.started = self.board.now
            self.clocks_changed()
            self._check_sample_points()
            self._join()

    def bus_recovered(self):
        """Joins a bus that is recessive again."""
        if not self.on_bus and self.join_event is None:
            self._join()

    def _listens_at_pin(self):
        return connected(self.board, RX_PINS, FUNCTION)

    def listens(self):
        """Returns whether the controller takes part in the traffic on the bus."""
        return self.on_bus and self.bus.connected and self._listens_at_pin()

    def disturbs(self):
        """Returns whether the controller destroys frames that it cannot read."""
        return not self.cccr & MON and self.tec <= 127 and self.rec <= 127

    # -- transmission ------------------------------------------------------------------------------------------------

    def _next(self):
        """Returns the buffer that is sent next: the oldest of the FIFO, or the most urgent of the queue."""
        if self.values[TXBC] >> 24 & 1:
            return min(self.queue, key=lambda index: (priority(self._frame(index)), index), default=None)
        return self.queue[0] if self.queue else None

    def _words(self, offset, count):
        return [int.from_bytes(self.ram[at : at + 4], "little") for at in range(offset, offset + 4 * count, 4)]

    def _frame(self, index):
        offset = BUFFERS + ELEMENT * index
        identifier, control = self._words(offset, 2)
        if control & 1 << 23 or control & 1 << 21:
            raise Violation(f"{self.name}: a transmit buffer asks for an event or for CAN FD, which is not modelled")
        extended, remote = bool(identifier >> 30 & 1), bool(identifier >> 29 & 1)
        length = min(control >> 16 & 15, 8)
        data = b"" if remote else bytes(self.ram[offset + 8 : offset + 8 + length])
        return Frame(identifier & 0x1FFF_FFFF if extended else identifier >> 18 & 0x7FF, data, extended, remote, length)

    def contender(self, now):
        """Returns the frame with which the controller enters arbitration now, or None."""
        if not self.on_bus or self.cccr & MON or now < self.suspended_until or not connected(self.board, TX_PINS, FUNCTION):
            return None
        self.sending = self._next()
        return None if self.sending is None else self._frame(self.sending)

    def not_before(self, now):
        """Returns the end of the suspended transmission of an error-passive node, if a frame waits for it."""
        return self.suspended_until if self.suspended_until > now and self.on_bus and self.queue else None

    def arbitration_lost(self):
        """Handles lost arbitration."""
        self._attempt_failed()

    def transmission_done(self):
        """Handles a frame that another node acknowledged."""
        bit = 1 << self.sending
        self.sent |= bit
        self._end(bit)
        if self.values[TXBTIE] & bit:
            self.flags |= TC
        self.tec = max(self.tec - 1, 0)
        self._errors(0)

    def transmission_failed(self, code):
        """Handles an error; an error-passive node does not count a missing acknowledgement (ISO 11898-1 12.1.4.2)."""
        if not (code == ACKNOWLEDGE_ERROR and self.tec > 127):
            self.tec += 8
        self._attempt_failed()
        self._errors(code)

    def _attempt_failed(self):
        index, self.sending = self.sending, None
        if index is not None and (self.cancelled >> index & 1 or self.cccr & DAR):
            self._cancel(1 << index)

    def _cancel(self, bits):
        self.finished |= bits
        self._end(bits)
        if self.values[TXBCIE] & bits:
            self.flags |= TCF

    def _end(self, bits):
        """Ends requests."""
        if self.sending is not None and bits >> self.sending & 1:
            self.sending = None
        self.finished |= bits & self.cancelled
        self.cancelled &= ~bits
        self.queue = [index for index in self.queue if not bits >> index & 1]

    @property
    def pending(self):
        """Returns TXBRP."""
        return sum(1 << index for index in self.queue)

    def _request(self, value):
        fresh = value & 7 & ~self.pending
        self.sent &= ~fresh
        self.finished &= ~fresh
        for _ in range(PLACES):
            index = self._put()
            if not fresh >> index & 1:
                break
            fresh &= ~(1 << index)
            self.queue.append(index)
            self.put = (index + 1) % PLACES
        if fresh:
            raise Violation(f"{self.name}: buffers {fresh:#b} are requested out of their order")
        self.bus.wake()

    def _put(self):
        """Returns the buffer for the next request: the next of the FIFO, or the first free one of the queue."""
        if not self.values[TXBC] >> 24 & 1:
            return self.put
        return next((index for index in range(PLACES) if index not in self.queue), 0)

    def _write_cancel(self, value):
        bits = value & self.pending
        self.cancelled |= bits
        in_flight = 1 << self.sending if self.sending is not None and self.bus.in_progress else 0
        if bits & ~in_flight:
            self._cancel(bits & ~in_flight)

    # -- reception ---------------------------------------------------------------------------------------------------

    def received(self, frame):
        """Handles a good frame: the filters assign it to a FIFO, or reject it."""
        if not self.listens():
            return
        self.rec = 120 if self.rec > 127 else max(self.rec - 1, 0)
        target, index = self._match(frame)
        if target is None:
            self.filtered += 1
        else:
            self._store(target, frame, index)
        self._errors(0)

    def _match(self, frame):
        """Returns the FIFO of a frame and the number of its filter; FIFO None rejects it."""
        config = self.values[RXGFC]
        if frame.remote and config >> (0 if frame.extended else 1) & 1:
            return None, 0
        for number in range(config >> (24 if frame.extended else 16) & 0x1F):
            if frame.extended:
                first, second = self._words(EXTENDED_FILTERS + 8 * number, 2)
                kind, action, a, b = second >> 30, first >> 29, first & 0x1FFF_FFFF, second & 0x1FFF_FFFF
                identifier = frame.identifier & (self.values[XIDAM] if kind == 0 else 0x1FFF_FFFF)
            else:
                word, = self._words(4 * number, 1)
                kind, action, a, b = word >> 30, word >> 27 & 7, word >> 16 & 0x7FF, word & 0x7FF
                identifier = frame.identifier
            ranged = kind == 0 or kind == 3 and frame.extended
            hit = (a <= identifier <= b) if ranged else identifier in (a, b) if kind == 1 else kind == 2 and not (identifier ^ a) & b
            if action and hit:
                if action > 3:
                    raise Violation(f"{self.name}: high-priority messages are not modelled")
                return (0, 1, None)[action - 1], number
        rest = config >> (2 if frame.extended else 4) & 3
        return (rest if rest < 2 else None), 1 << 7

    def _store(self, fifo, frame, index):
        shift = 3 * fifo
        if self.fill[fifo] == PLACES:
            if not self.values[RXGFC] >> 9 - fifo & 1:
                self.flags |= RFL << shift
                self.board.record("can_overrun", fifo=fifo)
                return
            self.first[fifo] = (self.first[fifo] + 1) % PLACES
            self.fill[fifo] -= 1
        place = (self.first[fifo] + self.fill[fifo]) % PLACES
        identifier = frame.identifier if frame.extended else frame.identifier << 18
        head = identifier | frame.remote << 29 | frame.extended << 30
        control = self._stamp() | frame.length << 16 | frame.fast << 20 | frame.fd << 21 | index << 24
        data = frame.data.ljust(-(-len(frame.data) // 4) * 4, b"\0")
        element = head.to_bytes(4, "little") + control.to_bytes(4, "little") + data
        offset = FIFOS[fifo] + ELEMENT * place
        self.ram[offset : offset + len(element)] = element
        assert len(frame.data) == (0 if frame.remote else LENGTHS[frame.length])
        self.fill[fifo] += 1
        self.flags |= (RFN | (RFF if self.fill[fifo] == PLACES else 0)) << shift

    def reception_failed(self, code):
        """Handles an unreadable frame of another node."""
        if self.listens():
            self.rec = min(self.rec + 1, 255)
            self._errors(code)

    def count_dominant(self, transmitting):
        """Counts eight more dominant bits; returns False when they no longer change anything."""
        if self.bus_off or not self.on_bus:
            return False
        if transmitting:
            self.tec += 8
        else:
            self.rec = min(self.rec + 8, 255)
        self._errors(None)
        return transmitting or self.rec < 255

    # -- errors and interrupts ---------------------------------------------------------------------------------------

    def _errors(self, code):
        """Updates the states of error confinement and their flags after the counters have changed."""
        if self.tec > 255 and not self.bus_off:
            self.bus_off, self.on_bus = True, False
            self.cccr |= INIT
            self.flags |= BO
            self.board.record("bus_off")
        if self.tec > 127 or self.rec > 127:
            self.suspended_until = self.bus.free_at + 8 * self.bit_ps
        worst = max(self.tec, self.rec)
        status = (EW if worst >= 96 else 0) | (EP if worst > 127 else 0)
        self.flags |= status ^ self.status
        self.status = status
        if code is not None:
            self.lec = code
        if code:
            self.flags |= PEA
        self._interrupts()

    def _interrupts(self):
        active = self.flags & self.values[IE]
        second = sum(flags for group, flags in enumerate(GROUPS) if self.values[ILS] >> group & 1)
        for line, flags in enumerate((active & ~second, active & second)):
            level = bool(flags and self.values[ILE] >> line & 1)
            if level != self.levels[line]:
                self.levels[line] = level
                self.board.irq(LINES[line], level)

    # -- registers ---------------------------------------------------------------------------------------------------

    def _stamp(self):
        """Returns the time stamp counter, which counts bit times."""
        config = self.values[TSCC]
        if config & 3 != 1:
            return 0
        return (self.board.now - self.started) // (self.bit_ps * ((config >> 16 & 15) + 1)) & 0xFFFF

    def _psr(self):
        activity = 0 if not self.on_bus else 1
        if self.on_bus and self.bus.in_progress:
            activity = 3 if self.bus.in_progress[2] == "board" else 2
        value = self.lec | activity << 3 | bool(self.status & EP) << 5 | bool(self.status & EW) << 6 | self.bus_off << 7
        self.lec = NO_CHANGE
        return value | NO_CHANGE << 8

    def _txfqs(self):
        put, is_queue = self._put(), self.values[TXBC] >> 24 & 1
        get = self.queue[0] if self.queue and not is_queue else 0 if is_queue else put
        if put in self.queue:
            return FULL_QUEUE | get << 8 | put << 16
        free = 0 if is_queue else (get - put) % PLACES or PLACES
        return free | get << 8 | put << 16

    def _fifo_status(self, fifo):
        fill, first = self.fill[fifo], self.first[fifo]
        lost = bool(self.flags & RFL << 3 * fifo)
        return fill | first << 8 | (first + fill) % PLACES << 16 | (FIFO_FULL if fill == PLACES else 0) | lost << 25

    def load(self, offset):
        if offset == ECR:
            return min(self.tec, 255) | (self.rec & 0x7F) << 8 | (self.rec > 127) << 15
        if offset in (RXF0S, RXF1S):
            return self._fifo_status(offset == RXF1S)
        special = {PSR: self._psr, TXFQS: self._txfqs, TSCV: self._stamp}.get(offset)
        return special() if special else super().load(offset)

    def store(self, offset, value):
        if offset in PROTECTED and self.cccr & (INIT | CCE) != INIT | CCE:
            self.board.record("ignored_write", register=f"FDCAN {offset:#x}", value=value)
        elif offset == IR:
            self.flags &= ~value
        elif offset in (RXF0A, RXF1A):
            fifo = int(offset == RXF1A)
            released = ((value & 3) - self.first[fifo]) % PLACES + 1
            if released <= self.fill[fifo]:
                self.first[fifo] = (self.first[fifo] + released) % PLACES
                self.fill[fifo] -= released
        elif offset == TSCV:
            self.started = self.board.now
        elif offset in FIXED and (offset != TEST_REGISTER or value):
            raise unmodelled(self, offset, "write")
        else:
            super().store(offset, value)
        if offset in PROTECTED:
            self.clocks_changed()
        self._interrupts()

    def configure(self, key, value):
        if key not in ("bit_rate", "data_bit_rate", "acknowledge", "connected", "short", "babble", "keep_log"):
            super().configure(key, value)
        self.bus.configure(key, value)


class MessageRam(Registers):
    """FDCAN1's part of the message RAM, which is accessed by words."""

    name, base, clock = "SRAMCAN", 0x4000_AC00, "FDCAN"

    def __init__(self, board, can):
        super().__init__(board)
        self.can = can

    def load(self, offset):
        if offset >= RAM_SIZE:
            raise unmodelled(self, offset, "read")
        return self.can._words(offset, 1)[0]

    def store(self, offset, value):
        if offset >= RAM_SIZE:
            raise unmodelled(self, offset, "write")
        self.can.ram[offset : offset + 4] = value.to_bytes(4, "little")

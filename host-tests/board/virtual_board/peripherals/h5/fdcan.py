"""FDCAN1 of the STM32H563, a Bosch M_CAN with a fixed message RAM: modes, filters, FIFOs, errors, interrupts.

The bus behind it is `can_bus.CanBus`. Witnesses: the header (registers, bits), the SVD (reset values), the HAL (layout of the
message RAM, order of accesses), Bosch's M_CAN user's manual as remembered (what CCE resets, 129 sequences after bus-off, PSR set
by a read). Left out: tx events, high-priority messages, timeout, transmitter delay, loop-back and restricted modes, PSR's error of the
data phase, the transmit queue, FIFO 1, FIFOs that overwrite, and filters but masks.
Assumed: INIT can be read back at once; a FIFO skips requests that were cancelled.
"""

from ...violation import Violation
from ..can_frame import LENGTHS, Frame
from ..can_node import CanNode
from ..registers import Registers, unmodelled

PS = 1_000_000_000_000
INIT, CCE, CSA, CSR, MON, DAR, TEST, FDOE, BRSE = (1 << bit for bit in (0, 1, 3, 4, 5, 6, 7, 8, 9))
CCCR_PROTECTED, ABSENT = 0xF3E4, 1 << 2 | TEST
(CREL, ENDN, DBTP, TEST_REGISTER, RWD, CCCR, NBTP, TSCC, TSCV, TOCC, TOCV, ECR, PSR, TDCR) = (
    0x00, 0x04, 0x0C, 0x10, 0x14, 0x18, 0x1C, 0x20, 0x24, 0x28, 0x2C, 0x40, 0x44, 0x48)
IR, IE, ILS, ILE, RXGFC, XIDAM, HPMS, RXF0S, RXF0A, RXF1S, TXBC = (
    0x50, 0x54, 0x58, 0x5C, 0x80, 0x84, 0x88, 0x90, 0x94, 0x98, 0xC0)
TXFQS, TXBRP, TXBAR, TXBCR, TXBTO, TXBCF, TXBTIE, TXBCIE, TXEFS, TXEFA, CKDIV = (
    0xC4, 0xC8, 0xCC, 0xD0, 0xD4, 0xD8, 0xDC, 0xE0, 0xE4, 0xE8, 0x100)
#: Registers that keep their words, with reset values; the first group is written only with INIT and CCE.
PROTECTED = {DBTP: 0x0A33, NBTP: 0x0600_0A03, TSCC: 0, TOCC: 0xFFFF_0000, TDCR: 0, RXGFC: 0, XIDAM: 0x1FFF_FFFF, TXBC: 0,
             RWD: 0, CKDIV: 0}
KEPT = {IE: 0, ILS: 0, ILE: 0, TXBTIE: 0, TXBCIE: 0}
FIXED = {CREL: 0x3214_1218, ENDN: 0x8765_4321, HPMS: 0, RXF1S: 0, TXEFS: 0, TOCV: 0xFFFF, TEST_REGISTER: 0}
RFN, RFF, RFL, TC, TCF, TSW, EP, EW, BO, PEA = (1 << bit for bit in (0, 1, 2, 7, 8, 13, 17, 18, 19, 21))
#: The flags of each group that ILS assigns to an interrupt line.
GROUPS = (0x7, 0x38, 0x1C0, 0x1E00, 0xE000, 0x3_0000, 0xFC_0000)
#: Message RAM, bytes from its start: filters, receive FIFOs, transmit buffers; an element of a FIFO has 18 words.
EXTENDED_FILTERS, FIFO, BUFFERS, ELEMENT, RAM_SIZE = 0x70, 0xB0, 0x278, 72, 0x350
PLACES = 3
FULL_QUEUE, FIFO_FULL, OVERWRITE, QUEUE = 1 << 21, 1 << 24, 3 << 8, 1 << 24
SEQUENCE_BITS, RECOVERY_SEQUENCES = 11, 129
NO_CHANGE = 7


class Fdcan(CanNode):
    """FDCAN1 with its registers, and CKDIV of the configuration block behind it."""

    name, base, clock = "FDCAN1", 0x4000_A400, "FDCAN"
    rx_pins, tx_pins = (("D", 0), ("A", 11), ("B", 8)), (("D", 1), ("A", 12), ("B", 9))
    irqs, calls = (39, 40), ("join_event",)
    kept = {**{offset: (value, 0xFFFF_FFFF) for offset, value in {**PROTECTED, **KEPT}.items()},
            **{offset: (value, 0) for offset, value in {**FIXED, TXBAR: 0, RXF0A: 0}.items()}}
    readers = {CCCR: "cccr", IR: "flags", TXBRP: "pending", TXBCR: "cancelled", TXBTO: "sent", TXBCF: "finished"}
    writers = {CCCR: "_write_cccr", TXBAR: "_request", TXBCR: "_write_cancel"}

    def __init__(self, board):
        self.ram = bytearray(RAM_SIZE)
        super().__init__(board)

    def _registers(self):
        super()._registers()
        self.cccr, self.lec, self.status = INIT, NO_CHANGE, 0
        self.on_bus, self.started = False, 0
        self._clear()

    def _clear(self):
        """Resets what CCE resets: requests and FIFOs."""
        self.cancelled = self.sent = self.finished = self.put = 0
        #: The requested buffers, the oldest first.
        self.queue = []
        self.sending = None
        self.fill = self.first = 0

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
        if self.cccr & INIT or delay is None or not self.hears():
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

    @property
    def silent(self):
        """Returns whether the controller only listens."""
        return bool(self.cccr & MON)

    def sends(self):
        """Returns whether the controller may send."""
        return self.on_bus and not self.silent

    # -- transmission ------------------------------------------------------------------------------------------------

    def _next(self):
        return self.queue[0] if self.queue else None

    def _words(self, offset, count):
        return [int.from_bytes(self.ram[at : at + 4], "little") for at in range(offset, offset + 4 * count, 4)]

    def _frame(self, index):
        offset = BUFFERS + ELEMENT * index
        identifier, control = self._words(offset, 2)
        if control & 1 << 23:
            raise Violation(f"{self.name}: a transmit buffer asks for an event, which is not modelled")
        # FDF and BRS count where CCCR allows them; a CAN FD frame is never remote.
        fd = bool(control & 1 << 21) and self.takes_fd
        fast = fd and bool(control & 1 << 20) and bool(self.cccr & BRSE)
        extended, remote = bool(identifier >> 30 & 1), bool(identifier >> 29 & 1) and not fd
        length = control >> 16 & 15
        size = LENGTHS[length] if fd else min(length, 8)
        data = b"" if remote else bytes(self.ram[offset + 8 : offset + 8 + size])
        identifier = identifier & 0x1FFF_FFFF if extended else identifier >> 18 & 0x7FF
        return Frame(identifier, data, extended, remote, length if fd else size, fd, fast)

    def _succeeded(self):
        bit = 1 << self.sending
        self.sent |= bit
        self._end(bit)
        if self.values[TXBTIE] & bit:
            self.flags |= TC

    def _attempt_failed(self, _):
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
            index = self.put
            if not fresh >> index & 1:
                break
            fresh &= ~(1 << index)
            self.queue.append(index)
            self.put = (index + 1) % PLACES
        if fresh:
            raise Violation(f"{self.name}: buffers {fresh:#b} are requested out of their order")
        self.bus.wake()

    def _write_cancel(self, value):
        bits = value & self.pending
        self.cancelled |= bits
        in_flight = 1 << self.sending if self.sending is not None and self.bus.in_progress else 0
        if bits & ~in_flight:
            self._cancel(bits & ~in_flight)

    # -- reception ---------------------------------------------------------------------------------------------------

    def _filter(self, frame):
        number = self._match(frame)
        if number is None:
            self.filtered += 1
        else:
            self._store(frame, number)

    def _match(self, frame):
        """Returns the number of the filter that puts a frame into FIFO 0, 128 without one; None if the frame is rejected."""
        config = self.values[RXGFC]
        if frame.remote and config >> (0 if frame.extended else 1) & 1:
            return None
        for number in range(config >> (24 if frame.extended else 16) & 0x1F):
            if frame.extended:
                first, second = self._words(EXTENDED_FILTERS + 8 * number, 2)
                kind, action, a, b = second >> 30, first >> 29, first & 0x1FFF_FFFF, second & 0x1FFF_FFFF
            else:
                word, = self._words(4 * number, 1)
                kind, action, a, b = word >> 30, word >> 27 & 7, word >> 16 & 0x7FF, word & 0x7FF
            if action and (kind != 2 or action not in (1, 3)):
                raise Violation(f"{self.name}: of filters only masks for FIFO 0 and masks that reject are modelled")
            if action and not (frame.identifier ^ a) & b:
                return number if action == 1 else None
        rest = config >> (2 if frame.extended else 4) & 3
        if rest == 1:
            raise Violation(f"{self.name}: FIFO 1 is not modelled")
        return None if rest else 1 << 7

    def _store(self, frame, index):
        if self.values[RXGFC] & OVERWRITE:
            raise Violation(f"{self.name}: a FIFO that overwrites is not modelled")
        if self.fill == PLACES:
            self.flags |= RFL
            self.board.record("can_overrun", fifo=0)
            return
        place = (self.first + self.fill) % PLACES
        identifier = frame.identifier if frame.extended else frame.identifier << 18
        head = identifier | frame.remote << 29 | frame.extended << 30
        control = self._stamp() | frame.length << 16 | frame.fast << 20 | frame.fd << 21 | index << 24
        data = frame.data.ljust(-(-len(frame.data) // 4) * 4, b"\0")
        element = head.to_bytes(4, "little") + control.to_bytes(4, "little") + data
        offset = FIFO + ELEMENT * place
        self.ram[offset : offset + len(element)] = element
        assert len(frame.data) == (0 if frame.remote else LENGTHS[frame.length])
        self.fill += 1
        self.flags |= RFN | (RFF if self.fill == PLACES else 0)

    # -- errors and interrupts ---------------------------------------------------------------------------------------

    def _went_off(self):
        self.on_bus = False
        self.cccr |= INIT
        self.flags |= BO

    def _count_changed(self, code):
        worst = max(self.tec, self.rec)
        status = (EW if worst >= 96 else 0) | (EP if worst > 127 else 0)
        self.flags |= status ^ self.status | (PEA if code else 0)
        self.status = status
        super()._count_changed(code)

    def _lines(self):
        active = self.flags & self.values[IE]
        second = sum(flags for group, flags in enumerate(GROUPS) if self.values[ILS] >> group & 1)
        return [bool(flags and self.values[ILE] >> line & 1) for line, flags in enumerate((active & ~second, active & second))]

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
        get = self.queue[0] if self.queue else self.put
        if self.put in self.queue:
            return FULL_QUEUE | get << 8 | self.put << 16
        free = (get - self.put) % PLACES or PLACES
        return free | get << 8 | self.put << 16

    def _fifo_status(self):
        full = FIFO_FULL if self.fill == PLACES else 0
        return self.fill | self.first << 8 | (self.first + self.fill) % PLACES << 16 | full | bool(self.flags & RFL) << 25

    def load(self, offset):
        if offset == ECR:
            return min(self.tec, 255) | (self.rec & 0x7F) << 8 | (self.rec > 127) << 15
        special = {PSR: self._psr, TXFQS: self._txfqs, TSCV: self._stamp, RXF0S: self._fifo_status}.get(offset)
        return special() if special else super().load(offset)

    def store(self, offset, value):
        if offset in PROTECTED and self.cccr & (INIT | CCE) != INIT | CCE:
            self.board.record("ignored_write", register=f"FDCAN {offset:#x}", value=value)
        elif offset == IR:
            self.flags &= ~value
        elif offset == RXF0A:
            released = ((value & 3) - self.first) % PLACES + 1
            if released <= self.fill:
                self.first = (self.first + released) % PLACES
                self.fill -= released
        elif offset == TSCV:
            self.started = self.board.now
        elif offset in FIXED and (offset != TEST_REGISTER or value) or offset == TXBC and value & QUEUE:
            raise unmodelled(self, offset, "write")
        else:
            super().store(offset, value)
        if offset in PROTECTED:
            self.clocks_changed()
        self._interrupts()


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

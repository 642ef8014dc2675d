"""bxCAN, controller CAN1 (RM0090 section 32): modes, mailboxes, FIFOs, error management, interrupts.

The bus behind it is `can_bus.CanBus`, reached as `bus`; the filters are `can_filters.Filters`.
Left out: all of MCR but INRQ, SLEEP and TXFP, which must be set on the bus (time-triggered mode, bus-off that ends by itself, waking by
the bus, single attempts, a locked FIFO), FIFO 1, interrupts but those of mailboxes, of FIFO 0 and of errors, the debug freeze, CAN2.
Assumed where the manual is silent: a receive pin without its alternate function reads dominant, so the controller does not synchronise;
mailboxes keep their requests in initialisation and in bus-off; MSR.RX shows the level between frames; entering initialisation or Sleep
outside of a frame takes one bit; each failed attempt sets ALST and TERR; only software clears FULL.
"""

from ..violation import Violation
from .can_filters import Filters, identifier_word
from .can_frame import frame_bits
from .can_mailboxes import ALST, TERR, TXOK, Mailboxes
from .can_node import CanNode
from .registers import unmodelled

PS = 1_000_000_000_000
INRQ, SLEEP, TXFP, DBF = 1 << 0, 1 << 1, 1 << 2, 1 << 16
INAK, SLAK, ERRI, TXM, RXM, SAMP, RX = (1 << bit for bit in (0, 1, 2, 8, 9, 10, 11))
TMEIE, FMPIE0, BOFIE, ERRIE = 1 << 0, 1 << 1, 1 << 10, 1 << 15
EWGF, EPVF, BOFF = 1, 2, 4
SILM, LBKM = 1 << 31, 1 << 30
FULL, FOVR, RFOM = 1 << 3, 1 << 4, 1 << 5
MCR_RESET, BTR_RESET = 0x0001_0002, 0x0123_0000
RECOVERY_SEQUENCES, SEQUENCE_BITS = 128, 11


class BxCan(CanNode):
    """CAN1 with its registers of section 32.9."""

    name, base, clock = "CAN1", 0x4000_6400, "CAN1"
    tx_pins, rx_pins = (("A", 12), ("B", 9), ("D", 1)), (("A", 11), ("B", 8), ("D", 0), ("I", 9))
    #: Of mailboxes, FIFO 0 and errors.
    irqs, calls = (19, 20, 22), ("mode_event", "recovery", "loop_event")
    readers = {0x00: "mcr", 0x14: "ier", 0x1C: "btr"}
    writers = {0x00: "_write_mcr", 0x14: "_write_ier", 0x1C: "_write_btr"}
    #: It reads no CAN FD frame.
    takes_fd = False

    def _registers(self):
        super()._registers()
        self.mcr, self.btr, self.ier, self.lec = MCR_RESET, BTR_RESET, 0, 0
        self.state, self.wanted = "sleep", None
        self.mailboxes, self.filters = Mailboxes(), Filters()
        self.fifo, self.fifo_flags, self.output = [], 0, (0, 0, 0, 0)
        self.recovering, self.recovery_left, self.recovery_seen = False, 0, (0, 0, 0)

    # -- modes (section 32.4) ----------------------------------------------------------------------------------------

    def _bit_time(self):
        """Returns the bit time from BTR and PCLK1 (section 32.7.7)."""
        quanta = 3 + (self.btr >> 16 & 15) + (self.btr >> 20 & 7)
        return ((self.btr & 0x3FF) + 1) * quanta * PS // self.board.rcc.clock_hz("PCLK1")

    def clocks_changed(self):
        """Updates the bit time after a change of the bus clock."""
        self.bit_ps = self._bit_time()

    def _request_mode(self):
        """Starts the transition to the mode that MCR requests, by the state diagram of figure 336."""
        if self.mcr & SLEEP and (self.state == "sleep" or not self.mcr & INRQ):
            wanted = "sleep"
        elif self.mcr & INRQ:
            wanted = "init"
        else:
            wanted = "normal"
        wanted = None if wanted == self.state else wanted
        if self.mode_event:
            if wanted == self.wanted:
                # A transition in progress continues.
                return
            self.mode_event.cancel()
            self.mode_event = None
        self.wanted = wanted
        if self.wanted == "normal":
            self._synchronise()
        elif self.wanted:
            delay = self.bit_ps
            if self.bus.in_progress and self.state == "normal" and self.listens():
                delay = max(self.bus.free_at - self.board.now, delay)
            self.mode_event = self.board.schedule(delay, self._acknowledge_mode)

    def _synchronise(self):
        """Enters Normal mode after eleven recessive bits (section 32.4.2)."""
        self.bit_ps = self._bit_time()
        if self.btr & LBKM:
            delay = SEQUENCE_BITS * self.bit_ps
        elif not self.hears():
            return
        else:
            delay = self.bus.idle_delay(SEQUENCE_BITS)
        if delay is not None:
            self.mode_event = self.board.schedule(delay, self._acknowledge_mode)

    def _acknowledge_mode(self):
        self.mode_event = None
        wanted, self.wanted = self.wanted, None
        if wanted == "normal" and not self.btr & LBKM and not self.bus.recessive:
            self.wanted = "normal"
            return
        self.state = wanted
        if wanted == "normal":
            if not self.mcr & TXFP:
                raise Violation("CAN1: mailboxes that go by identifier (TXFP = 0) are not modelled")
            if self.bus_off:
                self._recover()
            self._wake_transmitter()

    def bus_recovered(self):
        """Handles the return of the bus to recessive: a start that waited for it continues."""
        if self.wanted == "normal" and self.mode_event is None:
            self._synchronise()
        if self.recovering and self.recovery is None and self.state == "normal":
            self._await_recovery()

    # -- transmission (section 32.7.1) -------------------------------------------------------------------------------

    def _ready(self):
        return self.state == "normal" and self.wanted is None and not self.bus_off

    def _next(self):
        return self.mailboxes.next()

    def _frame(self, box):
        return box.frame()

    def sends(self):
        """Returns whether the controller may send on the bus now."""
        return self._ready() and not self.btr & (SILM | LBKM)

    @property
    def silent(self):
        """Returns whether the controller only listens."""
        return bool(self.btr & SILM)

    @property
    def on_bus(self):
        """Returns whether the controller takes part in the traffic of the bus, if its pins do."""
        return self.state == "normal" and not self.bus_off and not self.btr & LBKM

    def _wake_transmitter(self):
        if not self._ready() or self._next() is None:
            return
        if self.btr & LBKM:
            if self.loop_event is None:
                box = self.sending = self._next()
                frame = box.frame()
                self.loop_event = self.board.schedule(frame_bits(frame) * self.bit_ps, self._looped)
        elif not self.btr & SILM:
            self.bus.wake()

    def _looped(self):
        """Ends a loop-back: the sender receives its own frame, and a missing acknowledgement does not matter (section 32.5.2)."""
        self.loop_event = None
        frame = self.sending.frame()
        self.transmission_done()
        self._accept(frame)
        self._wake_transmitter()

    def _succeeded(self):
        box, self.sending = self.sending, None
        box.end(TXOK)

    def _attempt_failed(self, code):
        flag = TERR if code else ALST
        box, self.sending = self.sending, None
        if box is None:
            return
        box.status = flag
        if box.abort:
            box.end(flag)
            self._interrupts()

    # -- reception (sections 32.7.3 and 32.7.4) ----------------------------------------------------------------------

    def _filter(self, frame):
        word = identifier_word(frame)
        number = self.filters.match(word)
        if number is None:
            self.filtered += 1
        else:
            data = int.from_bytes(frame.data, "little")
            self._store((word, frame.length | number << 8, data & 0xFFFF_FFFF, data >> 32))

    def _store(self, entry):
        if len(self.fifo) < 3:
            self.fifo.append(entry)
            if len(self.fifo) == 3:
                self.fifo_flags |= FULL
            return
        self.fifo_flags |= FOVR
        self.board.record("can_overrun")
        self.fifo[2] = entry

    # -- errors (section 32.7.6) -------------------------------------------------------------------------------------

    def _status(self):
        """Returns EWGF, EPVF and BOFF from the counters."""
        worst = max(self.tec, self.rec)
        return (EWGF if worst >= 96 else 0) | (EPVF if worst > 127 else 0) | (BOFF if self.bus_off else 0)

    def _went_off(self):
        if self.ier & BOFIE:
            self.flags |= ERRI

    def _recover(self):
        """Starts the recovery from bus-off: 128 x 11 recessive bits, after software left initialisation (section 32.7.6)."""
        if self.recovery is None:
            self.recovering = True
            self.recovery_left = RECOVERY_SEQUENCES
            if self.bus.recessive:
                self._await_recovery()

    def _await_recovery(self):
        self.recovery_seen = (self.board.now, self.bus.busy_ps, self.bus.frames)
        delay = max(round(self.recovery_left * SEQUENCE_BITS * self.bit_ps), 1)
        self.recovery = self.board.schedule(delay, self._check_recovery)

    def _check_recovery(self):
        """Counts the sequences so far: one every eleven bits on a free bus, and one at the end of each frame."""
        self.recovery = None
        if self.state != "normal" or not self.bus.recessive:
            return
        at, busy, frames = self.recovery_seen
        free = self.board.now - at - (self.bus.busy_ps - busy)
        self.recovery_left -= max(free, 0) / (SEQUENCE_BITS * self.bit_ps) + self.bus.frames - frames
        if self.recovery_left > 0.5:
            self._await_recovery()
            return
        self.bus_off = self.recovering = False
        self.tec = self.rec = 0
        self.board.record("bus_off_ended")
        self._wake_transmitter()

    # -- interrupts (section 32.8) -----------------------------------------------------------------------------------

    def _lines(self):
        ier = self.ier
        return bool(ier & TMEIE and self.mailboxes.completed()), bool(ier & FMPIE0 and self.fifo), bool(self.flags & ERRI and ier & ERRIE)

    # -- registers (section 32.9) ------------------------------------------------------------------------------------

    def load(self, offset):
        if offset == 0x08:
            return self.mailboxes.tsr()
        if offset == 0x0C:
            return len(self.fifo) | self.fifo_flags
        if offset == 0x04:
            return self._msr()
        if 0x180 <= offset < 0x1B0:
            box = self.mailboxes.boxes[(offset - 0x180) // 16]
            return (box.tir | box.pending, box.tdtr, box.tdlr, box.tdhr)[offset // 4 & 3]
        if 0x1B0 <= offset < 0x1C0:
            if self.fifo:
                self.output = self.fifo[0]
            return self.output[offset // 4 & 3]
        if offset == 0x18:
            return self._status() | self.lec << 4 | min(self.tec, 255) << 16 | self.rec << 24
        value = self.filters.read(offset)
        return super().load(offset) if value is None else value

    def _msr(self):
        if self.wanted == "normal" and self.mode_event is None:
            self._synchronise()
        value = self.flags | {"sleep": SLAK, "init": INAK, "normal": 0}[self.state]
        if self.bus.recessive:
            value |= SAMP | RX
        if self.bus.in_progress and self.state == "normal":
            value |= TXM if self.bus.in_progress[2] == "board" else RXM
        return value

    def store(self, offset, value):
        if 0x180 <= offset < 0x1B0:
            self._write_mailbox(self.mailboxes.boxes[(offset - 0x180) // 16], offset // 4 & 3, value)
        elif offset == 0x0C:
            self.fifo_flags &= ~(value & (FULL | FOVR))
            if value & RFOM and self.fifo:
                self.output = self.fifo.pop(0)
        elif offset == 0x08:
            self.mailboxes.write_tsr(value, self.sending if self.bus.in_progress or self.loop_event else None)
        elif offset == 0x04:
            self.flags &= ~(value & ERRI)
        else:
            taken = self.filters.write(offset, value)
            if taken is None:
                super().store(offset, value)
            elif not taken:
                self.board.record("ignored_write", register=f"CAN1 filter {offset:#x}", value=value)
        self._interrupts()

    def _write_ier(self, value):
        if value & ~(TMEIE | FMPIE0 | BOFIE | ERRIE):
            raise unmodelled(self, 0x14, f"write of {value:#x}")
        self.ier = value

    def _write_mcr(self, value):
        if value & ~(INRQ | SLEEP | TXFP | DBF):
            raise unmodelled(self, 0, f"write of {value:#x}")
        self.mcr = value
        self._request_mode()

    def _write_btr(self, value):
        if self.state != "init":
            self.board.record("ignored_write", register="CAN_BTR", value=value)
            return
        if value & LBKM and not value & SILM:
            raise Violation("CAN1: loop-back that is not silent is not modelled")
        self.btr = value & 0xC37F_03FF
        self.bit_ps = self._bit_time()

    def _write_mailbox(self, box, register, value):
        if box.pending:
            self.board.record("ignored_write", register="CAN1 transmit mailbox", value=value)
            return
        if register == 0:
            box.tir = value & ~1
            if value & 1:
                self.mailboxes.request(box)
                self._wake_transmitter()
        elif register == 1:
            if value & 0x100:
                raise Violation("CAN1: TGT (time stamps in data) is not modelled")
            box.tdtr = value & 15
        elif register == 2:
            box.tdlr = value
        else:
            box.tdhr = value

"""Exception entry and return (DDI0403 B1.5.6 to B1.5.8) and faults (B1.5.14, B1.5.15).

An entry stores the frame at once, with the FPU's registers if CONTROL.FPCA is set; the chip stores those lazily. A program sees
the difference only in the timing and in FPCCR.LSPACT. Tail-chaining is a return followed by an entry before any instruction
runs.
"""

import struct

from .nvic import HARD_FAULT, NMI, SVCALL
from .registers import Batch
from .violation import Violation

# Bits of CFSR.
IACCVIOL, MSTKERR = 1 << 0, 1 << 4
IBUSERR, PRECISERR, UNSTKERR, STKERR, BFARVALID = 1 << 8, 1 << 9, 1 << 11, 1 << 12, 1 << 15
UNDEFINSTR, INVSTATE, INVPC, NOCP = 1 << 16, 1 << 17, 1 << 18, 1 << 19
# Bits of HFSR.
VECTTBL, FORCED, DEBUGEVT = 1 << 1, 1 << 30, 1 << 31
# Bits of CONTROL. SFPA belongs to ARMv8-M. Unicorn treats its M4 as an ARMv8-M in the secure state, and gives a program whose
# CONTROL has FPCA without SFPA a new FPSCR with its next FPU instruction: both are set and cleared together.
SPSEL, FPCA, SFPA = 2, 4, 8

#: Unicorn's numbers for the exceptions that a program raises.
UC_SVC, UC_BKPT, UC_EXCEPTION_RETURN, UC_NOCP, UC_INVSTATE = 2, 7, 8, 17, 18
#: PRIMASK, BASEPRI and FAULTMASK when they block nothing.
UNMASKED = (0, 0, 0)
FRAME = struct.Struct("<8I")
#: Core clocks from the last instruction to the first of the handler, and back (DDI0439 section 3.9.1, no wait states).
ENTRY_CLOCKS, RETURN_CLOCKS = 12, 10


class Exceptions:
    """Moves the processor into and out of handlers."""

    def __init__(self, board):
        self.board = board
        processor = board.processor
        #: The lowest value of LR that returns from a handler, and all of them.
        self.base = board.chip.exc_return
        self.returns = {self.base + more for more in (0, 0x8, 0xC, 0x10, 0x18, 0x1C)}
        self.frame = Batch(processor.handle, "r0 r1 r2 r3 r12 lr pc xpsr sp control primask basepri faultmask")
        self.enter_batch = Batch(processor.handle, "sp control all_xpsr apsr_nzcv lr pc")
        self.at_return = Batch(processor.handle, "pc control faultmask msp psp")
        # The exception number is written first: in Thread mode CONTROL.SPSEL can be written, and then `sp` is the right one.
        self.leave = Batch(processor.handle, "all_xpsr control r0 r1 r2 r3 r12 lr sp apsr_nzcv pc")
        #: In the order and with the padding of the frame.
        self.fpu = Batch(processor.handle, " ".join(f"d{n}" for n in range(8)) + " fpscr")
        #: The exception number in IPSR.
        self.current = 0
        #: The time that entry and return take: picoseconds, and the equivalent number of instructions.
        self.entry = self.leaving = (0, 0)

    def reset(self) -> None:
        """Clears the handler that was running."""
        self.current = 0

    def dispatch(self) -> bool:
        """Enters the exception that is due now. Returns whether there was one."""
        nvic = self.board.nvic
        number = nvic.preempting()
        if number is None:
            return False
        registers = self.frame.read()
        masks = registers[-3:]
        if masks != UNMASKED and nvic.priority[number] >= nvic.execution_priority(*masks):
            return False
        self.enter(number, registers)
        return True

    def execution_priority(self) -> int:
        """Returns the current execution priority."""
        primask, basepri, faultmask, _ = self.board.processor.masks.read()
        return self.board.nvic.execution_priority(primask, basepri, faultmask)

    def enter(self, number: int, registers: tuple[int, ...] | None = None) -> None:
        """Stores the frame and begins the handler. `registers`: the values of `frame`, if they have been read."""
        board = self.board
        r0, r1, r2, r3, r12, lr, pc, xpsr, sp, control, *_ = registers or self.frame.read()
        extended = control & FPCA
        length = 104 if extended else 32
        frame = sp - length & ~7 & 0xFFFF_FFFF
        saved_xpsr = xpsr & ~(1 << 9) | (sp >> 2 & 1) << 9
        data = FRAME.pack(r0, r1, r2, r3, r12, lr, pc, saved_xpsr)
        if extended:
            data += self.fpu.read_bytes()
        in_thread = self.current == 0
        excret = self.base | (0 if extended else 0x10) | (0x8 if in_thread else 0)
        if in_thread and control & SPSEL:
            excret |= 4
        if not board.memory.write_stack(frame, data):
            number = self._stacking_error(number, frame)
        self._begin(number, frame, xpsr, control, excret)

    def _stacking_error(self, number: int, frame: int) -> int:
        """Returns the exception that is entered when the frame of `number` cannot be stored (B1.5.7, B1.5.15).

        The frame is lost, the stack pointer moves anyway, and `number` stays pending after the fault. HardFault and NMI are
        still entered.
        """
        nvic, scb = self.board.nvic, self.board.scb
        self.board.record("fault", what="the exception frame cannot be stored", sp=frame)
        scb.cfsr |= STKERR
        if number in (NMI, HARD_FAULT):
            return number
        nvic.pending |= 1 << number
        scb.hfsr |= FORCED
        return HARD_FAULT

    def _begin(self, number: int, frame: int, xpsr: int, control: int, excret: int) -> None:
        board = self.board
        target = board.memory.word(board.scb.vtor + 4 * number)
        if target is None:
            board.scb.hfsr |= VECTTBL
            if number in (HARD_FAULT, NMI):
                board.lock_up("the vector of a fault cannot be read")
                return
            board.nvic.pending |= 1 << number
            number = HARD_FAULT
            target = board.memory.word(board.scb.vtor + 4 * number)
            if target is None:
                board.lock_up("the vector of HardFault cannot be read")
                return
        nvic, bit = board.nvic, 1 << number
        nvic.active |= bit
        nvic.pending &= ~bit
        self.current = number
        board.paths.enter()
        entered = xpsr & 0xF80F_0000 | (target & 1) << 24 | number
        self.enter_batch.write(frame, control & ~(SPSEL | FPCA | SFPA), entered, entered & 0xF000_0000, excret, target)
        board.processor.start_at = target & ~1
        board.spend(self.entry)
        board.sleeping = False

    def processor_event(self, number: int) -> None:
        """Handles what unicorn reports while it runs: SVC, BKPT, a return from an exception, a missing coprocessor."""
        if number == UC_EXCEPTION_RETURN:
            self._return()
            nvic = self.board.nvic
            while nvic.pending & nvic.enabled and self.dispatch():
                pass
        elif number == UC_SVC:
            self.raise_synchronous(SVCALL)
        elif number == UC_BKPT:
            # Without a debugger a breakpoint is a HardFault (C1.3).
            self.board.scb.hfsr |= DEBUGEVT
            self._hard_fault("a breakpoint without a debugger")
        elif number == UC_NOCP:
            self.fault(NOCP, "an instruction for a coprocessor that is absent or off")
        elif number == UC_INVSTATE:
            self.fault(INVSTATE, "an instruction with EPSR.T = 0")
        else:
            raise Violation(f"unicorn raised event {number}")

    def _return(self) -> None:
        board = self.board
        nvic = board.nvic
        excret, control, faultmask, msp, psp = self.at_return.read()
        excret |= self.base & 1
        known = excret in self.returns
        to_thread = bool(excret & 8)
        leaving = self.current
        bit = 1 << leaving
        nvic.active = others = nvic.active & ~bit
        if nvic.lines & bit:
            # The line is still high: pending again.
            nvic.pending |= bit
        if faultmask and leaving != NMI:
            board.processor.set("faultmask", 0)
        if not known or (to_thread and others) or (not to_thread and not others):
            self._return_fault(excret, f"EXC_RETURN 0x{excret:08X} does not fit the active exceptions")
            return
        frame = psp if excret & 4 else msp
        extended = not excret & 0x10
        length = 104 if extended else 32
        data = board.memory.read(frame, length)
        if data is None:
            self._return_fault(excret, "the frame cannot be read", UNSTKERR)
            return
        r0, r1, r2, r3, r12, lr, pc, xpsr = FRAME.unpack_from(data)
        number = xpsr & 0x1FF
        if (number == 0) != to_thread:
            self._return_fault(excret, "the stored xPSR does not fit EXC_RETURN")
            return
        if extended:
            self.fpu.write_bytes(data[32:])
        sp = frame + length | (xpsr >> 9 & 1) << 2
        control = control & 1 | (SPSEL if excret & 4 else 0) | (FPCA | SFPA if extended else 0)
        self.current = number
        board.paths.leave(leaving)
        xpsr &= 0xFF0F_FDFF
        target = pc & ~1 | xpsr >> 24 & 1
        self.leave.write(xpsr, control, r0, r1, r2, r3, r12, lr, sp, xpsr & 0xF000_0000, target)
        board.spend(self.leaving)

    def _return_fault(self, excret: int, why: str, bit: int = INVPC) -> None:
        """Takes a fault of the return itself: the frame stays on the stack, and the handler's LR holds EXC_RETURN."""
        board = self.board
        board.processor.set("lr", excret)
        self.current = 0 if excret & 8 else self.current
        board.record("fault", what=why)
        if self._escalates(bit, why):
            xpsr, sp, control = self.frame.read()[7:10]
            self._begin(HARD_FAULT, sp, xpsr, control, excret)

    def raise_synchronous(self, number: int) -> None:
        """Takes an exception that an instruction requests; one that may not preempt becomes a HardFault."""
        nvic = self.board.nvic
        if nvic.priority[number] < self.execution_priority():
            self.enter(number)
        else:
            self._hard_fault("an SVC that its priority does not allow")

    def bus_fault(self, bit: int, address: int | None, why: str) -> None:
        """Takes a BusFault; `address` is stored in BFAR."""
        if address is not None:
            self.board.scb.bfar = address
            bit |= BFARVALID
        self.fault(bit, why)

    def fault(self, bit: int, why: str) -> None:
        """Takes a fault: all become a HardFault."""
        pc, = self.board.processor.pc.read()
        self.board.record("fault", what=why, pc=pc, symbol=self.board.symbol_at(pc))
        if self._escalates(bit, why):
            self.enter(HARD_FAULT)

    def _escalates(self, bit: int, why: str) -> bool:
        """Sets the status bits of a fault without a handler of its own. False: the core has locked up, instead of a HardFault."""
        self.board.scb.cfsr |= bit
        if self.execution_priority() <= -1:
            self.board.lock_up(why)
            return False
        self.board.scb.hfsr |= FORCED
        return True

    def _hard_fault(self, why: str) -> None:
        pc, = self.board.processor.pc.read()
        self.board.record("fault", what=why, pc=pc, symbol=self.board.symbol_at(pc))
        if self.execution_priority() <= -1:
            self.board.lock_up(why)
        else:
            self.enter(HARD_FAULT)

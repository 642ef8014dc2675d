"""The board: memories, core, peripherals and time.

Time is an integer number of picoseconds since power-on. It advances with executed instructions, with exceptions, and in jumps
while the core does nothing: asleep, stalled by the flash, locked up, or without power. An instruction is assumed to take
`CLOCKS_PER_INSTRUCTION` core clocks, a simplification: the model has neither wait states nor a pipeline.
"""

from unicorn.unicorn_const import UC_MEM_FETCH as FETCH
from unicorn.unicorn_const import UC_MEM_WRITE as WRITE

from .bus import Bus
from .chips import STM32F405
from .dwt import CoreDebug, Dwt
from .events import EventQueue, Handle
from .exceptions import (
    ENTRY_CLOCKS, IACCVIOL, IBUSERR, INVSTATE, NOCP, PRECISERR, RETURN_CLOCKS, UNDEFINSTR, Exceptions,
)  # fmt: skip
from .memory import Memory
from .nvic import NMI, Nvic
from .paths import Paths
from .processor import COUNT, FAULT, SLEEP, STATE, UNDEFINED, Processor
from .scb import Scb
from .systick import SysTick
from .violation import Violation

#: Core clocks per instruction. A Cortex-M4 needs 1 for most, 2 for loads, 2 to 4 for taken branches.
CLOCKS_PER_INSTRUCTION = 1.3
#: Instructions of the shortest slice while an interrupt waits for PRIMASK or BASEPRI.
MASKED_SLICE = 32
#: Longest slice, so that other work of this process can run.
LONGEST_SLICE = 1 << 22
#: A bit of SCR.
SLEEPDEEP = 4


class Board:
    """A virtual microcontroller with its environment."""

    def __init__(self, elf=None, create=lambda board: [], seed: int = 1, chip=STM32F405):
        self.elf, self.chip = elf, chip
        self.memory = Memory(seed, chip)
        self.events = EventQueue()
        self.log: list[dict] = []
        self.bus = Bus(self)
        self._now = 0
        self._base = 0
        #: Whether instructions are running now.
        self.in_slice = False
        self._reset_cause: str | None = None
        #: Whether the current slice must end: the power failed, or a reset or a violation occurred.
        self.halted = True
        self.violation: Violation | None = None
        self.powered = False
        self.sleeping = False
        self.locked_up = False
        self.stalled_until = 0
        self.instructions = 0
        self.slept = 0
        self.slices = 0
        self._masked = 0
        #: Called with every record, and with `None` after every scheduled call; a true result ends the run.
        self.watcher = None
        self._stop = False
        self.processor = Processor(self)
        self.nvic, self.scb, self.systick = Nvic(self), Scb(self), SysTick(self)
        self.dwt, self.debug = Dwt(self), CoreDebug(self)
        self.exceptions = Exceptions(self)
        self.paths = Paths(self)
        for device in (self.systick, self.nvic, self.scb, self.debug, self.dwt):
            self.bus.attach_private(device)
        self.bus.private[0xE000EF00 >> 2] = self.nvic
        self.peripherals: dict = {}
        self.rcc = self.flash = None
        for peripheral in create(self):
            self.peripherals[peripheral.name] = peripheral
            self.bus.attach(peripheral)
        self.rcc = self.peripherals.get("RCC")
        self.flash = self.peripherals.get("FLASH")
        for address, data in elf.segments if elf else ():
            self.memory.write(address, data)

    # Time and events.

    @property
    def now(self) -> int:
        """Returns the board time in picoseconds; within a slice, that of the current instruction."""
        if self.in_slice:
            return self._now + max(self.processor.executed.value - 1 - self._base, 0) * self._instruction_ps
        return self._now

    def schedule(self, delay_ps: int, callback) -> Handle:
        """Calls back after a delay."""
        now = self.now
        handle = self.events.schedule(now + max(delay_ps, 0), callback)
        if self.in_slice:
            self.processor.shorten(-(-max(delay_ps, 0) // self._instruction_ps))
        return handle

    def spend(self, cost: tuple[int, int]) -> None:
        """Lets time pass without an instruction: picoseconds, and the number of instructions that would have run."""
        self._now += cost[0]
        if self.in_slice:
            limit = self.processor.limit
            end = limit.value - cost[1]
            limit.value = max(end, self.processor.executed.value)

    def clocks_changed(self) -> None:
        """Counts with the new clocks from now on. RCC calls this after a change."""
        if self.in_slice:
            now = self.now
            self._now, self._base = now, self.processor.executed.value - 1
            self.processor.end_slice()
        self.systick.hold()
        self.systick.plan()
        self.dwt.hold()
        #: The duration of an instruction in picoseconds.
        self._instruction_ps = round(CLOCKS_PER_INSTRUCTION * 1e12 / self.rcc.core_hz)
        self.exceptions.entry, self.exceptions.leaving = map(self._cost, (ENTRY_CLOCKS, RETURN_CLOCKS))

    def _cost(self, clocks: int) -> tuple[int, int]:
        return clocks * 10**12 // self.rcc.core_hz, int(clocks / CLOCKS_PER_INSTRUCTION)

    def record(self, kind: str, **fields) -> None:
        """Adds an entry to the event log."""
        entry = {"time_us": self.now / 1e6, "kind": kind, **fields}
        self.log.append(entry)
        if self.watcher and self.watcher(entry):
            self.stop()

    def stop(self) -> None:
        """Ends the run after the current instruction."""
        self._stop = True
        self.processor.end_slice()

    # Interface for the peripherals.

    def irq(self, number: int, level: bool) -> None:
        """Drives an interrupt line."""
        self.nvic.set_line(number, level)

    def nmi(self) -> None:
        """Makes the NMI pending."""
        self.nvic.pend(NMI)

    def interrupt_raised(self) -> None:
        """Ends the slice if an exception is due. One that the running handler blocks is checked when the handler returns."""
        if self.in_slice and self.nvic.preempting() is not None:
            self.processor.end_slice()

    def request_reset(self, cause: str) -> None:
        """Resets the chip before the next instruction."""
        self._reset_cause = self._reset_cause or cause
        self.halted = True
        self.processor.end_slice()

    def stall(self, until_ps: int) -> None:
        """Stalls the core until a board time."""
        self.stalled_until = max(self.stalled_until, until_ps)
        self.processor.end_slice()

    def memory_read(self, address: int, length: int) -> bytes:
        """Reads memory without side effects."""
        data = self.memory.read(address, length)
        if data is None:
            raise ValueError(f"no memory at 0x{address:08X}, {length} bytes")
        return data

    def memory_write(self, address: int, data: bytes) -> None:
        """Writes memory, flash included, without side effects."""
        if not self.memory.write(address, bytes(data)):
            raise ValueError(f"no memory at 0x{address:08X}, {len(data)} bytes")

    def symbol_at(self, address: int) -> str | None:
        """Names the function that holds an address."""
        return self.elf.symbol_at(address & ~1) if self.elf else None

    # Interface for the core.

    def violate(self, violation: Violation) -> None:
        """Stops the run with a violation, with time and place added."""
        if self.violation is None:
            violation.pc = self.processor.get("pc")
            violation.symbol = self.symbol_at(violation.pc)
            violation.now = self.now
            self.violation = violation
            self.halted = True
        self.processor.end_slice()

    def lock_up(self, why: str) -> None:
        """Stops the core until a reset; peripherals keep running (DDI0403 B1.5.15)."""
        self.locked_up = True
        pc = self.processor.get("pc")
        self.record("lockup", why=why, pc=pc, symbol=self.symbol_at(pc))
        self.processor.end_slice()

    def fpu_switched(self) -> None:
        """Watches for FPU instructions while CPACR keeps the FPU off."""
        self.processor.end_slice()

    # Power and reset.

    def power_on(self) -> None:
        """Applies power: RAM holds noise, and the chip resets."""
        if not self.powered:
            self.powered = True
            self.memory.power_on()
            self.processor.forget_code()
            self.debug.power_on()
            self._reset("por")

    def power_off(self) -> None:
        """Removes power. Flash keeps its contents; scheduled events are cancelled."""
        if self.powered:
            self.processor.end_slice()
            for peripheral in self.peripherals.values():
                if hasattr(peripheral, "power_off"):
                    peripheral.power_off()
            self.powered = False
            self.halted = True
            self.events.clear()
            self.record("power_off")

    def _reset(self, cause: str) -> None:
        self._reset_cause = None
        self.halted = self.violation is not None
        self.sleeping = self.locked_up = False
        self.stalled_until = 0
        self.nvic.lines = 0
        for device in (self.nvic, self.scb, self.systick, self.dwt, self.exceptions):
            device.reset()
        self.dwt.trace = bool(self.debug.demcr)
        for peripheral in self.peripherals.values():
            peripheral.catch_up()
        for peripheral in self.peripherals.values():
            peripheral.reset(cause)
        self.clocks_changed()
        vectors = self.memory.read(self.chip.boot, 8)
        self.processor.reset(int.from_bytes(vectors[:4], "little"), int.from_bytes(vectors[4:], "little"))
        self.paths.begin()
        self.record("reset", cause=cause)

    # The run.

    def run(self, until: int) -> None:
        """Runs until a board time, or until `stop` is called. Raises a pending violation."""
        self._stop = bool(self.watcher and self.watcher(None))
        events, nvic, dispatch = self.events, self.nvic, self.exceptions.dispatch
        while self._now < until:
            due = events.next_time()
            if due is not None and due <= self._now:
                self._run_due()
                due = events.next_time()
            if self.halted:
                if self.violation is not None:
                    raise self.violation
                if self._reset_cause is not None and self.powered:
                    self._reset(self._reset_cause)
                    continue
            if self._stop:
                return
            if due is None or due > until:
                due = until
            if not self.powered or self.locked_up:
                self._now = max(due, self._now)
            elif self._now < self.stalled_until:
                self._now = max(min(due, self.stalled_until), self._now)
            elif nvic.pending & nvic.enabled and dispatch():
                continue
            elif self.sleeping and not (nvic.pending & nvic.enabled and self._wakes()):
                self.dwt.skip(due - self._now)
                self.slept += due - self._now
                self._now = due
            else:
                self.sleeping = False
                self._slice(due)
        self._run_due()
        if self.violation is not None:
            raise self.violation

    def _run_due(self) -> None:
        pop_due, watcher = self.events.pop_due, self.watcher
        while not self._stop:
            callback = pop_due(self._now)
            if callback is None:
                return
            try:
                callback()
            except Violation as violation:
                self.violate(violation)
            if watcher is not None and watcher(None):
                self._stop = True

    def _wakes(self) -> bool:
        """Returns whether a pending exception ends the sleep, regardless of PRIMASK (DDI0403 B1.5.17)."""
        highest = self.nvic.highest_pending()
        if highest is None:
            return False
        _, basepri, faultmask, _ = self.processor.masks.read()
        return highest[1] < self.nvic.execution_priority(0, basepri, faultmask)

    def _slice_length(self, due: int) -> int:
        count = min(-(-(due - self._now) // self._instruction_ps), LONGEST_SLICE)
        if self.nvic.preempting() is None:
            self._masked = 0
            return count
        # PRIMASK or BASEPRI blocks it. They are checked again after a slice, which may be a quarter of the wait so far.
        length = max(MASKED_SLICE, self._masked // 4)
        self._masked += length
        return min(count, length)

    def _slice(self, due: int) -> None:
        """Runs instructions until an event is due or the slice ends by itself."""
        processor = self.processor
        count = self._slice_length(due)
        if processor.watching == (self.scb.cpacr >> 20 & 1):
            processor.watch_blocks(not processor.watching)
        if processor.fpu_ahead:
            if self.scb.next_is_fpu_instruction(processor.get("pc")):
                processor.fpu_ahead = False
                self.exceptions.fault(NOCP, "an FPU instruction while CPACR keeps the FPU off")
                return
            count = 1
        stepping = processor.fpu_ahead
        self._base, self.in_slice = 0, True
        try:
            why = processor.run(count)
        finally:
            self.in_slice = False
        executed = processor.executed.value
        self._now += max(executed - self._base, 0) * self._instruction_ps
        self.instructions += executed
        self.slices += 1
        if stepping:
            processor.fpu_ahead = False
        if why == COUNT or self.halted:
            return
        if why == SLEEP:
            if self.scb.scr & SLEEPDEEP:
                self.violate(Violation("WFI with SLEEPDEEP: Stop and Standby mode are not modelled"))
            self.sleeping = True
            self.paths.sleep()
        elif why == FAULT:
            self._memory_fault()
        elif why == UNDEFINED:
            self._undefined()
        elif why == STATE:
            self.exceptions.fault(INVSTATE, "a branch to an even address: EPSR.T = 0")

    def _undefined(self) -> None:
        pc = self.processor.get("pc")
        before = self.memory.read(pc - 2, 2)
        if before in (b"\x20\xbf", b"\x10\xbf"):
            # WFE and YIELD stop unicorn. WFE may end at once (DDI0403 B1.5.18), YIELD does nothing.
            return
        self.exceptions.fault(UNDEFINSTR, "an undefined instruction")

    def _memory_fault(self) -> None:
        """Takes the fault of an access that the memory map refused (DDI0403 B3.1, RM0090 section 2.3)."""
        kind, address = self.processor.fault, self.processor.refused.value
        if 0x2200_0000 <= address < 0x2400_0000:
            self.violate(Violation("the bit-band alias is not modelled", address))
        elif kind != FETCH:
            what = f"a {'write to' if kind == WRITE else 'read of'} 0x{address:08X}, where that cannot be done"
            self.exceptions.bus_fault(PRECISERR, address, what)
        elif 0x4000_0000 <= address < 0x6000_0000 or address >= 0xA000_0000:
            self.exceptions.fault(IACCVIOL, f"an instruction fetch from 0x{address:08X}, a region without execution")
        else:
            self.exceptions.bus_fault(IBUSERR, None, f"an instruction fetch from 0x{address:08X}")

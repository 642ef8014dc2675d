"""The instruction set: a Cortex-M core of `unicorn` without interrupts, run in slices of a known number of instructions.

Unicorn executes Thumb code and has the special registers and both stack pointers. It has no NVIC, takes no exception and keeps
no time; `Exceptions` and `Board` add these. The following was found in the sources of unicorn 2.1.4:

- A call per instruction counts instructions and also sets the program counter. The count and its limit are adjacent in
  unicorn's own structure; their offset is found at the start with known counts. Reading the count gives the time
  of a register access to one instruction; lowering the limit ends the slice after the current instruction.
  (`uc_emu_stop` in a register access would execute the instruction twice.)
- With its virtual TLB unicorn asks for the permissions of each page once. An access that they refuse stops precisely at
  the instruction; one that unicorn's own map refuses would continue with a wrong value. RAM pages get no permission
  to execute until code runs there, since stores to a page that holds code take a slow path.
- WFI ends the slice before the limit, without an error.
"""

import ctypes
import struct
import traceback

import unicorn
from unicorn import arm_const, unicorn_const as const
from unicorn.unicorn_py3.unicorn import uclib

from .chips import FLASH, SRAM
from .registers import LIBRARY, Batch
from .violation import Violation

PERIPHERALS = 0x4000_0000
PERIPHERALS_SIZE = 0x2000_0000
PRIVATE = 0xE000_0000
PRIVATE_SIZE = 0x10_0000

#: Largest page of the virtual TLB, bytes.
PAGE = 4096
#: Bytes of unicorn's structure that are searched. It ends with jump buffers of more than 10,000 bytes.
STRUCTURE = 6_000

#: The bits of xPSR that hold the state of an IT block (DDI0403 B1.4.2).
IT_STATE = 0x0600_FC00

#: Reasons for the end of a slice.
COUNT, SLEEP, FAULT, UNDEFINED, STATE = range(5)

READ = ctypes.CFUNCTYPE(ctypes.c_uint64, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint, ctypes.c_void_p)
WRITE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint, ctypes.c_uint64, ctypes.c_void_p)
INTERRUPT = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_void_p)
INVALID = ctypes.CFUNCTYPE(
    ctypes.c_bool, ctypes.c_void_p, ctypes.c_int, ctypes.c_uint64, ctypes.c_int, ctypes.c_int64, ctypes.c_void_p
)


class TlbEntry(ctypes.Structure):
    """Unicorn's `uc_tlb_entry`."""

    _fields_ = [("address", ctypes.c_uint64), ("permissions", ctypes.c_int)]


TLB = ctypes.CFUNCTYPE(
    ctypes.c_bool, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_int, ctypes.POINTER(TlbEntry), ctypes.c_void_p
)
BLOCK = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint32, ctypes.c_void_p)


def pointer(callback) -> ctypes.c_void_p:
    """Returns a callback in the form that `unicorn`'s prototypes need. The caller must keep the callback itself."""
    return ctypes.cast(callback, ctypes.c_void_p)


#: The general registers, in the order in which they are shown.
GENERAL = "r0 r1 r2 r3 r4 r5 r6 r7 r8 r9 r10 r11 r12 sp lr xpsr"


class Processor:
    """Executes instructions, and passes register accesses, faults and exception returns to the board."""

    def __init__(self, board):
        self.board = board
        self.uc = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
        self.uc.ctl_set_cpu_model(board.chip.model)
        self.handle = self.uc._uch
        self._start = LIBRARY.uc_emu_start
        self._begin = ctypes.c_uint64()
        self._callbacks: list = []
        self._find_fields()
        self._map(board.memory)
        self._hook(const.UC_HOOK_INTR, INTERRUPT(self._on_interrupt))
        self._hook(const.UC_HOOK_TLB_FILL, TLB(self._on_tlb))
        self._hook(const.UC_HOOK_MEM_WRITE_PROT, INVALID(self._on_flash_write), FLASH, FLASH + board.memory.flash.size - 1)
        self.uc.ctl_set_tlb_mode(const.UC_TLB_VIRTUAL)
        self.general = Batch(self.handle, GENERAL)
        self.pc = Batch(self.handle, "pc")
        self.masks = Batch(self.handle, "primask basepri faultmask xpsr")
        #: The kind of the access that was refused in this slice; its address is in `refused`.
        self.fault: int | None = None
        #: The program counter after an exception entry, which then need not be read from unicorn.
        self.start_at: int | None = None
        self._singles: dict[str, Batch] = {}
        #: Whether blocks are reported before they run.
        self.watching = False
        self._block_hook = None
        self._block_callback = BLOCK(self._on_block)
        #: Whether a block with FPU instructions was reached while the FPU is off.
        self.fpu_ahead = False
        self._stale_code: list[tuple[int, int]] = []
        #: Start addresses of the pages of SRAM that were executed.
        self._code_pages: set[int] = set()
        self._fpu_blocks: dict[tuple[int, int], bool] = {}
        board.memory.on_code_change = self._on_code_change

    def _find_fields(self) -> None:
        """Finds the instruction count and its limit, and the address of the last refused access, in unicorn's structure."""
        scratch = 0x1000
        # 0x7FF times NOP, a branch to itself; at the end LDR r0, [r1].
        self.uc.mem_map(scratch, 0x2000)
        self.uc.mem_write(scratch, b"\x00\xbf" * 0x7FF + b"\xfe\xe7" + b"\x08\x68")

        def count(limit: int) -> bytes:
            self.uc.emu_start(scratch | 1, 0, count=limit)
            return struct.pack("<QQ", limit + 1, limit)

        def refused(address: int) -> bytes:
            self.uc.reg_write(arm_const.UC_ARM_REG_R1, address)
            try:
                self.uc.emu_start(scratch + 0x1000 | 1, 0, count=1)
            except unicorn.UcError:
                pass
            return struct.pack("<Q", address)

        at = self._find_field(count, (54_321, 7_919, 31_337))
        self.executed = ctypes.c_uint64.from_address(at)
        self.limit = ctypes.c_uint64.from_address(at + 8)
        self.refused = ctypes.c_uint64.from_address(self._find_field(refused, (0x1234_5678, 0x2345_6788, 0x3456_789C)))
        self.executed.value = 0
        self.uc.mem_unmap(scratch, 0x2000)

    def _find_field(self, provoke, values) -> int:
        places = None
        for value in values:
            wanted = provoke(value)
            content = ctypes.string_at(self.handle, STRUCTURE)
            found = {at for at in range(0, len(content) - 16, 8) if content.startswith(wanted, at)}
            places = found if places is None else places & found
        if len(places) != 1:
            raise RuntimeError(f"unicorn {unicorn.__version__}: {provoke.__name__} was found at {len(places)} places")
        return self.handle.value + places.pop()

    def _map(self, memory) -> None:
        every, fixed = const.UC_PROT_ALL, const.UC_PROT_READ | const.UC_PROT_EXEC
        for base, region, access in (
            *([(0, memory.flash, fixed)] if memory.alias else ()),
            (FLASH, memory.flash, fixed),
            *((ram.base, ram, every) for ram in memory.ram),
            (memory.system.base, memory.system, fixed),
        ):
            self.uc.mem_map_ptr(base, region.size, every, ctypes.addressof(region.buffer))
            # Only a change of the protection makes unicorn discard writes to memory that was passed to it.
            self.uc.mem_protect(base, region.size, access)
        for base, size in ((PERIPHERALS, PERIPHERALS_SIZE), (PRIVATE, PRIVATE_SIZE)):
            read, write = READ(self._reader(base)), WRITE(self._writer(base))
            self._callbacks += [read, write]
            code = uclib.uc_mmio_map(self.handle, base, size, pointer(read), None, pointer(write), None)
            if code:
                raise unicorn.UcError(code)

    def _hook(self, kind: int, callback, begin: int = 1, end: int = 0) -> ctypes.c_size_t:
        self._callbacks.append(callback)
        hook = ctypes.c_size_t()
        code = uclib.uc_hook_add(self.handle, ctypes.byref(hook), kind, pointer(callback), None, begin, end)
        if code:
            raise unicorn.UcError(code)
        return hook

    def _reader(self, base: int):
        def read(_, offset, size, __, call=self.board.bus.read):
            try:
                return call(base + offset, size)
            except BaseException as error:
                return self._failed(error)

        return read

    def _writer(self, base: int):
        def write(_, offset, size, value, __, call=self.board.bus.write):
            try:
                call(base + offset, value, size)
            except BaseException as error:
                self._failed(error)

        return write

    def _guard(self, call, *arguments) -> None:
        """Calls the model from a callback, and ends the slice after an error."""
        try:
            call(*arguments)
        except BaseException as error:
            self._failed(error)

    def _failed(self, error: BaseException) -> int:
        """Ends the slice after an error in a callback, which cannot cross unicorn's frames."""
        if not isinstance(error, Violation):
            error = Violation("the model failed: " + traceback.format_exc())
        self.board.violate(error)
        return 0

    def _on_interrupt(self, _, number, __) -> None:
        try:
            self.board.exceptions.processor_event(number)
        except BaseException as error:
            self._failed(error)

    def _on_tlb(self, _, address, kind, entry, __) -> bool:
        permissions = self._permissions(address, kind)
        if permissions is None:
            self.fault = kind
            return False
        if kind != const.UC_MEM_FETCH:
            self._forget_condition()
        entry[0].address = address
        entry[0].permissions = permissions
        return True

    def _forget_condition(self) -> None:
        """Clears the state of an IT block. Unicorn writes that state when it fills its TLB, or asks for a write to protected
        memory, within a block, and never clears it: the instructions after the block would be conditional, too.
        """
        xpsr = self.get("xpsr")
        if xpsr & IT_STATE:
            self.set("all_xpsr", xpsr & ~IT_STATE)

    def _permissions(self, address: int, kind: int) -> int | None:
        """Returns the permissions of a page, or `None` when it refuses this access."""
        read, write, execute = const.UC_PROT_READ, const.UC_PROT_WRITE, const.UC_PROT_EXEC
        memory = self.board.memory
        if SRAM <= address < SRAM + memory.sram.size:
            if kind != const.UC_MEM_FETCH:
                return read | write
            self._code_pages.add(address & -PAGE)
            return read | write | execute
        if FLASH <= address < FLASH + memory.flash.size:
            return read | write | execute  # A write goes to the flash controller.
        if PERIPHERALS <= address < PERIPHERALS + PERIPHERALS_SIZE or PRIVATE <= address < PRIVATE + PRIVATE_SIZE:
            allowed = read | write
        elif address < memory.alias:
            allowed = read | execute
        elif memory.ccm and 0 <= address - memory.ccm.base < memory.ccm.size:
            allowed = read | write
        elif 0 <= address - memory.system.base < memory.system.size:
            allowed = read
        else:
            return None
        needed = {const.UC_MEM_READ: read, const.UC_MEM_WRITE: write, const.UC_MEM_FETCH: execute}[kind]
        return allowed if allowed & needed else None

    def _on_flash_write(self, _, kind, address, size, value, __) -> bool:
        self._forget_condition()
        self._guard(self.board.bus.write_memory, address, value & (1 << 8 * size) - 1, size)
        return True

    def _on_code_change(self, address: int, size: int) -> None:
        first, last = address & -PAGE, address + size - 1 & -PAGE
        if address < SRAM or any(page in self._code_pages for page in range(first, last + 1, PAGE)):
            self._stale_code.append((address, size))

    def forget_code(self) -> None:
        """Discards all translated code."""
        self.uc.ctl_flush_tb()
        self._stale_code.clear()

    def _on_block(self, _, address, size, __) -> None:
        block = address, size
        found = self._fpu_blocks.get(block)
        if found is None:
            found = self._fpu_blocks[block] = self.board.scb.block_has_fpu_instruction(address, size)
        if found and not self.fpu_ahead:
            self.fpu_ahead = True
            self.end_slice()

    def watch_blocks(self, on: bool) -> None:
        """Reports each block of instructions before it runs, or stops doing so. Needed only while the FPU is off."""
        self.watching = on
        if on:
            self._block_hook = self._hook(const.UC_HOOK_BLOCK, self._block_callback)
        else:
            uclib.uc_hook_del(self.handle, self._block_hook)
            self._block_hook = None
        self.fpu_ahead = False
        self._fpu_blocks.clear()
        self.uc.ctl_flush_tb()

    def watch_reads(self, begin: int, end: int, callback):
        """Calls back with the address of each read of a range."""
        call = INVALID(lambda _, kind, address, size, value, __: self._guard(callback, address))
        hook = self._hook(const.UC_HOOK_MEM_READ, call, begin, end)
        self.forget_code()
        return hook

    def end_slice(self) -> None:
        """Ends the slice after the current instruction."""
        if self.limit.value > self.executed.value:
            self.limit.value = self.executed.value

    def shorten(self, instructions: int) -> None:
        """Lets at most this many more instructions run in this slice."""
        end = self.executed.value + max(instructions, 0)
        if self.limit.value > end:
            self.limit.value = end

    def run(self, count: int) -> int:
        """Runs a slice and returns why it ended. `executed` then holds the number of instructions, corrected for the last one."""
        if self._stale_code:
            for address, size in self._stale_code:
                self.uc.ctl_remove_cache(address, address + size)
            self._stale_code.clear()
        self.fault = None
        start = self.pc.read()[0] if self.start_at is None else self.start_at
        self._begin.value = start | 1
        code = self._start(self.handle, self._begin, 0, 0, count)
        self.start_at = None
        executed, limit = self.executed.value, self.limit.value
        if executed > limit:
            self.executed.value = executed - 1
        if self.fault is not None:
            return FAULT
        if code == const.UC_ERR_OK:
            return COUNT if executed > limit else SLEEP
        if code in (const.UC_ERR_INSN_INVALID, const.UC_ERR_EXCEPTION):
            return UNDEFINED if self.general.read()[15] & 1 << 24 else STATE
        raise Violation(f"unicorn stopped with {unicorn.UcError(code)}")

    def get(self, name: str) -> int:
        """Reads one register."""
        return self._single(name).read()[0]

    def set(self, name: str, value: int) -> None:
        """Writes one register."""
        self.start_at = None
        self._single(name).write(value)

    def _single(self, name: str) -> Batch:
        if name not in self._singles:
            self._singles[name] = Batch(self.handle, name)
        return self._singles[name]

    def reset(self, sp: int, pc: int) -> None:
        """Sets the registers as after a reset (DDI0403 B1.5.5). The general registers are not changed."""
        for name in ("primask", "basepri", "faultmask", "fpscr"):
            self.set(name, 0)
        # Thread mode and the main stack pointer come first, so that `sp` is the main one.
        self.set("all_xpsr", 1 << 24)
        self.set("control", 0)
        self.set("apsr_nzcv", 0)
        self.set("sp", sp & ~3)
        self.set("lr", 0xFFFF_FFFF)
        self.set("pc", pc)

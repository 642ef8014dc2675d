"""The system control block (DDI0403 B3.2), the FPU's control registers (B3.2.20 on) and the MPU's (B3.5).

What the model does not support is a violation: traps for unaligned access and division by zero, the MPU, lazy stacking without
automatic stacking, Stop mode.
"""

import re
import struct

from .nvic import BUS_FAULT, MEM_MANAGE, NMI, PENDSV, PRIORITY_MASK, SVCALL, SYSTICK, USAGE_FAULT
from .violation import Violation

VECTKEY, VECTKEYSTAT = 0x05FA, 0xFA05
STKALIGN, BFHFNMIGN = 1 << 9, 1 << 8
ASPEN_LSPEN = 0xC000_0000
#: ID_PFR0 to ID_ISAR4 (DDI0439 table 4-1), at 0xED40.
IDENTITY = (0x30, 0x200, 0x0010_0000, 0, 0x0010_0030, 0, 0x0100_0000, 0, 0x0110_1110, 0x0211_2000, 0x2123_2231, 0x0111_1131, 0x0131_0132)
SHPR = {4: 0x18, 5: 0x19, 6: 0x1A, 11: 0x1F, 14: 0x22, 15: 0x23}
SHCSR_ACTIVE = {MEM_MANAGE: 0, BUS_FAULT: 1, USAGE_FAULT: 3, SVCALL: 7, PENDSV: 10, SYSTICK: 11}
SHCSR_PENDING = {USAGE_FAULT: 12, MEM_MANAGE: 13, BUS_FAULT: 14, SVCALL: 15}
SHCSR_ENABLED = {MEM_MANAGE: 16, BUS_FAULT: 17, USAGE_FAULT: 18}
#: A coprocessor instruction of CP10 or CP11: 111x_11xx_xxxx_xxxx, then xxxx_101x.
FPU_INSTRUCTION = re.compile(rb"[\x00-\xff][\xec-\xef\xfc-\xff][\x00-\xff][\x0a\x0b\x1a\x1b\x2a\x2b\x3a\x3b\x4a\x4b\x5a\x5b\x6a\x6b\x7a\x7b\x8a\x8b\x9a\x9b\xaa\xab\xba\xbb\xca\xcb\xda\xdb\xea\xeb\xfa\xfb]")


class Scb:
    """The registers from 0xE000_ED00, except the debug registers."""

    base, size = 0xE000ED00, 0xF0

    def __init__(self, board):
        self.board = board
        self.reset()

    def reset(self) -> None:
        """Sets the reset values."""
        self.vtor = self.board.chip.boot
        self.scr = 0
        self.ccr = STKALIGN
        self.cfsr = 0
        self.hfsr = 0
        self.mmfar = 0
        self.bfar = 0
        self.cpacr = 0
        self.prigroup = 0
        self.fpcar = 0
        self.mpu = {0xED98: 0, 0xED9C: 0, 0xEDA0: 0}

    @property
    def fpu_on(self) -> bool:
        """Returns whether CPACR gives access to CP10."""
        return bool(self.cpacr >> 20 & 1)

    def block_has_fpu_instruction(self, address: int, size: int) -> bool:
        """Returns whether a block of code may hold an FPU instruction; only halfword boundaries are searched."""
        code = self.board.memory.read(address, size) or b""
        return any(match.start() % 2 == 0 for match in FPU_INSTRUCTION.finditer(code))

    def next_is_fpu_instruction(self, address: int) -> bool:
        """Returns whether the instruction at an address is an FPU instruction."""
        code = self.board.memory.read(address, 4) or b""
        return bool(FPU_INSTRUCTION.fullmatch(code))

    def _icsr(self) -> int:
        nvic = self.board.nvic
        active = self.board.exceptions.current
        highest = nvic.highest_pending()
        value = active | (highest[0] << 12 if highest else 0)
        value |= (1 << 22 if nvic.pending >> 16 else 0) | (nvic.pending >> SYSTICK & 1) << 26
        value |= (nvic.pending >> PENDSV & 1) << 28 | (nvic.pending >> NMI & 1) << 31
        others = nvic.active & ~(1 << active)
        return value | (1 << 11 if active and not others else 0)

    def _shcsr(self) -> int:
        nvic, value = self.board.nvic, 0
        for table, mask in ((SHCSR_ACTIVE, nvic.active), (SHCSR_PENDING, nvic.pending), (SHCSR_ENABLED, nvic.enabled)):
            for number, bit in table.items():
                value |= (mask >> number & 1) << bit
        return value

    def read(self, offset: int, size: int) -> int:
        """Reads a register; CFSR and SHPR also by bytes and halfwords."""
        at = 0xED00 + offset
        if 0xED18 <= at < 0xED24:
            priority = {register: self.board.nvic.priority[number] for number, register in SHPR.items()}
            return int.from_bytes(bytes(priority.get((at & 0xFF) + n, 0) for n in range(size)), "little")
        if 0xED28 <= at < 0xED2C:
            return self.cfsr >> 8 * (at & 3) & (1 << 8 * size) - 1
        if size != 4:
            raise Violation(f"SCB: {size}-byte read at 0x{at:X} is not modelled")
        if 0xED40 <= at < 0xED74:
            return IDENTITY[(at - 0xED40) // 4]
        simple = {
            0xED00: self.board.chip.cpuid, 0xED08: self.vtor, 0xED0C: VECTKEYSTAT << 16 | self.prigroup << 8, 0xED10: self.scr,
            0xED14: self.ccr, 0xED2C: self.hfsr, 0xED30: 0, 0xED34: self.mmfar, 0xED38: self.bfar, 0xED3C: 0,
            0xED88: self.cpacr, 0xED90: 0x800, 0xED94: 0, **self.mpu,
        }  # fmt: skip
        if at in simple:
            return simple[at]
        if at == 0xED04:
            return self._icsr()
        if at == 0xED24:
            return self._shcsr()
        raise Violation(f"SCB: the register at 0x{at:X} is not modelled")

    def write(self, offset: int, value: int, size: int) -> None:
        """Writes a register; CFSR and SHPR also by bytes and halfwords."""
        at, nvic = 0xED00 + offset, self.board.nvic
        if 0xED18 <= at < 0xED24:
            for number, register in SHPR.items():
                n = register - (at & 0xFF)
                if 0 <= n < size:
                    nvic.priority[number] = value >> 8 * n & PRIORITY_MASK
            nvic.priorities_changed()
        elif 0xED28 <= at < 0xED2C:
            self.cfsr &= ~(value << 8 * (at & 3))
        elif size != 4:
            raise Violation(f"SCB: {size}-byte write at 0x{at:X} is not modelled")
        elif at == 0xED04:
            self._write_icsr(value)
        elif at == 0xED08:
            self.vtor = value & 0xFFFF_FF80
        elif at == 0xED0C:
            self._write_aircr(value)
        elif at == 0xED10:
            self.scr = value & 0x16
        elif at == 0xED14:
            if value & 0x18 or not value & STKALIGN:
                raise Violation(f"CCR = 0x{value:X}: traps and 4-byte stack alignment are not modelled")
            self.ccr = value & 0x31B
        elif at == 0xED24:
            self._write_shcsr(value)
        elif at == 0xED2C:
            self.hfsr &= ~value
        elif at == 0xED34:
            self.mmfar = value
        elif at == 0xED38:
            self.bfar = value
        elif at == 0xED88:
            self.cpacr = value & 0x00F0_0000
            self.board.fpu_switched()
        elif at in self.mpu or at == 0xED94 and not value & 1:
            self.mpu[at] = value
        elif at not in (0xED00, 0xED30, 0xED3C):  # CPUID is read-only; DFSR and AFSR hold nothing.
            raise Violation(f"SCB: a write of 0x{value:X} at 0x{at:X} is not modelled")
        self.board.interrupt_raised()

    def _write_icsr(self, value: int) -> None:
        nvic = self.board.nvic
        for number, set_bit, clear_bit in ((NMI, 31, None), (PENDSV, 28, 27), (SYSTICK, 26, 25)):
            if value >> set_bit & 1:
                nvic.pending |= 1 << number
            if clear_bit and value >> clear_bit & 1:
                nvic.pending &= ~(1 << number)

    def _write_aircr(self, value: int) -> None:
        if value >> 16 != VECTKEY:
            return
        if value & 3:
            raise Violation("AIRCR: VECTRESET and VECTCLRACTIVE are for debuggers")
        self.prigroup = value >> 8 & 7
        self.board.nvic.group_mask = 0xFF << self.prigroup + 1 & 0xFF
        self.board.nvic.priorities_changed()
        if value & 4:
            self.board.request_reset("software")

    def _write_shcsr(self, value: int) -> None:
        nvic = self.board.nvic
        for number, bit in SHCSR_ENABLED.items():
            nvic.enabled = nvic.enabled & ~(1 << number) | (value >> bit & 1) << number
        for number, bit in SHCSR_PENDING.items():
            nvic.pending = nvic.pending & ~(1 << number) | (value >> bit & 1) << number
        for number, bit in SHCSR_ACTIVE.items():
            if (nvic.active ^ (value >> bit & 1) << number) >> number & 1:
                raise Violation("SHCSR: software changed an active bit")


class FpuControl:
    """FPCCR, FPCAR, FPDSCR and the FPU's feature registers, from 0xE000_EF34 on.

    The model stores the FPU's part of a frame at once, so LSPACT always reads as 0.
    """

    base, size = 0xE000EF34, 0x10

    def __init__(self, board):
        self.board = board

    def read(self, offset: int, size: int) -> int:
        """Reads a register."""
        values = (ASPEN_LSPEN, self.board.scb.fpcar, 0, 0x1011_0021)
        if size != 4:
            raise Violation(f"FPU: {size}-byte read")
        return values[offset // 4]

    def write(self, offset: int, value: int, size: int) -> None:
        """Accepts only the reset values, and any FPCAR."""
        if size == 4 and offset == 4:
            self.board.scb.fpcar = value & ~7
        elif size != 4 or value != (ASPEN_LSPEN, None, 0, None)[offset // 4]:
            raise Violation(f"FPU: a write of 0x{value:X} at 0x{self.base + offset:X} is not modelled")


def words(data: bytes) -> tuple[int, ...]:
    """Splits bytes into words."""
    return struct.unpack(f"<{len(data) // 4}I", data)

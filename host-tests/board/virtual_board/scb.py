"""The system control block (DDI0403 B3.2).

What the model does not support is a violation: traps for unaligned access and division by zero, faults with handlers of their own
(SHCSR), priority groups, the MPU, the FPU's control but CPACR, sleep on exit, Stop mode.
"""

import re

from .nvic import NMI, PENDSV, PRIORITY_MASK, SYSTICK
from .violation import Violation

VECTKEY, VECTKEYSTAT = 0x05FA, 0xFA05
STKALIGN, SLEEPONEXIT = 1 << 9, 1 << 1
SHPR = {4: 0x18, 5: 0x19, 6: 0x1A, 11: 0x1F, 14: 0x22, 15: 0x23}
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
        self.cfsr = 0
        self.hfsr = 0
        self.bfar = 0
        self.cpacr = 0

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
        # No fault of the model sets MMFAR.
        simple = {
            0xED00: self.board.chip.cpuid, 0xED08: self.vtor, 0xED0C: VECTKEYSTAT << 16, 0xED10: self.scr, 0xED14: STKALIGN,
            0xED2C: self.hfsr, 0xED34: 0, 0xED38: self.bfar, 0xED88: self.cpacr,
        }  # fmt: skip
        if at in simple:
            return simple[at]
        if at == 0xED04:
            return self._icsr()
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
            if value & SLEEPONEXIT:
                raise Violation("SCR: sleep on exit is not modelled")
            self.scr = value & 0x14
        elif at == 0xED88:
            self.cpacr = value & 0x00F0_0000
            self.board.fpu_switched()
        else:
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
        if value & 0x703:
            raise Violation("AIRCR: priority groups are not modelled; VECTRESET and VECTCLRACTIVE are for debuggers")
        if value & 4:
            self.board.request_reset("software")

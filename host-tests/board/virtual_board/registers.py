"""Sets of processor registers that are read or written with one call.

A call through `ctypes` costs about a microsecond, so the registers of an exception frame are transferred together. `LIBRARY`
has the functions without `unicorn`'s argument types, whose conversions double that cost, and keeps Python's lock.
"""

import ctypes
import struct

from unicorn import arm_const as arm
from unicorn.unicorn_py3.unicorn import uclib

IDS = {f"r{n}": getattr(arm, f"UC_ARM_REG_R{n}") for n in range(13)} | {
    "sp": arm.UC_ARM_REG_SP,
    "lr": arm.UC_ARM_REG_LR,
    "pc": arm.UC_ARM_REG_PC,
    "xpsr": arm.UC_ARM_REG_XPSR,
    "msp": arm.UC_ARM_REG_MSP,
    "psp": arm.UC_ARM_REG_PSP,
    "primask": arm.UC_ARM_REG_PRIMASK,
    "basepri": arm.UC_ARM_REG_BASEPRI,
    "faultmask": arm.UC_ARM_REG_FAULTMASK,
    "control": arm.UC_ARM_REG_CONTROL,
    "fpscr": arm.UC_ARM_REG_FPSCR,
    # The last two are write-only. All of xPSR with its GE bits:
    "all_xpsr": arm.UC_ARM_REG_XPSR_NZCVQG,
    # The condition flags; a write also makes unicorn update its mode (thread or handler).
    "apsr_nzcv": arm.UC_ARM_REG_APSR_NZCV,
} | {f"d{n}": getattr(arm, f"UC_ARM_REG_D{n}") for n in range(16)}

LIBRARY = ctypes.PyDLL(uclib._name)
_read, _write = LIBRARY.uc_reg_read_batch, LIBRARY.uc_reg_write_batch


class Batch:
    """A list of registers, read and written in its order. Cells have 64 bits if the first register is one of `d0` to `d15`, else 32."""

    def __init__(self, handle, names: str):
        self.names = names.split()
        count = len(self.names)
        wide = self.names[0].startswith("d")
        cell = ctypes.c_uint64 if wide else ctypes.c_uint32
        self.values = (cell * count)()
        self._layout = struct.Struct(f"<{count}{'Q' if wide else 'I'}")
        size = ctypes.sizeof(cell)
        start = ctypes.addressof(self.values)
        self._ids = (ctypes.c_int * count)(*(IDS[name] for name in self.names))
        self._pointers = (ctypes.c_void_p * count)(*(start + size * n for n in range(count)))
        self._arguments = (handle, self._ids, self._pointers, count)

    def read(self) -> tuple[int, ...]:
        """Reads all registers."""
        _read(*self._arguments)
        return self._layout.unpack(self.values)

    def read_bytes(self) -> bytes:
        """Reads all registers as bytes in memory order."""
        _read(*self._arguments)
        return bytes(self.values)

    def write_bytes(self, data: bytes) -> None:
        """Writes all registers from bytes in memory order."""
        ctypes.memmove(self.values, data, len(data))
        _write(*self._arguments)

    def write(self, *values: int) -> None:
        """Writes all registers."""
        self._layout.pack_into(self.values, 0, *values)
        _write(*self._arguments)

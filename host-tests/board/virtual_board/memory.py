"""The memories of the chip as buffers that the processor and the model share.

For a boot from flash, the STM32F405 shows it also at address 0 (RM0090 section 2.4). RAM keeps its contents over a reset
and holds noise after power-on.
"""

import ctypes
import random
import struct

from .chips import FLASH, SRAM, STM32F405

WORD = struct.Struct("<I")


class Region:
    """A range of memory that can be read and written without side effects."""

    def __init__(self, base: int, size: int, fill: int):
        self.base, self.size = base, size
        self.buffer = (ctypes.c_uint8 * size)()
        ctypes.memset(self.buffer, fill, size)
        self.view = memoryview(self.buffer).cast("B")


class Memory:
    """Holds all memories."""

    def __init__(self, seed: int, chip=STM32F405):
        self.chip = chip
        self.flash = Region(FLASH, chip.flash_size, 0xFF)
        self.sram = Region(SRAM, chip.sram_size, 0)
        self.ccm = Region(*chip.data_ram, 0) if chip.data_ram else None
        self.system = Region(*chip.system, 0xFF)
        self.ram = tuple(region for region in (self.sram, self.ccm) if region)
        self.regions = (self.sram, self.flash, *self.ram[1:], self.system)
        #: Bytes of flash that appear at address 0.
        self.alias = 0 if chip.boot else chip.flash_size
        self.random = random.Random(seed)
        #: Called with an address and a length after a write to flash or SRAM: code translated from there must be discarded.
        self.on_code_change = None
        # The unique identifier of 96 bits is the model's own; the flash size has 16 bits.
        self._set_system(chip.unique_id, b"\x31\x00\x2a\x00\x0fGYRONET")
        self._set_system(chip.flash_kib, (chip.flash_size >> 10).to_bytes(2, "little"))

    def _set_system(self, address: int, data: bytes) -> None:
        offset = address - self.system.base
        self.system.view[offset : offset + len(data)] = data

    def power_on(self) -> None:
        """Fills RAM with noise."""
        for region in self.ram:
            region.view[:] = self.random.randbytes(region.size)

    def region(self, address: int, length: int) -> Region | None:
        """Returns the memory that contains a whole range."""
        if address + length <= self.alias:
            return self.flash
        for region in self.regions:
            if region.base <= address and address + length <= region.base + region.size:
                return region
        return None

    def _offset(self, region: Region, address: int) -> int:
        return address if address < self.alias else address - region.base

    def read(self, address: int, length: int) -> bytes | None:
        """Reads a range, or returns `None` if there is no memory."""
        offset = address - SRAM
        if 0 <= offset <= self.sram.size - length:
            return bytes(self.sram.view[offset : offset + length])
        region = self.region(address, length)
        if region is None:
            return None
        offset = self._offset(region, address)
        return bytes(region.view[offset : offset + length])

    def word(self, address: int) -> int | None:
        """Reads 32 bits, or returns `None` if there is no memory."""
        if 0 <= address - FLASH <= self.flash.size - 4:
            return WORD.unpack_from(self.flash.view, address - FLASH)[0]
        data = self.read(address, 4)
        return None if data is None else WORD.unpack(data)[0]

    def write(self, address: int, data: bytes) -> bool:
        """Writes a range, flash included. Returns whether there is memory."""
        region = self.region(address, len(data))
        if region is None:
            return False
        offset = self._offset(region, address)
        region.view[offset : offset + len(data)] = data
        if self.on_code_change and region is not self.ccm:
            self.on_code_change(region.base + offset, len(data))
        return True

    def write_stack(self, address: int, data: bytes) -> bool:
        """Writes an exception frame. Returns whether there is RAM. Does not check for translated code there."""
        region = self.sram if address >= SRAM or not self.ccm else self.ccm
        offset = address - region.base
        if offset < 0 or offset + len(data) > region.size:
            return False
        region.view[offset : offset + len(data)] = data
        return True

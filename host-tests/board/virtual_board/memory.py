"""The memories of the STM32F405 (RM0090 section 2.3) as buffers that the processor and the model share.

Flash is at 0x0800_0000 and, for a boot from flash, also at address 0 (section 2.4). The core-coupled memory is only on the data
bus, so nothing can be fetched from it. RAM keeps its contents over a reset and holds noise after power-on.
"""

import ctypes
import random
import struct

FLASH = 0x0800_0000
FLASH_SIZE = 1 << 20
SRAM = 0x2000_0000
SRAM_SIZE = 128 << 10
CCM = 0x1000_0000
CCM_SIZE = 64 << 10
SYSTEM = 0x1FFF_0000
#: Up to the page of the option bytes (table 5); nothing is between it and SRAM.
SYSTEM_SIZE = 0xC400
WORD = struct.Struct("<I")
#: Section 39.1: the unique identifier, 96 bits. This one is the model's own.
UNIQUE_ID = 0x1FFF_7A10
#: Section 39.2: the flash size in KiB, 16 bits.
FLASH_KIB = 0x1FFF_7A22


class Region:
    """A range of memory that can be read and written without side effects."""

    def __init__(self, base: int, size: int, fill: int):
        self.base, self.size = base, size
        self.buffer = (ctypes.c_uint8 * size)()
        ctypes.memset(self.buffer, fill, size)
        self.view = memoryview(self.buffer).cast("B")


class Memory:
    """Holds all memories."""

    def __init__(self, seed: int):
        self.flash = Region(FLASH, FLASH_SIZE, 0xFF)
        self.sram = Region(SRAM, SRAM_SIZE, 0)
        self.ccm = Region(CCM, CCM_SIZE, 0)
        self.system = Region(SYSTEM, SYSTEM_SIZE, 0xFF)
        self.regions = (self.sram, self.flash, self.ccm, self.system)
        self.random = random.Random(seed)
        #: Called with an address and a length after a write to flash or SRAM: code translated from there must be discarded.
        self.on_code_change = None
        self._set_system(UNIQUE_ID, b"\x31\x00\x2a\x00\x0fGYRONET")
        self._set_system(FLASH_KIB, (FLASH_SIZE >> 10).to_bytes(2, "little"))

    def _set_system(self, address: int, data: bytes) -> None:
        offset = address - SYSTEM
        self.system.view[offset : offset + len(data)] = data

    def power_on(self) -> None:
        """Fills RAM with noise."""
        for region in (self.sram, self.ccm):
            region.view[:] = self.random.randbytes(region.size)

    def region(self, address: int, length: int) -> Region | None:
        """Returns the memory that contains a whole range."""
        if address + length <= FLASH_SIZE:
            return self.flash
        for region in self.regions:
            if region.base <= address and address + length <= region.base + region.size:
                return region
        return None

    def read(self, address: int, length: int) -> bytes | None:
        """Reads a range, or returns `None` if there is no memory."""
        offset = address - SRAM
        if 0 <= offset <= SRAM_SIZE - length:
            return bytes(self.sram.view[offset : offset + length])
        region = self.region(address, length)
        if region is None:
            return None
        offset = (address - region.base) & (FLASH_SIZE - 1)
        return bytes(region.view[offset : offset + length])

    def word(self, address: int) -> int | None:
        """Reads 32 bits, or returns `None` if there is no memory."""
        if 0 <= address - FLASH <= FLASH_SIZE - 4:
            return WORD.unpack_from(self.flash.view, address - FLASH)[0]
        data = self.read(address, 4)
        return None if data is None else WORD.unpack(data)[0]

    def write(self, address: int, data: bytes) -> bool:
        """Writes a range, flash included. Returns whether there is memory."""
        region = self.region(address, len(data))
        if region is None:
            return False
        offset = (address - region.base) & (FLASH_SIZE - 1)
        region.view[offset : offset + len(data)] = data
        if self.on_code_change and region is not self.ccm:
            self.on_code_change(region.base + offset, len(data))
        return True

    def write_stack(self, address: int, data: bytes) -> bool:
        """Writes an exception frame. Returns whether there is RAM. Does not check for translated code there."""
        region = self.sram if address >= SRAM else self.ccm
        offset = address - region.base
        if offset < 0 or offset + len(data) > region.size:
            return False
        region.view[offset : offset + len(data)] = data
        return True

"""The bus: routes an access to the register block of its address, or refuses the access.

A peripheral whose clock is off does not answer (RM0090 section 7.3), an address without a modelled register cannot be answered,
and the bit-band aliases are not modelled: each such access is a violation.
"""

from .violation import Violation


class Bus:
    """Routes accesses to peripherals and to the core's own registers."""

    def __init__(self, board):
        self.board = board
        self.blocks: dict[int, object] = {}
        self.private: dict[int, object] = {}
        #: Names of peripherals whose accesses go to the event log.
        self.traced: set[str] = set()
        #: Name of the peripheral whose accesses are counted, the number of accesses left, and the callback for the last one.
        self.counted: str | None = None
        self.left = 0
        self.on_count = None

    def attach(self, peripheral) -> None:
        """Adds a peripheral at its addresses."""
        for block in range(peripheral.base >> 10, (peripheral.base + peripheral.size + 1023) >> 10):
            if block in self.blocks:
                raise ValueError(f"{peripheral.name} lies on {self.blocks[block].name}")
            self.blocks[block] = peripheral

    def attach_private(self, device) -> None:
        """Adds registers of the core."""
        for word in range(device.base >> 2, (device.base + device.size) >> 2):
            self.private[word] = device

    def _find(self, address: int):
        peripheral = self.blocks.get(address >> 10)
        if peripheral is None:
            device = self.private.get(address >> 2)
            if device is not None:
                return device
            if 0x4200_0000 <= address < 0x4400_0000:
                raise Violation("the bit-band alias is not modelled", address)
            raise Violation("no peripheral is modelled here", address)
        if peripheral.clock is not None and not self.board.rcc.enabled(peripheral.clock):
            raise Violation(f"{peripheral.name} is used while its clock ({peripheral.clock}) is off", address)
        return peripheral

    def read(self, address: int, size: int) -> int:
        """Reads a register."""
        if self.board.halted:
            return 0
        device = self.blocks.get(address >> 10)
        if device is None or device.clock not in self.board.rcc.open:
            device = self._find(address)
        if address & size - 1:
            raise Violation("unaligned register access", address)
        try:
            value = device.read(address - device.base, size)
        except Violation as violation:
            violation.address = address
            raise
        if self.traced or self.counted:
            self._note(device, "read", address, value)
        return value

    def write(self, address: int, value: int, size: int) -> None:
        """Writes a register."""
        if self.board.halted:
            return
        device = self.blocks.get(address >> 10)
        if device is None or device.clock not in self.board.rcc.open:
            device = self._find(address)
        if address & size - 1:
            raise Violation("unaligned register access", address)
        try:
            device.write(address - device.base, value, size)
        except Violation as violation:
            violation.address = address
            raise
        if self.traced or self.counted:
            self._note(device, "write", address, value)

    def _note(self, device, access: str, address: int, value: int) -> None:
        name = getattr(device, "name", None)
        if name in self.traced:
            self.board.record("register", peripheral=name, access=access, address=address, value=value)
        if name is not None and name == self.counted:
            self._count()

    def _count(self) -> None:
        self.left -= 1
        if self.left <= 0:
            self.counted = None
            self.on_count()

    def count(self, name: str, accesses: int, callback) -> None:
        """Calls back after this many accesses to a peripheral. Writes to the flash array count for FLASH."""
        self.counted, self.left, self.on_count = name, accesses, callback

    def write_memory(self, address: int, value: int, size: int) -> None:
        """Passes a write to the flash array to the flash controller."""
        if self.board.halted:
            return
        self.board.flash.program(address, value, size)
        if self.counted == self.board.flash.name:
            self._count()

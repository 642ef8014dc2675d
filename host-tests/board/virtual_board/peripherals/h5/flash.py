"""Flash interface of the STM32H563: so far only the access control register."""

from ...violation import Violation
from .system import Registers


class Flash(Registers):
    """FLASH_ACR: wait states, programming delay, prefetch."""

    name, base = "FLASH", 0x4002_2000
    kept = {0x00: (0x13, 0x13F)}
    #: As on the STM32F405, bit 5 set: software starts the watchdog.
    options = 1 << 5

    @property
    def latency(self):
        """Returns the wait states."""
        return self.values[0] & 15

    def program(self, address, value, size):
        """Refuses a write to the array."""
        raise Violation(f"{self.name}: a write of {size} bytes to {address:#x} is not modelled")

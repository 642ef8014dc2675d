"""What the flash controllers have in common: keys, which open their registers, and an operation that loses its power."""

from .registers import Registers

KEYS, OPTION_KEYS = (0x4567_0123, 0xCDEF_89AB), (0x0819_2A3B, 0x4C5D_6E7F)
OPTLOCK, OPTSTRT = 1, 2


class Keyed(Registers):
    """A controller with `operation`, which is None while it is idle. `_interrupted` leaves it half done."""

    name = "FLASH"
    #: By offset of a key register: the attribute that it opens, its lock bit, and the two keys in their order.
    locks: dict[int, tuple[str, int, tuple[int, int]]] = {}

    def reset(self, cause):
        super().reset(cause)
        #: The number of right keys; None after a wrong one, which keeps the lock closed until the next reset.
        self.steps = dict.fromkeys(self.locks, 0)
        self.power_off()

    def power_off(self):
        """Handles a power failure: what was being erased or programmed stays half done."""
        if self.operation:
            self._interrupted()

    def store(self, offset, value):
        if offset in self.locks:
            self._key(offset, value)
        else:
            super().store(offset, value)

    def _key(self, offset, value):
        attribute, lock, keys = self.locks[offset]
        locked, step = getattr(self, attribute) & lock, self.steps[offset]
        if not locked or step is None or value != keys[step]:
            self.steps[offset] = None if locked else step
            self.board.record("ignored_write", register=f"FLASH {offset:#x}", value=value)
            return
        self.steps[offset] = 1 - step
        if step:
            setattr(self, attribute, getattr(self, attribute) & ~lock)

"""The base class of every peripheral of the virtual board.

A peripheral handles reads and writes of its registers, at byte offsets from its base. The board checks the clock gate before it
calls `read` or `write`. Both raise `Violation` for a register or an access size that is not modelled.
"""


class Peripheral:
    """A block of registers on the bus."""

    name: str
    base: int
    size: int = 0x400
    #: The RCC enable bit that gates the block, such as "CAN1" or "PWR". `None`: always clocked.
    clock: str | None = None
    #: Settings that are attributes of the same name.
    settings: frozenset[str] = frozenset()

    def __init__(self, board):
        self.board = board

    def reset(self, cause: str) -> None:
        """Resets the registers. Called at every reset. `cause`: por, bor, pin, software, iwdg, wwdg or lowpower."""

    def read(self, offset: int, size: int) -> int:
        """Reads 1, 2 or 4 bytes."""
        raise NotImplementedError

    def write(self, offset: int, value: int, size: int) -> None:
        """Writes 1, 2 or 4 bytes."""
        raise NotImplementedError

    def catch_up(self) -> None:
        """Does what is due by now, where DMA may do several steps at once. The DMA calls this before its registers are read."""

    def configure(self, name: str, value) -> None:
        """Sets a fault or a condition of the environment, such as the frequency of the crystal."""
        if name not in self.settings:
            raise KeyError(f"{self.name} has no setting {name!r}")
        setattr(self, name, value)

    def announce_clocks(self) -> None:
        """Calls everything that counts with a clock. Every chip's RCC calls it after a change."""
        for peripheral in self.board.peripherals.values():
            changed = getattr(peripheral, "clocks_changed", None)
            if changed:
                changed()
        self.board.clocks_changed()

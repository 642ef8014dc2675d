"""A bare board that runs a few hand-assembled instructions: the processor without the peripherals of the chip."""

import struct

from virtual_board.board import CLOCKS_PER_INSTRUCTION, Board
from virtual_board.peripheral import Peripheral

MAIN = 0x0800_0400
STACK = 0x2000_2000
CORE_HZ = 100_000_000
US = 1_000_000
#: The duration of an instruction in picoseconds.
INSTRUCTION = round(CLOCKS_PER_INSTRUCTION * 1e12 / CORE_HZ)
#: `b .`
HERE = "fee7"
#: `ldr r1, [r0]; adds r1, r1, #1; str r1, [r0]; bx lr`; entered with r0 at a counter.
COUNT = "0168491c01607047"


class Clocks(Peripheral):
    """Fixed clocks in the place of RCC."""

    name, base = "RCC", 0x4002_3800
    core_hz = CORE_HZ
    open = {None}

    def enabled(self, name: str) -> bool:
        """Gates one peripheral that no test has."""
        return name != "GATED"


class Echo(Peripheral):
    """A register that keeps what is written, and whose writes raise interrupt 5."""

    name, base = "ECHO", 0x4000_0000

    def reset(self, cause: str) -> None:
        self.values: dict[int, int] = {}
        self.board.irq(5, False)

    def read(self, offset: int, size: int) -> int:
        return self.values.get(offset, 0)

    def write(self, offset: int, value: int, size: int) -> None:
        self.values[offset] = value
        if offset == 4:
            self.board.irq(5, bool(value))


class Gated(Echo):
    """A register block whose clock is off."""

    name, base, clock = "GATED", 0x4000_0400, "GATED"


def handler_address(number: int) -> int:
    """Returns where the handler of an exception lies."""
    return 0x0800_1000 + 0x100 * number


class Program:
    """A board with a program in flash and handlers by exception number; the others are `b .`."""

    def __init__(self, main: str, handlers: dict[int, str] | None = None, stack: int = STACK, fpu: bool = True, **registers):
        self.board = Board(None, lambda board: [Clocks(board), Echo(board), Gated(board)])
        vectors = [stack, MAIN | 1] + [handler_address(number) | 1 for number in range(2, 98)]
        self.board.memory_write(0x0800_0000, struct.pack("<98I", *vectors))
        self.board.memory_write(MAIN, bytes.fromhex(main))
        for number in range(2, 98):
            self.board.memory_write(handler_address(number), bytes.fromhex((handlers or {}).get(number, HERE)))
        self.board.power_on()
        if fpu:
            self.board.scb.cpacr = 0xF0_0000
        self.set(**registers)

    def set(self, **registers: int) -> None:
        """Sets processor registers."""
        for name, value in registers.items():
            self.board.processor.set(name, value)

    def get(self, name: str) -> int:
        """Reads a processor register."""
        return self.board.processor.get(name)

    def run(self, instructions: int) -> "Program":
        """Runs for the time of so many instructions; returns itself."""
        self.board.run(self.board.now + instructions * INSTRUCTION)
        return self

    def words(self, address: int, count: int) -> tuple[int, ...]:
        """Reads words of memory."""
        return struct.unpack(f"<{count}I", self.board.memory_read(address, 4 * count))

    @property
    def handler(self) -> int | None:
        """The exception whose handler the program counter is in."""
        number = (self.get("pc") - 0x0800_1000) // 0x100
        return number if 2 <= number < 98 else None

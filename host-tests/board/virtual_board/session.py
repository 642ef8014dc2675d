"""The commands of the protocol, with which a test controls a board.

Each command is a method; its arguments are the fields of the JSON object beside `command`. Times are microseconds since
power-on, data are hexadecimal digits.

A condition of `until` is an event (`"lockup"`, `{"event": "reset", "cause": "iwdg"}`), or a number of bytes or frames that the board has
sent and nobody has taken: `{"usart": 2, "bytes": 10}`, `{"can": 6}`.
"""

from . import peripherals
from .board import Board
from .chips import CHIPS, STM32F405
from .elf import Elf
from .peripherals import h5
from .snapshot import Snapshot

US = 1_000_000
#: Bytes of one chunk of a serial line follow each other within this time, picoseconds.
CHUNK_GAP = 300 * US


class Session:
    """A board that a test controls."""

    def __init__(self, image: str, seed: int, chip: str = STM32F405.name):
        self.elf = Elf.open(image)
        create = peripherals.create if chip == STM32F405.name else h5.create
        self.board = Board(self.elf, create, seed, CHIPS[chip])
        self.snapshots: dict[str, Snapshot] = {}

    def answer(self, request: dict) -> dict:
        """Runs one command."""
        name = request.pop("command")
        if name.startswith("_") or name == "answer" or not hasattr(type(self), name):
            raise ValueError(f"unknown command {name!r}")
        return getattr(self, name)(**request) or {}

    # Power and time.

    def power_on(self) -> dict:
        """Applies power."""
        self.board.power_on()
        return {"time_us": self.board.now / US}

    def power_off(self) -> None:
        """Removes power."""
        self.board.power_off()

    def reset_pin(self) -> None:
        """Pulls NRST low for a moment."""
        self.board.request_reset("pin")

    def run(self, us: float | None = None, until: list | None = None, limit_us: float = 10 * US) -> dict:
        """Runs for a time, or until one of the conditions holds, for `limit_us` at most."""
        board = self.board
        conditions = [_condition(board, wanted) for wanted in until or ()]
        self._met = None
        if conditions:
            board.watcher = lambda entry: self._watch(conditions, entry)
        try:
            board.run(board.now + round((limit_us if us is None else us) * US))
        finally:
            board.watcher = None
        return {"time_us": board.now / US, "met": self._met}

    def _watch(self, conditions: list, entry: dict | None) -> bool:
        for index, condition in enumerate(conditions):
            if self._met is None and condition(entry):
                self._met = index
        return self._met is not None

    def cut_after(self, accesses: int, peripheral: str = "FLASH", delay_us: float = 0) -> None:
        """Cuts the power after this many accesses to a peripheral (for FLASH also to the array), at once or after a delay."""
        board = self.board

        def cut():
            board.record("cut", peripheral=peripheral)
            if delay_us:
                board.schedule(round(delay_us * US), board.power_off)
            else:
                board.power_off()

        board.bus.count(peripheral, accesses, cut)

    # External lines.

    def usart_send(self, usart, hex: str, at_us: float | None = None) -> None:
        """Sends bytes to the board, at the bit rate of the line."""
        at = None if at_us is None else round(at_us * US)
        self._usart(usart).inject(bytes.fromhex(hex), at)

    def usart_take(self, usart) -> dict:
        """Returns the bytes that the board has sent since the last call, in chunks with the time of each first and last byte."""
        chunks: list[dict] = []
        last = None
        for time, byte in self._usart(usart).take_sent():
            if last is None or time - last > CHUNK_GAP:
                chunks.append({"time_us": time / US, "hex": ""})
            chunks[-1]["hex"] += f"{byte:02x}"
            chunks[-1]["end_us"] = time / US
            last = time
        return {"chunks": chunks}

    def _usart(self, usart):
        return self.board.peripherals[_line(usart)]

    def can_send(self, id: int, ext: bool = False, data: str = "", remote: bool = False, at_us: float | None = None,
                 fd: bool = False, fast: bool = False) -> None:  # fmt: skip
        """Sends a frame of another node as soon as the bus is free for it; `fast`: CAN FD with the higher bit rate."""
        at = None if at_us is None else round(at_us * US)
        _can(self.board).bus.send(id, bytes.fromhex(data), ext, remote, at, fd, fast)

    def can_take(self) -> dict:
        """Returns the frames on the bus since the last call: of the board and of other nodes, complete and broken ones."""
        frames = []
        for entry in _can(self.board).bus.take_log():
            frame = entry.frame
            frames.append({"time_us": entry.end_ps / US, "start_us": entry.start_ps / US, "source": entry.source, "error": entry.error,
                           "id": frame.identifier, "ext": frame.extended, "remote": frame.remote, "fd": frame.fd, "fast": frame.fast, "data": frame.data.hex()})
        return {"frames": frames}

    def set(self, values: dict) -> None:
        """Sets faults and conditions of the environment: `{"RCC.crystal_hz": null}`."""
        for name, value in values.items():
            peripheral, _, key = name.partition(".")
            if peripheral not in self.board.peripherals:
                raise ValueError(f"no peripheral {peripheral!r}")
            self.board.peripherals[peripheral].configure(key, value)

    # Memory and registers.

    def symbol(self, name: str) -> dict:
        """Returns address and size of a symbol."""
        address, size = self.elf.find(name)
        return {"address": address, "size": size}

    def _address(self, address: int | None, symbol: str | None, offset: int) -> int:
        if address is None:
            address = self.elf.find(symbol)[0]
        return address + offset

    def memory_read(self, length: int, address=None, symbol=None, offset: int = 0) -> dict:
        """Reads flash or RAM."""
        return {"hex": self.board.memory_read(self._address(address, symbol, offset), length).hex()}

    def memory_write(self, hex: str, address=None, symbol=None, offset: int = 0) -> None:
        """Writes flash or RAM, code included."""
        self.board.memory_write(self._address(address, symbol, offset), bytes.fromhex(hex))

    def registers(self, set: dict | None = None) -> dict:
        """Sets processor registers, and returns them all and the priorities of all exceptions."""
        processor, board = self.board.processor, self.board
        for name, value in (set or {}).items():
            processor.set("all_xpsr" if name == "xpsr" else name, value | 1 if name == "pc" else value)
        names = processor.general.names + ["pc", "msp", "psp", "primask", "basepri", "faultmask", "control"]
        values = {name: processor.get(name) for name in names}
        return {
            "registers": values,
            "priorities": board.nvic.priority,
            "symbol": board.symbol_at(values["pc"]),
            "cfsr": board.scb.cfsr,
            "hfsr": board.scb.hfsr,
            "bfar": board.scb.bfar,
        }

    # Records.

    def events_take(self) -> dict:
        """Returns the event log and empties it."""
        log, self.board.log[:] = list(self.board.log), []
        return {"events": log}

    def trace(self, peripheral: str, on: bool) -> None:
        """Starts or stops logging the register accesses of a peripheral."""
        (self.board.bus.traced.add if on else self.board.bus.traced.discard)(peripheral)

    def counts(self) -> dict:
        """Returns instructions, slices, board time, the time asleep, and the accesses that `cut_after` still waits for."""
        board = self.board
        return {
            "instructions": board.instructions,
            "slices": board.slices,
            "time_us": board.now / US,
            "asleep_us": board.slept / US,
            "accesses_left": board.bus.left,
            "powered": board.powered,
            "locked_up": board.locked_up,
            "can_filtered": _can(board).filtered,
        }

    def paths_take(self) -> dict:
        """Returns the longest path of each exception since the last call, 0 for the program, in instructions, and its name."""
        board, longest = self.board, self.board.paths.longest
        board.paths.longest = {}
        vectors = {number: board.memory.word(board.scb.vtor + 4 * number) for number in longest if number}
        name = lambda number: board.symbol_at(vectors[number]).partition("+")[0] if number else "idle"
        return {"paths": [{"name": name(number), "instructions": count} for number, count in sorted(longest.items())]}

    def snapshot(self, name: str) -> None:
        """Saves the state of the board under a name."""
        self.snapshots[name] = Snapshot(self.board)

    def restore(self, name: str) -> None:
        """Restores a saved state."""
        self.snapshots[name].restore(self.board)


def _can(board):
    return board.peripherals.get("CAN1") or board.peripherals["FDCAN1"]


def _line(usart):
    """Names a serial line by its number: 4 and 5 have no synchronous mode, and are called UART."""
    return usart if isinstance(usart, str) else f"{'UART' if usart in (4, 5) else 'USART'}{usart}"


def _condition(board, wanted):
    """Converts a condition to a function of a log entry, or of `None` after any scheduled call."""
    if isinstance(wanted, str):
        wanted = {"event": wanted}
    if "usart" in wanted:
        usart = board.peripherals[_line(wanted["usart"])]
        usart.watch()
        return lambda entry: len(usart.sent) >= wanted["bytes"]
    if "can" in wanted:
        return _FrameCount(_can(board).bus, wanted["can"])
    fields = {key: value for key, value in wanted.items() if key != "event"}
    return lambda entry: (
        entry is not None
        and entry["kind"] == wanted["event"]
        and all(entry.get(key) == value for key, value in fields.items())
    )


class _FrameCount:
    """Tests whether the bus log has this many complete frames of the board. Each entry is read once."""

    def __init__(self, bus, wanted: int):
        self.bus, self.wanted = bus, wanted
        self.seen = self.count = 0

    def __call__(self, _) -> bool:
        for entry in self.bus.log[self.seen :]:
            self.count += entry.source == "board" and entry.error is None
        self.seen = len(self.bus.log)
        return self.count >= self.wanted

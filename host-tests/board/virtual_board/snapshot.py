"""Snapshots of the whole board, so that a test boots once and then tries thousands of continuations.

Peripherals are copied by their attributes in one deep copy, together with the queue of scheduled calls, so that a call of a
method of a part of a peripheral refers to the copied part. The board and the peripherals themselves stay the same objects, so a
function that captured `self` of a peripheral still works. (A lambda that captured an inner part of a peripheral would not.)
"""

import copy

BOARD_FIELDS = (
    "_now", "_base", "_reset_cause", "powered", "sleeping", "locked_up", "stalled_until", "instructions", "slept", "slices",
    "_masked", "_instruction_ps", "halted",
)  # fmt: skip
#: Memory is compared and restored in pieces of this size, so that translated code is kept where nothing changed.
PIECE = 4096


class Snapshot:
    """The state of a board between two runs."""

    def __init__(self, board):
        if board.violation is not None:
            raise ValueError("a board that was stopped by a violation cannot be kept")
        self.fields = {name: getattr(board, name) for name in BOARD_FIELDS if hasattr(board, name)}
        self.log = list(board.log)
        exceptions = board.exceptions
        self.exceptions = exceptions.current, exceptions.entry, exceptions.leaving
        self.context = board.processor.uc.context_save()
        self.memory = [bytes(region.view) for region in board.memory.regions]
        self.devices = _copy(board, _state(board))

    def restore(self, board) -> None:
        """Restores the state. The snapshot can be used again."""
        state = _copy(board, self.devices)
        for name, value in self.fields.items():
            setattr(board, name, value)
        board.log[:] = self.log
        board.violation = None
        exceptions = board.exceptions
        exceptions.current, exceptions.entry, exceptions.leaving = self.exceptions
        board.memory.random = state["random"]
        board.events.heap, board.events.order = state["events"]
        for device, attributes in zip(_devices(board), state["devices"]):
            device.__dict__.clear()
            device.__dict__.update(attributes)
        board.bus.counted, board.bus.left, board.bus.on_count = None, 0, None
        for region, saved in zip(board.memory.regions, self.memory):
            _put_back(board, region, saved)
        board.processor.uc.context_restore(self.context)
        board.processor.fpu_ahead = False
        board.processor.start_at = None
        board.paths.begin()


def _put_back(board, region, saved: bytes) -> None:
    if region.view == saved:
        return
    for at in range(0, region.size, PIECE):
        piece = saved[at : at + PIECE]
        if region.view[at : at + PIECE] != piece:
            board.memory.write(region.base + at, piece)


def _devices(board) -> list:
    return [board.nvic, board.scb, board.systick, board.dwt, board.debug, *board.peripherals.values()]


def _state(board) -> dict:
    return {
        "random": board.memory.random,
        "events": (board.events.heap, board.events.order),
        "devices": [device.__dict__ for device in _devices(board)],
    }


def _copy(board, state: dict) -> dict:
    kept = [board, *_devices(board)]
    return copy.deepcopy(state, {id(thing): thing for thing in kept})

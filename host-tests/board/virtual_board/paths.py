"""The longest path of each exception, and of the program between two sleeps, in instructions.

What preempts a path is not part of it. The time of a path is its instructions times the clocks that the board assumes for each.
"""


class Paths:
    """Counts the instructions of each path while they run."""

    def __init__(self, board):
        self.board = board
        self.longest: dict[int, int] = {}
        self.begin()

    def begin(self) -> None:
        """Starts with the program that is running now, after a reset."""
        self.own = [0]
        self.last = self._count()

    def _count(self) -> int:
        board = self.board
        return board.instructions + (board.processor.executed.value if board.in_slice else 0)

    def _account(self) -> None:
        now = self._count()
        self.own[-1] += now - self.last
        self.last = now

    def enter(self) -> None:
        """A handler begins."""
        self._account()
        self.own.append(0)

    def leave(self, number: int) -> None:
        """The handler of this exception ends."""
        self._account()
        if len(self.own) > 1:
            self._path(number, self.own.pop())

    def sleep(self) -> None:
        """The program sleeps."""
        self._account()
        if len(self.own) == 1:
            self._path(0, self.own[0])
            self.own[0] = 0

    def _path(self, number: int, instructions: int) -> None:
        self.longest[number] = max(instructions, self.longest.get(number, 0))

"""The queue of calls that are scheduled for a known board time.

Times are integer picoseconds. Calls with the same time run in the order in which they were scheduled.
"""

from heapq import heappop, heappush


class Handle:
    """A scheduled call, which can be cancelled until it has run."""

    __slots__ = ("callback",)

    def __init__(self, callback):
        self.callback = callback

    def cancel(self) -> None:
        """Removes the call from the queue. Has no effect after the call has run."""
        self.callback = None


class EventQueue:
    """Holds the scheduled calls, the earliest first."""

    def __init__(self):
        #: (time, order, handle); the order is unique, so handles are never compared.
        self.heap: list[tuple[int, int, Handle]] = []
        self.order = 0

    def schedule(self, time: int, callback) -> Handle:
        """Adds a call at a board time."""
        self.order = order = self.order + 1
        handle = Handle(callback)
        heappush(self.heap, (time, order, handle))
        return handle

    def next_time(self) -> int | None:
        """Returns the time of the earliest call, or `None` when the queue is empty."""
        heap = self.heap
        while heap and heap[0][2].callback is None:
            heappop(heap)
        return heap[0][0] if heap else None

    def pop_due(self, now: int):
        """Removes the earliest call that is due and returns it, or `None`."""
        heap = self.heap
        while heap and heap[0][0] <= now:
            handle = heappop(heap)[2]
            callback = handle.callback
            if callback is not None:
                handle.callback = None
                return callback
        return None

    def clear(self) -> None:
        """Cancels all calls."""
        for _, _, handle in self.heap:
            handle.callback = None
        self.heap = []

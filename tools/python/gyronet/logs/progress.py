"""Progress of reading on standard error, on a terminal only."""

import sys
import time

QUIET = False


class Progress:
    def __init__(self, name, total):
        self.name, self.total, self.done, self.said = name, max(total, 1), 0, time.monotonic()
        self.on = sys.stderr.isatty() and not QUIET

    def step(self):
        self.at(self.done + 1)

    def at(self, done):
        self.done = done
        if self.on and time.monotonic() - self.said > 0.2:
            self.said = time.monotonic()
            print(f"\r{self.name}: {100 * done // self.total} %", end="", file=sys.stderr, flush=True)

    def end(self):
        if self.on:
            print("\r\033[K", end="", file=sys.stderr, flush=True)

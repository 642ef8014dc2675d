"""General-purpose I/O ports A to I (RM0090 section 8).

Pins have a level, an alternate function and a speed, which other models read; a listener is called when a pin's level changes.
Left out: locks, interrupts of pins, analog levels (an analog pin reads 0), shorts between two outputs, and the time that an edge takes.

Settings: `drive` ((pin, level) from outside; level None lets the pin float), `watch` (pins whose output changes are recorded as `pin`).
"""

from .registers import ANY, Registers

OUTPUT, ALTERNATE, ANALOG = 1, 2, 3
MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, _, AFRL, AFRH = range(0, 0x28, 4)
#: Reset values of MODER, OSPEEDR and PUPDR (sections 8.4.1 to 8.4.4): the debug pins.
EVERY = 0xFFFF_FFFF
RESET = {"A": (0xA800_0000, 0x0C00_0000, 0x6400_0000), "B": (0x0000_0280, 0x0000_00C0, 0x0000_0100)}


class Gpio(Registers):
    """One port with its sixteen pins."""

    sizes = ANY

    def __init__(self, board, letter, base=0x4002_0000, reset=None):
        modes, speeds, pulls = reset or RESET.get(letter, (0, 0, 0))
        self.kept = {MODER: (modes, EVERY), OTYPER: (0, 0xFFFF), OSPEEDR: (speeds, EVERY), PUPDR: (pulls, EVERY), ODR: (0, 0xFFFF),
                     AFRL: (0, EVERY), AFRH: (0, EVERY)}
        super().__init__(board)
        self.letter = letter
        self.number = ord(letter) - ord("A")
        self.name = self.clock = "GPIO" + letter
        self.base = base + 0x400 * self.number
        self.driven, self.outside = 0, 0
        self.listeners = {}
        self.watched = 0
        self.output = 0
        self._find_functions()

    def _find_functions(self):
        #: The result of `alternate` for each pin.
        self.functions = [self.values[AFRH if pin > 7 else AFRL] >> 4 * (pin & 7) & 15 if self.mode(pin) == ALTERNATE else None
                          for pin in range(16)]

    def reset(self, cause):
        super().reset(cause)
        self._find_functions()
        self._changed()

    # -- for other models --------------------------------------------------------------------------------------------

    def mode(self, pin):
        """Returns 0 for an input, 1 for an output, 2 for an alternate function, 3 for analog."""
        return self.values[MODER] >> 2 * pin & 3

    def alternate(self, pin):
        """Returns the number of the pin's alternate function, or None if the pin is in another mode."""
        return self.functions[pin]

    def speed(self, pin):
        """Returns OSPEEDR: 0 low (2 MHz), 1 medium (25 MHz), 2 high (50 MHz), 3 very high (100 MHz)."""
        return self.values[OSPEEDR] >> 2 * pin & 3

    def listen(self, pin, callback):
        """Registers `callback(level)` for changes of the pin's level."""
        self.listeners.setdefault(pin, []).append(callback)

    def _levels(self):
        """Returns all levels: ODR for outputs; otherwise what drives the pin from outside, else its pull (a floating pin reads 0)."""
        levels = 0
        modes, types, _, pulls, out, *_ = self.values.values()
        for pin in range(16):
            mode = modes >> 2 * pin & 3
            bit = 1 << pin
            if mode == OUTPUT and not types & out & bit:
                levels |= out & bit
            elif mode == ANALOG:
                continue
            elif self.driven & bit:
                levels |= self.outside & bit
            elif pulls >> 2 * pin & 3 == 1:
                levels |= bit
        return levels

    def _changed(self):
        levels = self._levels()
        changed = levels ^ self.output
        self.output = levels
        if not changed:
            return
        for pin, callbacks in self.listeners.items():
            if changed >> pin & 1:
                for callback in callbacks:
                    callback(bool(levels >> pin & 1))
        recorded = changed & self.watched
        for pin in range(16) if recorded else ():
            if recorded >> pin & 1:
                self.board.record("pin", port=self.letter, pin=pin, level=bool(levels >> pin & 1))

    # -- registers ---------------------------------------------------------------------------------------------------

    def load(self, offset):
        if offset == IDR:
            return self._levels()
        return 0 if offset == BSRR else super().load(offset)

    def store(self, offset, value):
        if offset == BSRR:
            offset, value = ODR, self.values[ODR] & ~(value >> 16) | value & 0xFFFF
        if offset != IDR:
            super().store(offset, value)
        if offset not in (IDR, ODR):
            self._find_functions()
        self._changed()

    def configure(self, key, value):
        if key == "drive":
            pin, level = value
            bit = 1 << pin
            self.driven = self.driven & ~bit if level is None else self.driven | bit
            self.outside = self.outside & ~bit | (bit if level else 0)
            self._changed()
        elif key == "watch":
            self.watched = sum(1 << pin for pin in value)
        else:
            super().configure(key, value)


def connected(board, pins, function):
    """Returns whether one of the pins, given as (port letter, number), has the alternate function."""
    for letter, number in pins:
        port = board.peripherals.get("GPIO" + letter)
        if port is not None and port.functions[number] == function:
            return True
    return False

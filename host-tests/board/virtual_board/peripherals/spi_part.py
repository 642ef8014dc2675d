"""What the modelled inertial sensors on SPI have in common: registers, an oscillator of their own, outputs and the serial interface.

Frames are made on demand: each access makes those that are due. A sensor keeps its state through a reset of the microcontroller and
loses it with the power. What the data sheet forbids has no effect and is recorded: `sensor_in_reset`, `sensor_write_too_early`,
`sensor_reserved`.
"""

PS, MS, US = 1_000_000_000_000, 1_000_000_000, 1_000_000


class Die:
    """A die behind a chip select. A subclass reads and writes its registers, says whether it runs, and makes its outputs."""

    #: Bytes without meaning before what is read, and the fastest clock.
    dummies, max_hz = 0, 10_000_000
    name, identity = "", 0
    reset_values: dict = {}
    read_only: frozenset = frozenset()

    def __init__(self, board, motion):
        self.board, self.motion = board, motion
        self.clock_ppm, self.powered, self.passes = 1_000_000, True, True
        self.reset(0)

    def power_on(self):
        """Handles power-on."""
        self.powered = True
        self.reset(1 * MS)

    def power_off(self):
        """Handles the loss of power."""
        self.powered = False

    def reset(self, takes):
        """Returns all registers to their reset values; the die answers after a time."""
        self.registers, self.motion.stopped = dict(self.reset_values), False
        self.answers_from = self.board.now + takes
        self.written_at = -PS
        self.fifo, self.read_from, self.lost = [], 0, 0
        self.address, self.bytes, self.reading = None, 0, False
        self.restart()

    def restart(self):
        """Begins the outputs anew: the next one is due one period from now."""
        self.started, self.made = self.board.now, 0

    def clocked(self, ppm):
        """Sets the oscillator."""
        self.clock_ppm = ppm
        self.restart()

    def due_at(self, index):
        """Returns the board time of an output, counted since the outputs began."""
        return self.started + index * PS * 1_000_000 // (self.rate_hz() * self.clock_ppm)

    def catch_up(self):
        """Makes all frames that are due."""
        if not self.powered or not self.runs():
            return
        while self.due_at(self.made + 1) <= self.board.now:
            self.made += 1
            if not self.motion.stopped:
                self.output(self.due_at(self.made))

    def gain(self, hz):
        """Returns the gain of the filter."""
        return (1 + (hz / self.bandwidth_hz()) ** 4) ** -0.5

    def record(self, kind, **more):
        """Records what the data sheet forbids."""
        self.board.record(kind, die=self.name, **more)

    # -- serial interface --------------------------------------------------------------------------------------------

    def select(self):
        """Handles a falling chip select: the next byte is an address."""
        self.address, self.bytes = None, 0

    def deselect(self):
        """Handles a rising chip select. A frame that was read in part is kept whole."""
        if self.read_from:
            self.board.record("fifo_partial_read", read=self.read_from)
            self.read_from = 0
        self.address = None

    def transfer(self, byte, mode, hz):
        """Transfers one byte in each direction."""
        if not self.powered:
            return 0xFF
        if mode[0] != mode[1] or hz > self.max_hz:
            self.board.record("spi_unreadable", mode=list(mode), hz=hz)
            return 0xFF
        if self.address is None:
            self.address, self.reading = byte & 0x7F, bool(byte & 0x80)
            self.catch_up()
            return 0xFF
        self.bytes += 1
        if self.board.now < self.answers_from:
            self.record("sensor_in_reset", address=self.address)
            return 0
        if not self.reading:
            self.may_write(self.address, byte)
            return 0xFF
        if self.bytes <= self.dummies:
            return 0xA5
        address = self.address
        self.address = self.after(address)
        return self.read(address)

    def next_byte(self):
        """Returns the next byte of the oldest frame in the FIFO; with its last one the frame is gone."""
        frame, at = self.fifo[0], self.read_from
        self.read_from = at + 1
        if self.read_from == len(frame):
            self.fifo.pop(0)
            self.read_from = 0
        return frame[at]

    def after(self, address):
        """Returns the address that is read next."""
        return address if address == self.fifo_data else address + 1 & 0x7F

    def may_write(self, address, value):
        """Writes a register, if the data sheet allows it now."""
        early = self.board.now - self.written_at < self.write_takes()
        self.written_at = self.board.now
        if early:
            self.record("sensor_write_too_early", address=address, value=value)
        elif self.bytes > 1 or address not in self.reset_values or address in self.read_only:
            self.record("sensor_reserved", access="write", address=address, value=value)
        else:
            self.write(address, value)

    def write_takes(self):
        """Returns the least time between two writes."""
        return 2 * US

    def configure(self, key, value):
        """Sets the oscillator, the identity, what the self-test finds, or motion."""
        self.catch_up()
        if key == "oscillator_error_percent":
            self.clocked(round(1_000_000 * (1 + value / 100)))
        elif key == "who_am_i":
            self.identity = value
        elif key == "self_test":
            self.passes = value
        else:
            self.motion.configure(key, value)

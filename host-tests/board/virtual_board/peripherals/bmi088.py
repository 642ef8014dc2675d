"""BMI088, an inertial sensor on SPI (BST-BMI088-DS001): two dies with a chip select, an oscillator and a FIFO each.

Recorded beside what `spi_part` records: `sensor_not_spi` (a write before the rising chip select that ends I2C), `sensor_self_test`
(without its settings).
Filters: a tone passes with the gain of a Butterworth low-pass of the second order at the data sheet's -3 dB, and is then sampled,
so frequencies above half the output rate alias. Slow motion passes unchanged, without delay.
Noise: white, of the data sheet's density within the filter's bandwidth.
Left out: I2C, interrupt pins, data-ready flags, watermarks, tags, down-sampling, offset of the self-test in the FIFO.
Assumed where the data sheet is silent: the order of the filters; a write to the gyro's FIFO_CONFIG_1 empties its FIFO, and a frame that
is read in part is lost (BMG160); B0 in ACC_SOFTRESET empties the accelerometer's (PX4); the gyro's self-test takes 20 ms; the byte that the
accelerometer sends before its data is A5; readings are 0 until 50 ms after the accelerometer was switched on.

Settings: those of `motion`, `oscillator_error_percent` of the gyro and `acc_oscillator_error_percent`, `who_am_i` of the gyro and
`acc_who_am_i`, `self_test` and `acc_self_test` (False: it fails).
"""

from .motion import Motion, clamp, words
from .spi_part import MS, PS, US, Die

#: Time between two writes with a suspended accelerometer; from power on to the next access.
SUSPENDED_PS, ON_PS = 1 * MS, 450 * US
ACC_RESET_PS, GYRO_RESET_PS, SETTLED_PS, BIST_PS = 1 * MS, 30 * MS, 50 * MS, 20 * MS
GYRO_NOISE_DPS, ACC_NOISE_G, NOISE_BANDWIDTH = 0.014, 175e-6, 1.11


class Gyro(Die):
    """The gyro (section 5.5); after power-on it runs."""

    name, identity, fifo_data, driven = "gyro", 0x0F, 0x3F, True
    reset_values = {0x00: 0x0F, **dict.fromkeys(range(0x02, 0x08), 0), 0x0A: 0, 0x0E: 0, 0x0F: 0, 0x10: 0x80, 0x11: 0, 0x14: 0, 0x15: 0,
                    0x16: 0x0F, 0x18: 0, 0x1E: 0, 0x34: 0, 0x3C: 0, 0x3D: 0, 0x3E: 0, 0x3F: 0}
    read_only = frozenset((0x00, *range(0x02, 0x08), 0x0A, 0x0E, 0x3F))
    #: Output rate and -3 dB bandwidth by the code in GYRO_BANDWIDTH.
    filters = {0: (2000, 532), 1: (2000, 230), 2: (1000, 116), 3: (400, 47), 4: (200, 23), 5: (100, 12), 6: (200, 64), 7: (100, 32)}

    def reset(self, takes):
        super().reset(takes)
        self.overrun, self.frame, self.tested_at = False, b"", None
        self.started = self.gyro_from = self.board.now + GYRO_RESET_PS

    def runs(self):
        """Returns True if the gyro is neither suspended nor starting."""
        return not self.registers[0x11] & 0xA0 and self.board.now >= self.gyro_from

    def rate_hz(self):
        """Returns the output rate."""
        return self.filters[self.registers[0x10] & 7][0]

    def bandwidth_hz(self):
        """Returns the -3 dB bandwidth."""
        return self.filters[self.registers[0x10] & 7][1]

    def output(self, at):
        """Makes a frame."""
        rates, _ = self.motion.truth(at)
        self.motion.swing(rates, at, self.gain)
        rates = self.motion.noisy(rates, GYRO_NOISE_DPS, self.bandwidth_hz() * NOISE_BANDWIDTH)
        frame = words([clamp(rate * 32768 / (2000 >> self.registers[0x0F]), 16) for rate in rates], "little")
        self.registers.update(zip(range(0x02, 0x08), frame))
        mode = self.registers[0x3E] >> 6
        if mode == 1 and len(self.fifo) == 100:
            self.overrun = True
            return
        if len(self.fifo) == (100 if mode else 1):
            self.overrun = self.overrun or mode == 2
            self.fifo.pop(0)
        self.fifo.append(frame)

    def deselect(self):
        if self.frame:
            self.board.record("fifo_partial_read", read=6 - len(self.frame))
            self.frame = b""
        super().deselect()

    def read(self, address):
        if address == 0x00:
            return self.identity
        if address == 0x0E:
            return self.overrun << 7 | len(self.fifo)
        if address == 0x3C:
            ready = self.tested_at is not None and self.board.now >= self.tested_at
            return (0x10 if self.driven else 0) | (0x02 | (0 if self.passes else 0x04) if ready else 0)
        if address == 0x3F:
            if not self.frame:
                self.frame = self.fifo.pop(0) if self.fifo else b""
            byte, self.frame = self.frame[:1], self.frame[1:]
            return byte[0] if byte else 0
        return self.registers.get(address, 0)

    def write(self, address, value):
        if address == 0x14:
            if value == 0xB6:
                self.reset(GYRO_RESET_PS)
            return
        if address == 0x0F and value > 4 or address == 0x10 and value & 0x7F > 7 or address == 0x11 and value not in (0, 0x20, 0x80):
            self.record("sensor_reserved", access="value", address=address, value=value)
            return
        if address == 0x3C:
            self.tested_at = self.board.now + BIST_PS if value & 1 else self.tested_at
            return
        self.registers[address] = value
        if address == 0x10:
            self.registers[address] |= 0x80
            self.restart()
            self.board.record("sensor_bandwidth", hz=self.bandwidth_hz())
        elif address == 0x3E:
            self.fifo, self.overrun, self.frame = [], False, b""


class Accelerometer(Die):
    """The accelerometer (section 5.3), which is suspended and off after power-on, and listens on I2C until its chip select has risen."""

    dummies = 1
    name, identity, fifo_data = "accelerometer", 0x1E, 0x26
    reset_values = {0x00: 0x1E, 0x02: 0, 0x03: 0, **dict.fromkeys(range(0x12, 0x1B), 0), 0x1D: 0, 0x22: 0, 0x23: 0, 0x24: 0, 0x25: 0, 0x26: 0,
                    0x40: 0xA8, 0x41: 0x01, 0x45: 0x80, 0x46: 0x02, 0x47: 0x00, 0x48: 0x02, 0x49: 0x10, 0x53: 0, 0x54: 0, 0x58: 0, 0x6D: 0,
                    0x7C: 0x03, 0x7D: 0x00, 0x7E: 0}
    read_only = frozenset((0x00, 0x02, 0x03, *range(0x12, 0x1B), 0x1D, *range(0x22, 0x27)))
    fifo_bytes = 1024
    #: Output rate by the low nibble of ACC_CONF (12.5 Hz is left out), -3 dB bandwidth by rate, for OSR4, OSR2 and normal.
    rates = {6: 25, 7: 50, 8: 100, 9: 200, 10: 400, 11: 800, 12: 1600}
    bandwidths = {25: (3, 5, 10), 50: (5, 9, 20), 100: (10, 18, 40), 200: (20, 38, 80), 400: (40, 75, 145), 800: (75, 140, 230),
                  1600: (145, 234, 280)}

    def reset(self, takes):
        super().reset(takes)
        self.epoch, self.on_at, self.deflected_at = self.board.now, None, 0
        self.spi, self.latch, self.over = False, 0, b""

    def runs(self):
        """Returns True if the accelerometer is on and not suspended."""
        return self.on_at is not None

    def write_takes(self):
        return super().write_takes() if self.runs() else SUSPENDED_PS

    def rate_hz(self):
        """Returns the output rate."""
        return self.rates[self.registers[0x40] & 15]

    def bandwidth_hz(self):
        """Returns the -3 dB bandwidth."""
        return self.bandwidths[self.rate_hz()][(self.registers[0x40] >> 4) - 8]

    def time(self, at):
        """Returns the counter of 39.0625 us."""
        return (at - self.epoch) * self.clock_ppm * 256 // (10 * MS * 1_000_000) & 0xFF_FFFF

    def output(self, at):
        """Makes a frame."""
        _, acceleration = self.motion.truth(at)
        acceleration = self.motion.noisy(acceleration, ACC_NOISE_G, self.bandwidth_hz() * NOISE_BANDWIDTH)
        if self.passes and self.registers[0x6D] and at >= self.deflected_at + SETTLED_PS:
            sign = 1 if self.registers[0x6D] == 0x0D else -1
            acceleration = [g + sign * extra for g, extra in zip(acceleration, (0.8, 0.8, 0.4))]
        scale = 32768 / (3 << (self.registers[0x41] & 3))
        settled = at >= self.on_at + SETTLED_PS
        frame = words([clamp(g * scale, 16) if settled else 0 for g in acceleration], "little")
        self.registers.update(zip(range(0x12, 0x18), frame))
        if self.registers[0x49] & 0x40:
            self.store(b"\x84" + frame)

    def store(self, frame):
        """Puts a frame into the FIFO, which is full or drops the oldest."""
        if sum(map(len, self.fifo)) + len(frame) > self.fifo_bytes:
            self.lost = min(self.lost + 1, 255)
            if self.registers[0x48] & 1:
                return
            self.fifo.pop(0)
            self.read_from = 0
        self.fifo.append(frame)

    def deselect(self):
        self.spi = self.spi or self.board.now >= self.answers_from
        # A frame that was read in part is given again.
        self.read_from, self.over = 0, b""
        super().deselect()

    def transfer(self, byte, mode, hz):
        if self.powered and not self.spi:
            if self.address is None:
                self.address, self.reading = byte & 0x7F, bool(byte & 0x80)
            elif not self.reading:
                self.record("sensor_not_spi", address=self.address, value=byte)
            return 0xFF
        if self.on_at is not None and self.board.now < self.on_at + ON_PS and self.address is not None:
            self.record("sensor_in_reset", address=self.address)
            return 0xFF
        return super().transfer(byte, mode, hz)

    def read(self, address):
        if address == 0x00:
            return self.identity
        if 0x18 <= address <= 0x1A:
            if address == 0x18:
                self.latch = self.time(self.board.now)
            return self.latch >> 8 * (address - 0x18) & 0xFF
        if address in (0x22, 0x23):
            code = round((self.motion.temperature - 23) * 8) << 5 & 0xFFFF
            return code >> 8 if address == 0x22 else code & 0xE0
        if address in (0x24, 0x25):
            waiting = sum(map(len, self.fifo)) + (2 if self.lost else 0) or 0x8000
            return waiting >> 8 * (address - 0x24) & 0xFF
        if address == 0x26:
            return self.read_fifo()
        return self.registers.get(address, 0)

    def read_fifo(self):
        """Returns the next byte: frames, then the time, then the mark of an empty FIFO."""
        if self.lost and not self.read_from:
            self.fifo.insert(0, bytes([0x40, self.lost]))
            self.lost = 0
        if not self.fifo:
            if not self.over:
                self.over = b"\x44" + self.time(self.board.now).to_bytes(3, "little") + b"\x80\x00" * 512
            byte, self.over = self.over[0], self.over[1:]
            return byte
        return self.next_byte()

    def write(self, address, value):
        if address == 0x7E:
            if value == 0xB6:
                self.reset(ACC_RESET_PS)
            elif value == 0xB0:
                self.fifo, self.lost, self.read_from = [], 0, 0
            return
        known = {0x40: value & 15 in self.rates and value >> 4 in (8, 9, 10), 0x41: value < 4, 0x48: value & 0xFE == 2,
                 0x49: value & 0xB3 == 0x10, 0x6D: value in (0, 9, 13), 0x7C: value in (0, 3), 0x7D: value in (0, 4)}
        if not known.get(address, True):
            self.record("sensor_reserved", access="value", address=address, value=value)
            return
        self.registers[address] = value
        if address in (0x7C, 0x7D):
            on = self.registers[0x7C] == 0 and self.registers[0x7D] == 4
            self.on_at = (self.board.now if self.on_at is None else self.on_at) if on else None
            self.restart()
        elif address == 0x6D:
            self.deflected_at = self.board.now
            if value and (self.registers[0x41] != 3 or self.registers[0x40] not in (0xA7, 0xAC)):
                self.record("sensor_self_test", range=self.registers[0x41], conf=self.registers[0x40])
        elif address in (0x40, 0x41):
            if self.registers[0x49] & 0x40:
                self.store(b"\x48\x02")
            if address == 0x40:
                self.restart()


class Bmi088:
    """The part: two dies that measure the same motion."""

    def __init__(self, board):
        self.motion = Motion(88)
        self.accelerometer, self.gyro = Accelerometer(board, self.motion), Gyro(board, self.motion)

    def configure(self, key, value):
        """Sets motion or a fault."""
        die = self.accelerometer if key.startswith("acc_") else self.gyro
        if key == "drive":
            die.driven = value
            return
        # Both measure the same motion.
        self.accelerometer.catch_up()
        die.configure(key.removeprefix("acc_"), value)

"""ASM330LHH, an inertial sensor on SPI.

Registers and bits are those of ST's platform-independent driver (asm330lhh-pid), and the parity of a tag that of ST's decoder of FIFOs.
Ranges, noise, limits of the self-test, FIFO and filters are those of the LSM6DSR's data sheet and of the table of bandwidths that it shares
with the LSM6DSO: parts of the same registers. DS13045 itself was not at hand.

Time: outputs, time stamps of 25 us and the measured deviation in INTERNAL_FREQ_FINE come from one oscillator.
Filters: a tone passes with the gain of a Butterworth low-pass of the second order at the table's -3 dB, and is then sampled, so frequencies
above half the output rate alias. Slow motion passes unchanged, without delay.
Noise: white, of the data sheet's density within the filter's bandwidth.
Left out: I2C, interrupts, embedded functions, the watermark, other rates than 208 Hz while both sensors run, batches at another rate than the
output's, and other modes than bypass, FIFO and continuous; each of the last is an error.
Assumed: after power on it answers after 10 ms, after a reset after 50 us; readings are 0 until 70 ms after the gyro was switched on, 20 ms the
accelerometer; a deflection is whole after 100 ms; an output writes rate, acceleration, temperature and time in this order; a word read in part
stays.

Settings: those of `spi_part`, `acc_self_test` (False: the accelerometer's fails), `freq_fine` (INTERNAL_FREQ_FINE, which the oscillator has).
"""

from fractions import Fraction

from ..violation import Violation
from .motion import Motion, clamp, words
from .spi_part import MS, PS, US, Die

RESET_PS, ON_PS, GYRO_START_PS, ACC_START_PS, DEFLECTED_PS = 50 * US, 10 * MS, 70 * MS, 20 * MS, 100 * MS
FIFO_WORDS = 3072 // 7
GYRO_NOISE_DPS, ACC_NOISE_G, NOISE_BANDWIDTH = 0.005, 60e-6, 1.11
#: deg/s and g of a count, by the bits of the range; what the self-test deflects.
DPS = {0: 0.00875, 2: 0.004375, 4: 0.0175, 8: 0.035, 12: 0.070, 1: 0.140}
G = {0: 61e-6, 1: 488e-6, 2: 122e-6, 3: 244e-6}
DEFLECTION_DPS, DEFLECTION_G = 400, 0.3
#: Gyro's -3 dB at 208 Hz by FTYPE, and divider of the output rate by HPCF_XL.
BANDWIDTHS = (67.0, 67.0, 67.0, 67.0, 62.4, 43.2, 23.1, 12.2)
DIVIDERS = (4, 10, 20, 45, 100, 200, 400, 800)
CTRL1_XL, CTRL2_G, CTRL3_C, CTRL4_C, CTRL5_C, CTRL6_C = range(0x10, 0x16)
FIFO_CTRL3, FIFO_CTRL4, CTRL8_XL, CTRL10_C, FREQ_FINE, TAG, LAST = 0x09, 0x0A, 0x17, 0x19, 0x63, 0x78, 0x7E
#: Bits of each register that may be written; the others keep their reset values.
WRITABLE = {0x02: 0x40, 0x07: 0xFF, 0x08: 0x91, 0x09: 0xFF, 0x0A: 0xF7, 0x0B: 0xE3, 0x0C: 0xFF, 0x0D: 0xFF, 0x0E: 0x7F, 0x10: 0xFE, 0x11: 0xFF,
            0x12: 0xFD, 0x13: 0x6E, 0x14: 0x6F, 0x15: 0xEF, 0x16: 0x72, 0x17: 0xFD, 0x18: 0xFE, 0x19: 0x20, 0x42: 0xFF, 0x56: 0x71, 0x58: 0xE0,
            0x59: 0xE0, 0x5B: 0x7F, 0x5C: 0xFF, 0x5D: 0xFF, 0x5E: 0xB4, 0x5F: 0xB7, 0x73: 0xFF, 0x74: 0xFF, 0x75: 0xFF}


class Asm330lhh(Die):
    """The part."""

    name, identity = "asm330lhh", 0x6B
    reset_values = {**dict.fromkeys(WRITABLE, 0), 0x0F: 0x6B, **dict.fromkeys((0x1A, 0x1B, 0x1D, 0x1E), 0), **dict.fromkeys(range(0x20, 0x2E), 0),
                    0x3A: 0, 0x3B: 0, **dict.fromkeys(range(0x40, 0x44), 0), 0x63: 0, **dict.fromkeys(range(0x78, 0x7F), 0), 0x02: 0x3F,
                    0x12: 0x04, 0x18: 0xE0}
    read_only = frozenset(reset_values.keys() - WRITABLE.keys())

    def __init__(self, board):
        self.fine, self.drift, self.acc_passes = 0, 0.0, True
        super().__init__(board, Motion(330))

    def power_on(self):
        super().power_on()
        self.answers_from = self.board.now + ON_PS

    def reset(self, takes):
        super().reset(takes)
        self.registers[FREQ_FINE] = self.fine & 0xFF
        self.gyro_on = self.acc_on = None
        self.deflected_at = self.epoch = self.board.now
        self.number, self.overrun = 0, False

    def write_takes(self):
        return 0

    # -- outputs -----------------------------------------------------------------------------------------------------

    def runs(self):
        """Returns True if both sensors are on."""
        return self.gyro_on is not None and self.acc_on is not None

    def rate_hz(self):
        """Returns the output rate, by which the outputs of both sensors come."""
        codes = {self.registers[CTRL1_XL] >> 4, self.registers[CTRL2_G] >> 4}
        if codes != {5}:
            raise Violation(f"ASM330LHH: output rates of codes {codes} are not modelled")
        return Fraction(625, 3)

    def bandwidth_hz(self):
        """Returns the gyro's -3 dB bandwidth."""
        return BANDWIDTHS[self.registers[CTRL6_C] & 7 if self.registers[CTRL4_C] & 0x02 else 0]

    def time_stamp(self, at):
        """Returns the counter of 25 us, which runs on the part's oscillator."""
        return (at - self.epoch) * self.clock_ppm // (25 * US * 1_000_000) & 0xFFFF_FFFF

    def output(self, at):
        """Makes the readings of both sensors."""
        registers = self.registers
        rates, acceleration = self.motion.truth(at)
        self.motion.swing(rates, at, self.gain)
        rates = self.motion.noisy(rates, GYRO_NOISE_DPS, self.bandwidth_hz() * NOISE_BANDWIDTH)
        hz = float(self.rate_hz())
        bandwidth = hz / DIVIDERS[registers[CTRL8_XL] >> 5] if registers[CTRL1_XL] & 0x02 else hz / 2
        acceleration = self.motion.noisy(acceleration, ACC_NOISE_G, bandwidth * NOISE_BANDWIDTH)
        if at >= self.deflected_at + DEFLECTED_PS:
            gyro = {1: DEFLECTION_DPS, 3: -DEFLECTION_DPS}.get(registers[CTRL5_C] >> 2 & 3, 0) * self.passes
            acc = {1: DEFLECTION_G, 2: -DEFLECTION_G}.get(registers[CTRL5_C] & 3, 0) * self.acc_passes
            rates, acceleration = [rate + gyro for rate in rates], [g + acc for g in acceleration]
        dps, g = DPS[registers[CTRL2_G] & 15], G[registers[CTRL1_XL] >> 2 & 3]
        rate = words([clamp(rate / dps, 16) if at >= self.gyro_on + GYRO_START_PS else 0 for rate in rates], "little")
        force = words([clamp(a / g, 16) if at >= self.acc_on + ACC_START_PS else 0 for a in acceleration], "little")
        temperature = words([clamp((self.motion.temperature - 25) * 256, 16)], "little")
        registers.update(zip(range(0x20, 0x2E), temperature + rate + force))
        if registers[FIFO_CTRL4] & 7:
            self.batch(rate, force, temperature, self.time_stamp(at).to_bytes(4, "little"))

    def batch(self, rate, force, temperature, stamp):
        """Puts an output into the FIFO."""
        control = self.registers[FIFO_CTRL4]
        if self.registers[FIFO_CTRL3] != 0x55 or control >> 6 != 1 or not self.registers[CTRL10_C] & 0x20 or control >> 4 & 3 not in (0, 3):
            raise Violation("ASM330LHH: only batches of each output, with its time and with temperatures of 52 Hz or none, are modelled")
        self.number = self.number + 1 & 3
        self.store(1, rate)
        self.store(2, force)
        if control >> 4 & 3 and self.number == 0:
            self.store(3, temperature + bytes(4))
        self.store(4, stamp + bytes(2))

    def store(self, sensor, data):
        """Puts a word into the FIFO, which is full or drops the oldest."""
        if len(self.fifo) == FIFO_WORDS:
            self.overrun = True
            if self.registers[FIFO_CTRL4] & 7 == 1:
                return
            self.fifo.pop(0)
            self.read_from = 0
        tag = sensor << 3 | self.number << 1
        self.fifo.append(bytes([tag | tag.bit_count() & 1]) + data)

    # -- serial interface --------------------------------------------------------------------------------------------

    def after(self, address):
        return TAG if address == LAST else address + 1 & 0x7F

    def read(self, address):
        if address == 0x0F:
            return self.identity
        if address in (0x3A, 0x3B):
            if address == 0x3A:
                return len(self.fifo) & 0xFF
            full, overrun, self.overrun = len(self.fifo) == FIFO_WORDS, self.overrun, False
            return len(self.fifo) >> 8 | (0x48 if overrun else 0) | (0x20 if full else 0)
        if 0x40 <= address <= 0x43:
            return self.time_stamp(self.board.now) >> 8 * (address - 0x40) & 0xFF if self.registers[CTRL10_C] & 0x20 else 0
        if TAG <= address <= LAST:
            if not self.fifo:
                return 0
            self.read_from = address - TAG
            return self.next_byte()
        if address not in self.reset_values:
            self.record("sensor_reserved", access="read", address=address)
        return self.registers.get(address, 0)

    def write(self, address, value):
        if (value ^ self.reset_values[address]) & ~WRITABLE[address]:
            self.record("sensor_reserved", access="value", address=address, value=value)
            return
        if address == CTRL3_C and value & 0x01:
            self.reset(RESET_PS)
            return
        if address == 0x42:
            self.epoch = self.board.now if value == 0xAA else self.epoch
            return
        old, self.registers[address] = self.registers[address], value
        if address == CTRL10_C and value & ~old & 0x20:
            self.epoch = self.board.now
        elif address in (CTRL1_XL, CTRL2_G):
            self.switch()
            if (old ^ value) & 0xF0:
                self.restart()
        elif address == CTRL5_C:
            self.deflected_at = self.board.now
            if value and (self.registers[CTRL1_XL] >> 2 & 3, self.registers[CTRL2_G] & 15) != (2, 12):
                self.record("sensor_self_test", xl=self.registers[CTRL1_XL], g=self.registers[CTRL2_G])
        elif address == FIFO_CTRL4:
            if value & 7 not in (0, 1, 6):
                raise Violation(f"ASM330LHH: FIFO mode {value & 7} is not modelled")
            if not value & 7:
                self.fifo, self.read_from, self.overrun = [], 0, False
            elif not old & 7:
                self.board.record("sensor_bandwidth", hz=self.bandwidth_hz())

    def switch(self):
        """Switches the sensors by their output rates."""
        gyro, acc, now = self.registers[CTRL2_G] >> 4, self.registers[CTRL1_XL] >> 4, self.board.now
        self.gyro_on = (now if self.gyro_on is None else self.gyro_on) if gyro else None
        self.acc_on = (now if self.acc_on is None else self.acc_on) if acc else None

    def configure(self, key, value):
        if key in ("freq_fine", "oscillator_error_percent"):
            if key == "freq_fine":
                self.fine = value
                self.registers[FREQ_FINE] = value & 0xFF
            else:
                self.drift = value
            self.clocked(round(1_000_000 * (1 + 0.0015 * self.fine) * (1 + self.drift / 100)))
        elif key == "acc_self_test":
            self.acc_passes = value
        else:
            super().configure(key, value)

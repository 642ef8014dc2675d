"""ICM-42688-P, an inertial sensor on SPI (DS-000347): registers, power modes, FIFO, time stamps and its own oscillator.

Samples are read from the FIFO, in packets of 20 bits, big-endian, in stream mode.

Time: the part runs on its own oscillator, `oscillator_error_percent` fast. Without CLKIN its time stamps count units of 32/30 us
(section 12.7).
Filters: a tone passes the UI filter of GYRO_ACCEL_CONFIG0 with the gain of a Butterworth low-pass of the order in GYRO_CONFIG1
(section 5.5) and is then sampled, so frequencies above half the output rate alias. Slow motion passes unchanged, without delay.
Noise: white, of the data sheet's density (tables 1 and 2) within the filter's bandwidth, times `noise`.
Left out: data registers, other packets, interrupts, anti-alias and notch filters, their delay, I2C and I3C, APEX, FSYNC, self-test,
automatic full-scale switching (AFSR), different output rates of the two sensors, and all of them but 100, 200 and 1000 Hz.
Assumed where the data sheet is silent: accesses within 1 ms of a reset read 0 and write nothing; a write within 200 us of leaving OFF is
ignored; packets hold the low 16 bits of the time-stamp counter.

Settings: those of `motion`, `oscillator_error_percent`, `who_am_i`.
"""

from ..violation import Violation
from . import icm42688_registers as reg
from .motion import Motion, clamp, words
from .spi_part import MS, US, Die

RESET_PS, SWITCH_ON_PS, GYRO_START_PS, ACCEL_START_PS = 1 * MS, 200 * US, 30 * MS, 10 * MS
FIFO_BYTES = 2048
OUTPUT_HERTZ = {6: 1000, 7: 200, 8: 100}
BANDWIDTH_DIVIDER = {1: 4, 2: 5, 3: 8, 4: 10, 5: 16, 6: 20, 7: 40}
INVALID = -0x80000
GYRO_NOISE_DPS, ACCEL_NOISE_G = 0.0028, 70e-6
#: Noise bandwidth of a second-order Butterworth low-pass by its 3 dB bandwidth.
NOISE_BANDWIDTH = 1.11


class Icm42688(Die):
    """The part with its five register banks."""

    name, identity, max_hz = "icm42688", 0x47, 24_000_000

    def __init__(self, board):
        super().__init__(board, Motion(42688))

    # -- power and reset (sections 3.2, 4.16 and 14.1) ----------------------------------------------------------------

    def reset(self, takes):
        super().reset(RESET_PS)
        self.banks = [dict(bank) for bank in reg.RESET_VALUES]
        self.bank = 0
        self.locked_until = 0
        self.gyro_on = self.accel_on = None
        self.epoch = self.board.now
        self.count_latch = 0

    def runs(self):
        """Returns True if a sensor is on."""
        return self.gyro_on is not None or self.accel_on is not None

    # -- time --------------------------------------------------------------------------------------------------------

    def rate_hz(self):
        """Returns the output rate: the gyro's while it is on, otherwise the accelerometer's."""
        code = self.banks[0][reg.ACCEL_CONFIG0 if self.gyro_on is None else reg.GYRO_CONFIG0] & 15
        if code not in OUTPUT_HERTZ:
            raise Violation(f"ICM-42688-P: the output rate of code {code} is not modelled")
        return OUTPUT_HERTZ[code]

    def time_stamp(self, at):
        """Returns the time-stamp counter in units of 32/30 us (section 12.7)."""
        return (at - self.epoch) * 30 * self.clock_ppm // (32 * US * 1_000_000)

    # -- outputs -----------------------------------------------------------------------------------------------------

    def bandwidth_hz(self):
        """Returns the gyro's 3 dB bandwidth by GYRO_UI_FILT_BW in low-noise mode (section 14.42)."""
        code = self.banks[0][reg.GYRO_ACCEL_CONFIG0] & 15
        if code not in BANDWIDTH_DIVIDER:
            raise Violation(f"ICM-42688-P: the bandwidth of code {code} is not modelled")
        return max(400.0, self.rate_hz()) / BANDWIDTH_DIVIDER[code]

    def gain(self, hz):
        """Returns the gain of the last filter."""
        order = 1 + (self.banks[0][reg.GYRO_CONFIG1] >> 2 & 3)
        return (1 + (hz / self.bandwidth_hz()) ** (2 * order)) ** -0.5

    def output(self, at):
        """Makes a packet."""
        rates, acceleration = self.motion.truth(at)
        self.motion.swing(rates, at, self.gain)
        bandwidth = self.bandwidth_hz() * NOISE_BANDWIDTH
        rates = self.motion.noisy(rates, GYRO_NOISE_DPS, bandwidth)
        acceleration = self.motion.noisy(acceleration, ACCEL_NOISE_G, bandwidth)
        gyro_valid = self.gyro_on is not None and at >= self.gyro_on + GYRO_START_PS
        accel_valid = self.accel_on is not None and at >= self.accel_on + ACCEL_START_PS
        if self.banks[0][reg.FIFO_CONFIG] >> 6:
            gyro = [clamp(rate * 131, 19) << 1 if gyro_valid else INVALID for rate in rates]
            accel = [clamp(g * 8192, 18) << 2 if accel_valid else INVALID for g in acceleration]
            self._store(accel, gyro, (self.time_stamp(at) & 0xFFFF).to_bytes(2, "big"))

    def _store(self, accel, gyro, stamp):
        """Puts packet 4 of section 6.1 into the FIFO, which drops the oldest where it is full."""
        if self.banks[0][reg.FIFO_CONFIG1] & 0x17 != 0x17 or self.banks[0][reg.INTF_CONFIG0] & 0x70 != 0x30:
            raise Violation("ICM-42688-P: only packets of 20 bits, big-endian and counted in bytes, are modelled")
        temperature = clamp((self.motion.temperature - 25) * 132.48, 16).to_bytes(2, "big", signed=True)
        extension = bytes((a & 15) << 4 | g & 15 for a, g in zip(accel, gyro))
        packet = b"\x78" + words([value >> 4 for value in accel + gyro], "big") + temperature + stamp + extension
        if (len(self.fifo) + 1) * len(packet) > FIFO_BYTES:
            self.fifo.pop(0)
            self.read_from = 0
        self.fifo.append(packet)

    # -- serial interface (section 9) --------------------------------------------------------------------------------

    def after(self, address):
        return address if address == reg.FIFO_DATA and self.bank == 0 else address + 1 & 0x7F

    def read(self, address):
        if address == reg.REG_BANK_SEL:
            return self.bank
        if self.bank:
            return self._stored(address)
        if address == reg.FIFO_DATA:
            return self.next_byte() if self.fifo else 0xFF
        if address == reg.FIFO_COUNTH:
            # It latches both bytes (section 14.28).
            self.count_latch = sum(map(len, self.fifo)) - self.read_from
            return self.count_latch >> 8
        if address == reg.FIFO_COUNTL:
            return self.count_latch & 0xFF
        if address == reg.WHO_AM_I:
            return self.identity
        return self._stored(address)

    def _stored(self, address):
        if self.bank == 0 and address in reg.LEFT_OUT:
            raise Violation(f"ICM-42688-P: register {address:#x} is not modelled")
        if address not in self.banks[self.bank]:
            self.board.record("sensor_reserved", bank=self.bank, address=address, access="read")
        return self.banks[self.bank].get(address, 0)

    def may_write(self, address, value):
        if self.board.now < self.locked_until:
            self.board.record("sensor_write_too_early", address=address, value=value)
            return
        if address == reg.REG_BANK_SEL:
            self.bank = min(value & 7, 4)
            return
        bank = self.banks[self.bank]
        if self.bank == 0 and address in reg.LEFT_OUT:
            raise Violation(f"ICM-42688-P: register {address:#x} is not modelled")
        if address not in bank or self.bank == 0 and address in reg.READ_ONLY:
            self.board.record("sensor_reserved", bank=self.bank, address=address, access="write", value=value)
            return
        old, bank[address] = bank[address], value
        if self.bank:
            return
        if address == reg.DEVICE_CONFIG:
            if value & 1:
                self.reset(RESET_PS)
        elif address == reg.PWR_MGMT0:
            self._power_modes(value)
        elif address == reg.SIGNAL_PATH_RESET:
            bank[address] = 0
            if value != 2:
                raise Violation(f"ICM-42688-P: SIGNAL_PATH_RESET {value:#x} is not modelled")
            self.fifo, self.read_from = [], 0
        elif address in (reg.GYRO_CONFIG0, reg.ACCEL_CONFIG0):
            if (old ^ value) & 15:
                self.restart()
        elif address == reg.FIFO_CONFIG:
            if value >> 6 > 1:
                raise Violation("ICM-42688-P: a FIFO that stops when it is full is not modelled")
            if not value >> 6:
                self.fifo, self.read_from = [], 0
        elif address == reg.GYRO_ACCEL_CONFIG0:
            self.board.record("sensor_bandwidth", hz=self.bandwidth_hz())

    def _power_modes(self, value):
        """Switches the sensors by PWR_MGMT0; no register may be written for 200 us after leaving OFF (section 14.36)."""
        now = self.board.now
        was_off = self.gyro_on is None and self.accel_on is None
        gyro, accel = value >> 2 & 3 == 3, value & 3 >= 2
        self.gyro_on = (now if self.gyro_on is None else self.gyro_on) if gyro else None
        self.accel_on = (now if self.accel_on is None else self.accel_on) if accel else None
        if was_off and (gyro or accel):
            self.locked_until = now + SWITCH_ON_PS
        self.restart()

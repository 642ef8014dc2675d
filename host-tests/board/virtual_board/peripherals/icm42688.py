"""ICM-42688-P, an inertial sensor on SPI (DS-000347): registers, power modes, FIFO, time stamps and its own oscillator.

Samples are computed on demand: each access computes those that are due. If the INT1 pin is wired, each sample is an event
instead. The part keeps its state through a reset of the microcontroller and loses it with the power.

Time: the part runs on its own oscillator, `oscillator_error_percent` fast. Without CLKIN its time stamps count units of 32/30 us
(section 12.7), or sixteen times that with TMST_RES.
Filters: a tone passes the UI filter of GYRO_ACCEL_CONFIG0 with the gain of a Butterworth low-pass of the order in GYRO_CONFIG1
(section 5.5) and is then sampled, so frequencies above half the output rate alias. Slow motion passes unchanged, without delay.
Noise: white, of the data sheet's density (tables 1 and 2) within the filter's bandwidth, times `noise`.
Left out: anti-alias and notch filters, their delay, I2C and I3C, APEX, FSYNC, self-test, INT2, automatic full-scale switching
(AFSR), different output rates of the two sensors.
Assumed where the data sheet is silent: accesses within 1 ms of a reset read 0 and write nothing; a write within 200 us of leaving OFF is
ignored; packets hold the low 16 bits of the time-stamp counter.

Settings: those of `motion`, `oscillator_error_percent`, `int1` ([port letter, pin] or None), `who_am_i`.
"""

from . import icm42688_registers as reg
from .motion import Motion, clamp, words

PS = 1_000_000_000_000
US, MS = 1_000_000, 1_000_000_000
RESET_PS, SWITCH_ON_PS, GYRO_START_PS, ACCEL_START_PS = 1 * MS, 200 * US, 30 * MS, 10 * MS
FIFO_BYTES = 2048
OUTPUT_MILLIHERTZ = {1: 32_000_000, 2: 16_000_000, 3: 8_000_000, 4: 4_000_000, 5: 2_000_000, 6: 1_000_000, 7: 200_000, 8: 100_000,
                     9: 50_000, 10: 25_000, 11: 12_500, 12: 6_250, 13: 3_125, 14: 1_562, 15: 500_000}
BANDWIDTH_DIVIDER = {1: 4, 2: 5, 3: 8, 4: 10, 5: 16, 6: 20, 7: 40}
INVALID = -32768
GYRO_NOISE_DPS, ACCEL_NOISE_G = 0.0028, 70e-6
#: Noise bandwidth of a second-order Butterworth low-pass by its 3 dB bandwidth.
NOISE_BANDWIDTH = 1.11


class Icm42688:
    """The part with its five register banks; the SPI calls `select`, `transfer` and `deselect`."""

    def __init__(self, board):
        self.board = board
        self.motion = Motion(42688)
        self.clock_ppm = 1_000_000
        self.int1 = None
        self.reading = False
        self.identity = 0x47
        self.event = None
        self.powered = True
        self._reset(0)

    # -- power and reset (sections 4.16 and 14.1) --------------------------------------------------------------------

    def power_on(self):
        """Handles power-on; registers answer after 1 ms (section 3.2)."""
        self.powered = True
        self._reset(self.board.now)

    def power_off(self):
        """Handles the loss of power."""
        self.powered = False
        self.event = None

    def _reset(self, now):
        self.banks = [dict(bank) for bank in reg.RESET_VALUES]
        self.bank = 0
        self.answers_from = now + RESET_PS
        self.locked_until = 0
        self.gyro_on = self.accel_on = None
        self.started, self.made, self.motion.stopped = now, 0, False
        self.epoch = now
        self.status = reg.RESET_DONE
        self.data = {**{address: 0x80 for address in reg.DATA[::2]}, **{address: 0 for address in reg.DATA[1::2]}}
        self.fifo, self.read_from = [], 0
        self.lost = 0
        self.count_latch = 0
        self.address = None
        if self.event:
            self.event.cancel()
            self.event = None

    # -- time --------------------------------------------------------------------------------------------------------

    def _output_code(self):
        """Returns the code of the output rate: the gyro's while it is on, otherwise the accelerometer's."""
        bank = self.banks[0]
        if self.gyro_on is not None:
            return bank[reg.GYRO_CONFIG0] & 15
        return bank[reg.ACCEL_CONFIG0] & 15

    def _sample_time(self, index):
        """Returns the board time of an output, counted since the rate was last set."""
        rate = OUTPUT_MILLIHERTZ.get(self._output_code(), 1_000_000) * self.clock_ppm
        return self.started + index * PS * 1_000_000_000 // rate

    def time_stamp(self, at):
        """Returns the time-stamp counter in units of 32/30 us, or 16 times that (section 12.7)."""
        config = self.banks[0][reg.TMST_CONFIG]
        if not config & 1:
            return 0
        unit = 16 if config & 8 else 1
        return (at - self.epoch) * 30 * self.clock_ppm // (32 * US * 1_000_000 * unit)

    def _restart(self):
        """Restarts the outputs after a change of rate or mode: the next one is due one period from now."""
        self.started, self.made = self.board.now, 0
        self._plan()

    def _catch_up(self):
        """Computes all outputs that are due."""
        if self.gyro_on is None and self.accel_on is None:
            return
        now = self.board.now
        while self._sample_time(self.made + 1) <= now:
            self.made += 1
            if not self.motion.stopped:
                self._output(self._sample_time(self.made))

    def _plan(self):
        """Schedules the next output as an event if INT1 is wired."""
        if self.event:
            self.event.cancel()
            self.event = None
        if self.int1 and self.powered and (self.gyro_on is not None or self.accel_on is not None):
            self.event = self.board.schedule(max(self._sample_time(self.made + 1) - self.board.now, 0), self._due)

    def _due(self):
        self.event = None
        self._catch_up()
        self._plan()

    # -- outputs -----------------------------------------------------------------------------------------------------

    def bandwidth_hz(self):
        """Returns the gyro's 3 dB bandwidth by GYRO_UI_FILT_BW in low-noise mode (section 14.42)."""
        code = self.banks[0][reg.GYRO_ACCEL_CONFIG0] & 15
        rate = OUTPUT_MILLIHERTZ.get(self.banks[0][reg.GYRO_CONFIG0] & 15, 1_000_000) / 1000
        if code == 0:
            return rate / 2
        if code in BANDWIDTH_DIVIDER:
            return max(400.0, rate) / BANDWIDTH_DIVIDER[code]
        return max(400.0, rate) if code == 14 else max(200.0, 8 * rate)

    def _gain(self, hz):
        order = 1 + (self.banks[0][reg.GYRO_CONFIG1] >> 2 & 3)
        return (1 + (hz / self.bandwidth_hz()) ** (2 * order)) ** -0.5

    def _output(self, at):
        rates, acceleration = self.motion.truth(at)
        self.motion.swing(rates, at, self._gain)
        bandwidth = self.bandwidth_hz() * NOISE_BANDWIDTH
        rates = self.motion.noisy(rates, GYRO_NOISE_DPS, bandwidth)
        acceleration = self.motion.noisy(acceleration, ACCEL_NOISE_G, bandwidth)
        gyro_valid = self.gyro_on is not None and at >= self.gyro_on + GYRO_START_PS
        accel_valid = self.accel_on is not None and at >= self.accel_on + ACCEL_START_PS
        bank = self.banks[0]
        gyro_scale = 32768 / (2000 / (1 << (bank[reg.GYRO_CONFIG0] >> 5)))
        accel_scale = 2048 << (bank[reg.ACCEL_CONFIG0] >> 5 & 3)
        gyro = [clamp(rate * gyro_scale, 16) if gyro_valid else INVALID for rate in rates]
        accel = [clamp(g * accel_scale, 16) if accel_valid else INVALID for g in acceleration]
        temperature = clamp((self.motion.temperature - 25) * 132.48, 16)
        big = bool(bank[reg.INTF_CONFIG0] & 0x10)
        for address, value in zip(reg.DATA[::2], (temperature, *accel, *gyro)):
            high, low = value >> 8 & 0xFF, value & 0xFF
            self.data[address], self.data[address + 1] = (high, low) if big else (low, high)
        self.status |= reg.DATA_READY
        if bank[reg.FIFO_CONFIG] >> 6:
            self._store(at, rates, acceleration, gyro, accel, gyro_valid, accel_valid, big)
        self._drive_int1()

    def _store(self, at, rates, acceleration, gyro, accel, gyro_valid, accel_valid, big):
        config = self.banks[0][reg.FIFO_CONFIG1]
        with_accel, with_gyro, fine = config & 1, config & 2, config & 0x10
        if not with_accel and not with_gyro:
            return
        order = "big" if big else "little"
        stamped = self.banks[0][reg.TMST_CONFIG] & 1
        header = (0x40 if with_accel else 0) | (0x20 if with_gyro else 0) | (0x10 if fine else 0) | (8 if stamped else 0)
        stamp = (self.time_stamp(at) & 0xFFFF).to_bytes(2, order)
        coarse_temperature = (clamp((self.motion.temperature - 25) * 2.07, 8)).to_bytes(1, "little", signed=True)
        if fine:
            gyro = [clamp(rate * 131, 19) << 1 if gyro_valid else -0x80000 for rate in rates]
            accel = [clamp(g * 8192, 18) << 2 if accel_valid else -0x80000 for g in acceleration]
            temperature = clamp((self.motion.temperature - 25) * 132.48, 16).to_bytes(2, order, signed=True)
            extension = bytes((a & 15) << 4 | g & 15 for a, g in zip(accel, gyro))
            packet = words([value >> 4 for value in accel + gyro], order) + temperature + stamp + extension
            packet = bytes([header | 0x60]) + packet
        elif with_accel and with_gyro:
            packet = bytes([header]) + words(accel + gyro, order) + coarse_temperature + stamp
        else:
            packet = bytes([header & ~8]) + words(accel if with_accel else gyro, order) + coarse_temperature
        if (len(self.fifo) + 1) * len(packet) > FIFO_BYTES:
            self.lost = min(self.lost + 1, 0xFFFF)
            self.status |= reg.FIFO_FULL
            if self.banks[0][reg.FIFO_CONFIG] >> 6 != 1:
                return
            self.fifo.pop(0)
            self.read_from = 0
        self.fifo.append(packet)
        if self._count() >= (self.banks[0][reg.FIFO_CONFIG2] | (self.banks[0][reg.FIFO_CONFIG3] & 15) << 8) > 0:
            self.status |= reg.FIFO_THRESHOLD

    def _count(self):
        """Returns the count in FIFO_COUNT: bytes, or records with FIFO_COUNT_REC."""
        if self.banks[0][reg.INTF_CONFIG0] & 0x40:
            return len(self.fifo)
        return sum(map(len, self.fifo)) - self.read_from

    def _drive_int1(self):
        if not self.int1:
            return
        active = bool(self.status & self.banks[0][reg.INT_SOURCE0])
        high = active == bool(self.banks[0][reg.INT_CONFIG] & 1)
        self.board.peripherals["GPIO" + self.int1[0]].configure("drive", (self.int1[1], high))
        if active and not self.banks[0][reg.INT_CONFIG] & 4:
            self.board.schedule(100 * US, self._end_pulse)

    def _end_pulse(self):
        """Ends a pulsed interrupt after 100 us (8 us with INT_TPULSE_DURATION, which the model does not distinguish; section 14.52)."""
        if self.int1:
            idle = not self.banks[0][reg.INT_CONFIG] & 1
            self.board.peripherals["GPIO" + self.int1[0]].configure("drive", (self.int1[1], idle))

    # -- serial interface (section 9) --------------------------------------------------------------------------------

    def select(self):
        """Handles a falling CS: the next byte is an address."""
        self.address = None

    def deselect(self):
        """Handles a rising CS: a packet that was read in part is kept whole, unless reading may resume."""
        if self.read_from and not self.banks[0][reg.FIFO_CONFIG1] & 0x40:
            self.board.record("fifo_partial_read", read=self.read_from)
            self.read_from = 0
        self.address = None

    def transfer(self, byte, mode, hz):
        """Transfers one byte in each direction."""
        if not self.powered:
            return 0xFF
        inverted = bool(self.banks[0][reg.DEVICE_CONFIG] & 0x10)
        if (mode[0] != mode[1]) != inverted or hz > 24_000_000:
            self.board.record("spi_unreadable", mode=list(mode), hz=hz)
            return 0xFF
        if self.address is None:
            self.address, self.reading = byte & 0x7F, bool(byte & 0x80)
            self._catch_up()
            return 0xFF
        address = self.address
        if not (address == reg.FIFO_DATA and self.bank == 0):
            self.address = address + 1 & 0x7F
        if self.board.now < self.answers_from:
            self.board.record("sensor_in_reset", address=address)
            return 0
        if self.reading:
            return self._read(address)
        self._write(address, byte)
        return 0xFF

    def _read(self, address):
        if address == reg.REG_BANK_SEL:
            return self.bank
        if self.bank:
            return self._stored(address)
        if address == reg.FIFO_DATA:
            return self._read_fifo()
        if address in self.data:
            return self.data[address]
        if address == reg.INT_STATUS:
            value, self.status = self.status, 0
            if self.int1 and self.banks[0][reg.INT_CONFIG] & 4:
                self._end_pulse()
            return value
        if address in (reg.FIFO_COUNTH, reg.FIFO_COUNTL):
            return self._read_count(address)
        if address == reg.FIFO_LOST_PKT0:
            return self.lost & 0xFF
        if address == reg.FIFO_LOST_PKT1:
            value, self.lost = self.lost >> 8, 0
            return value
        if address == reg.WHO_AM_I:
            return self.identity
        return self._stored(address)

    def _stored(self, address):
        if address not in self.banks[self.bank]:
            self.board.record("sensor_reserved", bank=self.bank, address=address, access="read")
        return self.banks[self.bank].get(address, 0)

    def _read_count(self, address):
        """Reads FIFO_COUNTH, which latches both bytes, or FIFO_COUNTL (section 14.28)."""
        if address == reg.FIFO_COUNTH:
            self.count_latch = self._count()
        big = bool(self.banks[0][reg.INTF_CONFIG0] & 0x20)
        high = (address == reg.FIFO_COUNTH) == big
        return self.count_latch >> 8 if high else self.count_latch & 0xFF

    def _read_fifo(self):
        if not self.fifo:
            return 0xFF
        packet = self.fifo[0]
        byte = packet[self.read_from]
        self.read_from += 1
        if self.read_from == len(packet):
            self.fifo.pop(0)
            self.read_from = 0
        return byte

    def _write(self, address, value):
        if self.board.now < self.locked_until:
            self.board.record("sensor_write_too_early", address=address, value=value)
            return
        if address == reg.REG_BANK_SEL:
            self.bank = min(value & 7, 4)
            return
        bank = self.banks[self.bank]
        if address not in bank or self.bank == 0 and address in reg.READ_ONLY:
            self.board.record("sensor_reserved", bank=self.bank, address=address, access="write", value=value)
            return
        old, bank[address] = bank[address], value
        if self.bank:
            return
        if address == reg.DEVICE_CONFIG:
            if value & 1:
                self._reset(self.board.now)
        elif address == reg.PWR_MGMT0:
            self._power_modes(value)
        elif address == reg.SIGNAL_PATH_RESET:
            self._signal_path(value)
            bank[address] = 0
        elif address in (reg.GYRO_CONFIG0, reg.ACCEL_CONFIG0):
            if (old ^ value) & 15:
                self._restart()
        elif address == reg.FIFO_CONFIG and not value >> 6:
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
        self._restart()

    def _signal_path(self, value):
        if value & 2:
            self.fifo, self.read_from = [], 0
            self.status &= ~(reg.FIFO_FULL | reg.FIFO_THRESHOLD)
        if value & 4:
            stamp = self.time_stamp(self.board.now)
            self.banks[1][reg.TMSTVAL0] = stamp & 0xFF
            self.banks[1][reg.TMSTVAL0 + 1] = stamp >> 8 & 0xFF
            self.banks[1][reg.TMSTVAL0 + 2] = stamp >> 16 & 15
        if value & 8:
            self._restart()

    # -- environment -------------------------------------------------------------------------------------------------

    def configure(self, key, value):
        """Sets motion or a fault."""
        if self.powered:
            self._catch_up()
        if key == "oscillator_error_percent":
            self.clock_ppm = round(1_000_000 * (1 + value / 100))
            self._restart()
        elif key == "int1":
            self.int1 = tuple(value) if value else None
            self._plan()
        elif key == "who_am_i":
            self.identity = value
        else:
            self.motion.configure(key, value)

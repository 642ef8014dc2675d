"""A board without a processor: time, events, interrupt lines and memory for the tests of single peripherals."""

import unittest

from virtual_board.chips import STM32F405, STM32H563
from virtual_board.events import EventQueue
from virtual_board.memory import Memory
from virtual_board.peripherals import create, h5

US, MS, S = 1_000_000, 1_000_000_000, 1_000_000_000_000
RAM = 0x2000_0000


class FakeBoard:
    """The board's side of the interface between core and peripherals."""

    def __init__(self, chip=STM32F405):
        self.now = 0
        self.queue, self.memory = EventQueue(), Memory(1, chip)
        self.memory_read, self.memory_write = self.memory.read, self.memory.write
        self.lines, self.log, self.resets, self.nmis = {}, [], [], 0
        self.stalled_until = 0
        self.peripherals = {}
        for peripheral in (h5.create if chip is STM32H563 else create)(self):
            self.peripherals[peripheral.name] = peripheral
        self.rcc = self.peripherals["RCC"]
        self.reset("por")

    def schedule(self, delay_ps, callback):
        return self.queue.schedule(self.now + delay_ps, callback)

    def irq(self, number, level):
        self.lines[number] = level

    def nmi(self):
        self.nmis += 1

    def request_reset(self, cause):
        self.resets.append((self.now, cause))
        self.stalled_until = 0
        self.reset(cause)

    def reset(self, cause):
        for peripheral in self.peripherals.values():
            peripheral.reset(cause)

    def stall(self, until_ps):
        self.stalled_until = until_ps

    def record(self, kind, **fields):
        self.log.append({"at": self.now, "kind": kind, **fields})

    def clocks_changed(self):
        pass

    # -- what a test does ------------------------------------------------------------------------------------------

    def advance(self, duration_ps):
        """Time passes, and every event on the way happens."""
        end = self.now + duration_ps
        while (at := self.queue.next_time()) is not None and at <= end:
            self.now = max(self.now, at)
            self.queue.pop_due(self.now)()
        self.now = end

    def read(self, name, offset, size=4):
        return self.peripherals[name].read(offset, size)

    def write(self, name, offset, value, size=4):
        self.peripherals[name].write(offset, value, size)

    def configure(self, name, key, value):
        self.peripherals[name].configure(key, value)

    def events(self, kind):
        return [event for event in self.log if event["kind"] == kind]

    def enable(self, *names):
        """The RCC opens the gates of these peripherals."""
        from virtual_board.peripherals.clock_names import ENABLE
        for offset, bits in ENABLE.items():
            for bit, name in bits.items():
                if name in names:
                    self.write("RCC", offset, self.read("RCC", offset) | 1 << bit)
        self.advance(1 * US)

    def alternate(self, letter, pin, function, speed=2):
        """A pin gets an alternate function and a speed."""
        port = "GPIO" + letter
        self.write(port, 0x00, self.read(port, 0x00) & ~(3 << 2 * pin) | 2 << 2 * pin)
        self.write(port, 0x08, self.read(port, 0x08) & ~(3 << 2 * pin) | speed << 2 * pin)
        offset = 0x20 + 4 * (pin >> 3)
        shift = 4 * (pin & 7)
        self.write(port, offset, self.read(port, offset) & ~(15 << shift) | function << shift)

    def run_at_168_mhz(self):
        """A 25 MHz crystal and the PLL give 168, 42 and 84 MHz."""
        self.write("FLASH", 0x00, 5)
        self.write("RCC", 0x00, 0x0001_0083)
        self.advance(3 * MS)
        self.write("RCC", 0x04, 0x0740_5419)
        self.write("RCC", 0x00, 0x0101_0083)
        self.advance(1 * MS)
        self.write("RCC", 0x08, 0x0000_9402)
        self.advance(1 * US)


class PeripheralTest(unittest.TestCase):
    """Tests of the registers of one peripheral, on a board of its own with open gates."""

    name, gates = "", ()

    def setUp(self):
        self.board = FakeBoard()
        if self.gates:
            self.board.enable(*self.gates)

    def read(self, offset, size=4):
        return self.board.read(self.name, offset, size)

    def write(self, offset, value, size=4):
        self.board.write(self.name, offset, value, size)


class SensorTest(unittest.TestCase):
    """Tests of an inertial sensor that is fitted on SPI, without the controller: its class, and the time until it answers."""

    fitted, answers_ps = "", 0

    def setUp(self):
        self.board = FakeBoard()
        spi = self.board.peripherals["SPI1"]
        spi.configure("part", self.fitted)
        self.part = spi.parts[spi.part]
        self.part.configure("noise", 0)
        self.board.advance(self.answers_ps)

    def exchange(self, die, *out, mode=(True, True), hz=5_000_000):
        """What a die answers to bytes in one transfer."""
        die.select()
        got = [die.transfer(byte, mode, hz) for byte in out]
        die.deselect()
        return bytes(got)

    def read(self, address, count=1):
        return self.exchange(self.part, address | 0x80, *[0] * count)[1:]

    def write(self, address, value):
        self.exchange(self.part, address, value)

    def recorded(self, *kinds):
        found = [event["kind"] for event in self.board.log if event["kind"].startswith(("sensor_", "fifo_", "spi_"))]
        self.assertEqual([kind for kind in found if kind != "sensor_bandwidth"], list(kinds))

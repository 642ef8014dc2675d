"""BMI088: BST-BMI088-DS001."""

from .fake_board import MS, S, US, SensorTest

MODE_0 = (False, False)


class Sensor(SensorTest):
    fitted, answers_ps = "Bmi088", 31 * MS

    def setUp(self):
        super().setUp()
        self.acc, self.gyro = self.part.accelerometer, self.part.gyro

    def read(self, die, address, count=1):
        skipped = 2 if die is self.acc else 1
        return self.exchange(die, address | 0x80, *[0] * (count + skipped - 1))[skipped:]

    def write(self, die, address, value, wait=1 * MS):
        self.exchange(die, address, value)
        self.board.advance(wait)

    def on(self):
        self.read(self.acc, 0)
        self.write(self.acc, 0x7C, 0)
        self.write(self.acc, 0x7D, 4, 51 * MS)

    def stream(self, mode=0x40):
        self.on()
        for address, value in ((0x40, 0x89), (0x41, 2), (0x49, 0x50), (0x7E, 0xB0)):
            self.write(self.acc, address, value)
        for address, value in ((0x0F, 3), (0x10, 4), (0x3E, mode)):
            self.write(self.gyro, address, value)

    def test_identities_and_reset_values(self):
        self.assertEqual(self.read(self.acc, 0), b"\xff")
        self.assertEqual(self.exchange(self.acc, 0x80, 0, 0)[1:], b"\xa5\x1e")
        self.assertEqual(self.read(self.gyro, 0), b"\x0f")
        self.assertEqual([self.read(self.acc, address)[0] for address in (0x40, 0x41, 0x48, 0x49, 0x7C, 0x7D)], [0xA8, 1, 2, 0x10, 3, 0])
        self.assertEqual([self.read(self.gyro, address)[0] for address in (0x0F, 0x10, 0x11, 0x3E)], [0, 0x80, 0, 0])
        self.recorded()

    def test_the_accelerometer_takes_no_write_before_it_listens_on_spi(self):
        self.write(self.acc, 0x7D, 4)
        self.assertEqual(self.read(self.acc, 0x7D), b"\x00")
        self.write(self.acc, 0x7E, 0xB6)
        self.assertEqual(self.read(self.acc, 0), b"\xff")
        self.assertEqual(self.read(self.acc, 0), b"\x1e")
        self.recorded("sensor_not_spi")

    def test_a_reset_takes_its_time(self):
        self.read(self.acc, 0)
        self.write(self.gyro, 0x0F, 3)
        self.write(self.gyro, 0x14, 0xB6, 29 * MS)
        self.assertEqual(self.read(self.gyro, 0x0F), b"\x00")
        self.recorded("sensor_in_reset")
        self.board.advance(1 * MS)
        self.assertEqual(self.read(self.gyro, 0), b"\x0f")
        self.assertEqual(self.read(self.gyro, 0x0F), b"\x00")

    def test_writes_too_close_have_no_effect(self):
        self.read(self.acc, 0)
        self.write(self.acc, 0x7C, 0, 999 * US)
        self.write(self.acc, 0x7D, 4)
        self.assertEqual(self.read(self.acc, 0x7D), b"\x00")
        self.recorded("sensor_write_too_early")
        self.write(self.acc, 0x7D, 4, 449 * US)
        self.read(self.acc, 0x7D)
        self.recorded("sensor_write_too_early", *["sensor_in_reset"] * 2)
        self.board.advance(1 * US)
        self.write(self.acc, 0x41, 0, 2 * US)
        self.write(self.acc, 0x41, 2, 1 * US)
        self.write(self.acc, 0x41, 3)
        self.assertEqual(self.read(self.acc, 0x41), b"\x02")

    def test_reserved_registers_and_values(self):
        self.on()
        for die, address, value in ((self.acc, 0x70, 1), (self.acc, 0x12, 1), (self.acc, 0x40, 0x29), (self.acc, 0x49, 0x40), (self.acc, 0x7D, 1),
                                    (self.gyro, 0x13, 0), (self.gyro, 0x0F, 5), (self.gyro, 0x10, 8), (self.gyro, 0x11, 1)):
            before = self.read(die, address)
            self.write(die, address, value)
            self.assertEqual(self.read(die, address), before)
        self.recorded(*["sensor_reserved"] * 9)

    def test_frames_of_both_fifos(self):
        self.part.configure("rates_dps", [0, -1 / 131.072, 10])
        self.part.configure("acceleration_g", [0, -1 / 2730.67, 1])
        self.part.configure("temperature_c", 23.375)
        self.stream()
        self.board.advance(12 * MS)
        self.assertEqual(self.read(self.gyro, 0x0E), b"\x02")
        self.assertEqual(self.read(self.gyro, 0x3F, 6).hex(), "0000ffff1f05")
        self.assertEqual(self.read(self.gyro, 0x0E), b"\x01")
        self.assertEqual(self.read(self.acc, 0x22, 2).hex(), "0060")
        waiting = int.from_bytes(self.read(self.acc, 0x24, 2), "little")
        self.assertEqual(waiting, 21)
        for _ in range(waiting // 7):
            self.assertEqual(self.read(self.acc, 0x26, 7).hex(), "840000ffffab0a")
        self.assertEqual(self.read(self.acc, 0x24, 2), b"\x00\x80")
        self.assertEqual(self.read(self.acc, 0x26, 6)[::4], b"\x44\x80")
        self.recorded()

    def test_each_die_has_its_own_oscillator(self):
        self.part.configure("oscillator_error_percent", 1.0)
        self.part.configure("acc_oscillator_error_percent", -1.0)
        self.stream()
        time, made = self.read(self.acc, 0x18, 3), (self.acc.made, self.gyro.made)
        self.board.advance(10 * S)
        ticks = int.from_bytes(self.read(self.acc, 0x18, 3), "little") - int.from_bytes(time, "little")
        self.assertAlmostEqual(ticks, 256_000 * 0.99, delta=2)
        self.read(self.gyro, 0)
        self.assertAlmostEqual(self.acc.made - made[0], 1980, delta=1)
        self.assertAlmostEqual(self.gyro.made - made[1], 2020, delta=1)

    def test_a_full_fifo_of_the_gyro_stops_or_drops_the_oldest(self):
        for mode, first in ((0x40, 3), (0x80, 503)):
            self.stream(mode)
            start = self.board.now / US
            self.part.configure("motion", [[start, [0, 0, 0], [0, 0, 1]], [start + 2e6, [200, 0, 0], [0, 0, 1]]])
            self.board.advance(1000 * MS)
            self.assertEqual(self.read(self.gyro, 0x0E), b"\xe4")
            value = int.from_bytes(self.read(self.gyro, 0x3F, 2), "little", signed=True) / 131.072
            self.assertAlmostEqual(value, first / 10, delta=0.3)
            self.write(self.gyro, 0x3E, mode, 0)
            self.assertEqual(self.read(self.gyro, 0x0E), b"\x00")
        self.recorded("fifo_partial_read", "fifo_partial_read")

    def test_a_full_fifo_of_the_accelerometer_says_what_it_skipped(self):
        self.stream()
        self.board.advance(1000 * MS)
        self.assertEqual(int.from_bytes(self.read(self.acc, 0x24, 2), "little"), 146 * 7 + 2)
        self.assertEqual(self.read(self.acc, 0x26, 3).hex(), "403784")
        self.assertEqual(self.read(self.acc, 0x26, 1), b"\x84")
        self.assertEqual(self.read(self.acc, 0x26, 7)[0], 0x84)

    def test_a_change_of_range_is_a_frame(self):
        self.stream()
        self.write(self.acc, 0x7E, 0xB0, 2 * US)
        self.write(self.acc, 0x41, 3)
        self.assertEqual(self.read(self.acc, 0x26, 2)[0] & 0xFC, 0x48)

    def test_self_test_of_the_gyro(self):
        for passes, result in ((True, 0x12), (False, 0x16)):
            self.part.configure("self_test", passes)
            self.write(self.gyro, 0x3C, 1)
            self.assertEqual(self.read(self.gyro, 0x3C), b"\x10")
            self.board.advance(20 * MS)
            self.assertEqual(self.read(self.gyro, 0x3C)[0], result)

    def test_self_test_of_the_accelerometer(self):
        self.on()
        self.write(self.acc, 0x6D, 0x0D)
        self.recorded("sensor_self_test")
        self.write(self.acc, 0x41, 3)
        self.write(self.acc, 0x40, 0xAC)
        for passes, expected in ((True, (2184, 2184, 1092)), (False, (0, 0, 0))):
            self.part.configure("acc_self_test", passes)
            read = []
            for polarity in (0x0D, 0x09):
                self.write(self.acc, 0x6D, polarity, 51 * MS)
                data = self.read(self.acc, 0x12, 6)
                read.append([int.from_bytes(data[at:at + 2], "little", signed=True) for at in (0, 2, 4)])
            for up, down, least in zip(*read, expected):
                self.assertAlmostEqual(up - down, least, delta=3)

    def test_bandwidth_damps_a_tone(self):
        self.part.configure("tones", [[0, 80, 10]])
        swings = {}
        for code in (4, 0):
            self.write(self.gyro, 0x10, code)
            values = []
            for _ in range(200):
                self.board.advance(5 * MS)
                values.append(abs(int.from_bytes(self.read(self.gyro, 0x02, 2), "little", signed=True)) / 16.384)
            swings[code] = max(values)
        self.assertAlmostEqual(swings[4], 10 / (1 + (80 / 23) ** 4) ** 0.5, delta=0.1)
        self.assertAlmostEqual(swings[0], 10, delta=0.2)

    def test_noise_has_the_density_of_the_data_sheet(self):
        self.part.configure("noise", 1)
        self.stream()
        values = []
        for _ in range(40):
            self.board.advance(500 * MS)
            for _ in range(99):
                values.append(int.from_bytes(self.read(self.gyro, 0x3F, 6)[:2], "little", signed=True) / 131.072)
            self.write(self.gyro, 0x3E, 0x40)
        deviation = (sum(value * value for value in values) / len(values)) ** 0.5
        self.assertAlmostEqual(deviation / (0.014 * (23 * 1.11) ** 0.5), 1, delta=0.05)

    def test_a_reset_of_the_processor_leaves_the_sensor_alone(self):
        self.stream()
        self.board.reset("software")
        self.assertEqual(self.read(self.acc, 0x7D), b"\x04")
        self.board.reset("por")
        self.board.advance(31 * MS)
        self.assertEqual(self.read(self.acc, 0), b"\xff")
        self.assertEqual(self.read(self.acc, 0x7D), b"\x00")

    def test_the_wrong_mode_or_a_fast_clock_is_unreadable(self):
        self.assertEqual(self.exchange(self.gyro, 0x80, 0, mode=MODE_0)[1], 0x0F)
        self.assertEqual(self.exchange(self.gyro, 0x80, 0, mode=(False, True))[1], 0xFF)
        self.assertEqual(self.exchange(self.gyro, 0x80, 0, hz=10_500_000)[1], 0xFF)

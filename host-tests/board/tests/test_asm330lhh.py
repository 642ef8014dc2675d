"""ASM330LHH: ST's registers, the tables of the LSM6DSR's data sheet."""

from .fake_board import MS, S, US, SensorTest
from virtual_board.violation import Violation

SETTINGS = ((0x12, 0x44), (0x13, 0x06), (0x15, 0x06), (0x17, 0x20), (0x18, 0xE2), (0x19, 0x20), (0x10, 0x56), (0x11, 0x50), (0x09, 0x55))


class Sensor(SensorTest):
    fitted, answers_ps = "Asm330lhh", 11 * MS

    def number(self, address, signed=True):
        return int.from_bytes(self.read(address, 2), "little", signed=signed)

    def stream(self, mode=6):
        for address, value in SETTINGS:
            self.write(address, value)
        self.board.advance(100 * MS)
        self.write(0x0A, 0x70 | mode)

    def words(self):
        return [self.read(0x78, 7) for _ in range(self.number(0x3A, signed=False) & 0x3FF)]

    def test_identity_and_reset_values(self):
        self.assertEqual(self.read(0x0F), b"\x6b")
        self.assertEqual(self.read(0x10, 10).hex(), "000004000000" "0000e000")
        self.assertEqual(self.read(0x02), b"\x3f")
        self.recorded()

    def test_power_on_and_reset_take_their_time(self):
        self.write(0x15, 6)
        self.write(0x12, 0x05)
        self.read(0x0F)
        self.board.advance(50 * US)
        self.assertEqual((self.read(0x12), self.read(0x15)), (b"\x04", b"\x00"))
        self.board.reset("por")
        self.board.advance(9 * MS)
        self.read(0x0F)
        self.recorded("sensor_in_reset", "sensor_in_reset")

    def test_reserved_registers_and_bits(self):
        for address, value in ((0x0F, 0), (0x22, 1), (0x50, 1), (0x13, 0x80), (0x15, 0x10), (0x18, 0xE3), (0x16, 0x80)):
            before = self.read(address)
            self.write(address, value)
            self.assertEqual(self.read(address), before)
        # 0x50 does not exist, and is read twice.
        self.recorded("sensor_reserved", "sensor_reserved", *["sensor_reserved"] * 7)

    def test_words_of_an_output(self):
        self.part.configure("rates_dps", [0, -0.0175, 10])
        self.part.configure("acceleration_g", [0, -0.001952, 1])
        self.part.configure("temperature_c", 24.5)
        self.stream()
        self.board.advance(19 * MS)
        words = self.words()
        self.assertEqual(len(words), 13)
        self.assertEqual([word[0] >> 3 for word in words[:10]], [1, 2, 4, 1, 2, 4, 1, 2, 4, 1])
        self.assertEqual([word[0] >> 1 & 3 for word in words[:10]], [1, 1, 1, 2, 2, 2, 3, 3, 3, 0])
        self.assertTrue(all(word[0].bit_count() % 2 == 0 for word in words))
        self.assertEqual(words[0][1:].hex(), "0000feff7704")
        self.assertEqual(words[1][1:].hex(), "0000fcff0108")
        self.assertEqual(words[11], b"\x18\x80\xff\x00\x00\x00\x00")
        stamps = [int.from_bytes(word[1:5], "little") for word in words if word[0] >> 3 == 4]
        self.assertEqual([after - before for before, after in zip(stamps, stamps[1:])], [192] * 3)
        self.assertEqual(self.read(0x3A, 2), b"\x00\x00")
        self.assertEqual(self.read(0x78), b"\x00")
        self.recorded()

    def test_words_one_after_the_other_in_one_transfer_and_a_word_read_in_part(self):
        self.stream()
        self.board.advance(5 * MS)
        self.assertEqual(self.read(0x78, 3)[0] >> 3, 1)
        self.recorded("fifo_partial_read")
        self.assertEqual([tag >> 3 for tag in self.read(0x78, 21)[::7]], [1, 2, 4])

    def test_a_full_fifo_drops_the_oldest_or_stops(self):
        for mode, first in ((6, 1000), (1, 0)):
            self.setUp()
            self.stream(mode)
            self.board.advance(1 * S)
            self.assertEqual(self.number(0x3A, signed=False), 438 | 0x6800)
            self.assertEqual(self.number(0x3A, signed=False), 438 | 0x2000)
            stamps = [int.from_bytes(word[1:5], "little") for word in self.words() if word[0] >> 3 == 4]
            newest = int.from_bytes(self.read(0x40, 4), "little")
            self.assertEqual((newest - stamps[-1]) * 25 // 100_000 > 0, mode == 1)

    def test_the_oscillator_is_what_was_measured_and_its_drift(self):
        self.part.configure("freq_fine", -7)
        self.part.configure("oscillator_error_percent", 1.0)
        self.stream()
        made, begin = self.part.made, int.from_bytes(self.read(0x40, 4), "little")
        self.board.advance(10 * S)
        stamp = int.from_bytes(self.read(0x40, 4), "little") - begin
        self.assertAlmostEqual(stamp, 400_000 * 0.9895 * 1.01, delta=2)
        self.assertAlmostEqual(self.part.made - made, 2083.3 * 0.9895 * 1.01, delta=2)
        self.assertEqual(self.read(0x63), b"\xf9")

    def test_self_test(self):
        for address, value in ((0x12, 0x44), (0x10, 0x58), (0x11, 0x5C)):
            self.write(address, value)
        for gyro, acc in ((True, True), (False, True), (True, False)):
            self.part.configure("self_test", gyro)
            self.part.configure("acc_self_test", acc)
            readings = []
            for deflect in (0, 0x05):
                self.write(0x14, deflect)
                self.board.advance(105 * MS)
                readings.append([self.number(address) for address in range(0x22, 0x2E, 2)])
            changes = [after - before for before, after in zip(*readings)]
            self.assertEqual([2143 <= change <= 10000 for change in changes[:3]], [gyro] * 3)
            self.assertEqual([328 <= change <= 13934 for change in changes[3:]], [acc] * 3)
        self.recorded()
        self.write(0x10, 0x50)
        self.write(0x14, 0x05)
        self.recorded("sensor_self_test")

    def test_the_gyro_needs_70_ms(self):
        self.part.configure("rates_dps", [10, 0, 0])
        for address, value in SETTINGS:
            self.write(address, value)
        self.board.advance(60 * MS)
        self.assertEqual(self.number(0x22), 0)
        self.board.advance(20 * MS)
        self.assertEqual(self.number(0x22), 1143)

    def test_bandwidth_damps_a_tone(self):
        self.part.configure("tones", [[0, 80, 10]])
        swings = {}
        for filters in (0x06, 0x04):
            self.stream()
            self.write(0x13, filters)
            values = []
            for _ in range(300):
                self.board.advance(5 * MS)
                values.append(abs(self.number(0x22)) * 0.00875)
            swings[filters] = max(values)
        self.assertAlmostEqual(swings[0x06], 10 / (1 + (80 / 23.1) ** 4) ** 0.5, delta=0.1)
        self.assertAlmostEqual(swings[0x04], 10 / (1 + (80 / 67) ** 4) ** 0.5, delta=0.1)

    def test_what_is_not_modelled_is_an_error(self):
        self.stream()
        for address, value in ((0x10, 0x46), (0x09, 0x54), (0x0A, 0x73)):
            with self.assertRaises(Violation):
                self.write(address, value)
                self.board.advance(10 * MS)
                self.read(0x0F)
            self.setUp()
            self.stream()

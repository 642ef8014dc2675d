"""ICM-42688-P: DS-000347."""

from .fake_board import MS, S, US, SensorTest
from virtual_board.peripherals import icm42688_registers as reg
from virtual_board.violation import Violation


class Sensor(SensorTest):
    fitted, answers_ps = "Icm42688", 2 * MS

    def start(self, output=8):
        self.write(reg.GYRO_CONFIG0, output)
        self.write(reg.ACCEL_CONFIG0, output)
        self.write(reg.PWR_MGMT0, 0x0F)
        self.board.advance(1 * MS)

    def stream(self, output=8):
        self.start(output)
        self.write(reg.FIFO_CONFIG1, 0x17)
        self.write(reg.FIFO_CONFIG, 0x40)
        self.write(reg.SIGNAL_PATH_RESET, 2)
        self.board.advance(100 * MS)
        self.write(reg.SIGNAL_PATH_RESET, 2)

    def packet(self):
        count = int.from_bytes(self.read(reg.FIFO_COUNTH, 2), "big")
        self.assertEqual(count % 20, 0)
        return self.read(reg.FIFO_DATA, 20) if count else None

    def rate(self, axis):
        """The rate in the next packet, deg/s."""
        self.board.advance(10 * MS)
        return int.from_bytes(self.packet()[7 + 2 * axis:][:2], "big", signed=True) / 16.375

    def test_identity_and_reset_values(self):
        self.assertEqual(self.read(reg.WHO_AM_I)[0], 0x47)
        values = [self.read(address)[0] for address in (0x4C, 0x4D, 0x4E, 0x4F, 0x50, 0x51, 0x52, 0x53)]
        self.assertEqual(values, [0x30, 0x91, 0, 6, 6, 0x16, 0x11, 0x0D])

    def test_soft_reset_takes_a_millisecond(self):
        self.write(reg.GYRO_CONFIG0, 0x28)
        self.write(reg.DEVICE_CONFIG, 1)
        self.assertEqual(self.read(reg.WHO_AM_I)[0], 0)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(reg.WHO_AM_I)[0], 0x47)
        self.assertEqual(self.read(reg.GYRO_CONFIG0)[0], 6)

    def test_no_write_within_200_us_of_leaving_off(self):
        self.write(reg.PWR_MGMT0, 0x0F)
        self.write(reg.GYRO_CONFIG0, 0x28)
        self.assertEqual(self.read(reg.GYRO_CONFIG0)[0], 6)
        self.assertEqual(len(self.board.events("sensor_write_too_early")), 1)
        self.board.advance(200 * US)
        self.write(reg.GYRO_CONFIG0, 0x28)
        self.assertEqual(self.read(reg.GYRO_CONFIG0)[0], 0x28)

    def test_banks(self):
        self.write(reg.REG_BANK_SEL, 1)
        self.assertEqual(self.read(0x0C)[0], 0x0D)
        self.write(reg.REG_BANK_SEL, 0)
        self.assertEqual(self.read(0x0C)[0], 0)
        self.assertEqual(len(self.board.events("sensor_reserved")), 1)

    def test_the_gyro_is_invalid_while_it_starts(self):
        self.start()
        self.write(reg.FIFO_CONFIG1, 0x17)
        self.write(reg.FIFO_CONFIG, 0x40)
        self.board.advance(50 * MS)
        rates = [self.packet()[7:9].hex() for _ in range(5)]
        self.assertEqual(rates, ["8000", "8000", "0000", "0000", "0000"])
        self.assertIsNone(self.packet())
        self.assertEqual(self.read(reg.FIFO_DATA, 2), b"\xff\xff")

    def test_what_the_driver_does_not_use_ends_the_run(self):
        for address, value in ((0x65, 8), (reg.TMST_CONFIG, 0x2B), (reg.SIGNAL_PATH_RESET, 4), (reg.FIFO_CONFIG, 0x80)):
            with self.assertRaises(Violation):
                self.write(address, value)
        for address in (0x1F, 0x2D, 0x6C):
            with self.assertRaises(Violation):
                self.read(address)
        self.stream()
        self.write(reg.FIFO_CONFIG1, 0x07)
        self.board.advance(10 * MS)
        with self.assertRaises(Violation):
            self.packet()

    def test_packet_4_has_20_bits(self):
        self.part.configure("rates_dps", (0, -1 / 131, 10))
        self.part.configure("acceleration_g", (0, -1 / 8192, 1))
        self.part.configure("temperature_c", 30)
        self.stream()
        self.board.advance(10 * MS)
        packet = self.packet()
        self.assertEqual((packet[:15] + packet[17:]).hex(), "78" "0000ffff0800" "0000ffff00a3" "0296" "00ce0c")

    def test_time_stamps_count_units_of_32_30_us(self):
        self.stream()
        stamps = []
        for _ in range(4):
            self.board.advance(10 * MS)
            stamps.append(int.from_bytes(self.packet()[15:17], "big"))
        self.assertEqual({(b - a) % 65_536 for a, b in zip(stamps, stamps[1:])}, {9_375})

    def test_the_oscillator_has_an_error(self):
        self.part.configure("oscillator_error_percent", 1.0)
        self.stream()
        self.board.advance(10 * S)
        made = self.part.made
        self.read(0)
        self.assertAlmostEqual(self.part.made - made, 1010, delta=1)

    def test_fifo_full_keeps_the_newest_in_stream_mode(self):
        self.stream()
        self.board.advance(2 * S)
        self.assertEqual(int.from_bytes(self.read(reg.FIFO_COUNTH, 2), "big"), 102 * 20)

    def test_a_packet_read_in_part_is_given_again(self):
        self.stream()
        self.board.advance(10 * MS)
        first = self.read(reg.FIFO_DATA, 5)
        self.assertEqual(self.read(reg.FIFO_DATA, 5), first)

    def test_bandwidth(self):
        self.start()
        for code, hz in ((1, 100), (4, 40), (7, 10)):
            self.write(reg.GYRO_ACCEL_CONFIG0, code | code << 4)
            self.assertEqual(self.part.bandwidth_hz(), hz)

    def test_a_tone_above_the_bandwidth_is_damped_and_one_above_half_the_rate_folds_back(self):
        def swing(code):
            self.write(reg.GYRO_ACCEL_CONFIG0, code | code << 4)
            return max(abs(self.rate(0)) for _ in range(100))

        self.part.configure("tones", [[0, 95, 10]])
        self.stream()
        self.assertGreater(swing(1), 6)
        self.assertLess(swing(4), 2)

    def test_noise_has_the_density_of_the_data_sheet(self):
        self.part.configure("noise", 1)
        self.write(reg.GYRO_ACCEL_CONFIG0, 0x44)
        self.stream()
        values = []
        for _ in range(20):
            self.board.advance(1 * S)
            for _ in range(100):
                packet = self.read(reg.FIFO_DATA, 20)
                coarse = int.from_bytes(packet[7:9], "big", signed=True)
                values.append((coarse << 4 | packet[17] & 15) / 262)
        deviation = (sum(value * value for value in values) / len(values)) ** 0.5
        self.assertAlmostEqual(deviation / (0.0028 * (40 * 1.11) ** 0.5), 1, delta=0.05)

    def test_samples_and_motion_from_a_table(self):
        self.stream()
        now = self.board.now / US
        self.part.configure("motion", [[now, [0, 0, 0], [0, 0, 1]], [now + 1_000_000, [0, 0, 100], [0, 0, 1]]])
        rates = [self.rate(2) for _ in range(50)]
        self.assertAlmostEqual(rates[-1], 50, delta=1.1)

    def test_reset_of_the_processor_leaves_the_sensor_alone(self):
        self.start()
        self.board.reset("software")
        self.assertEqual(self.read(reg.PWR_MGMT0)[0], 0x0F)
        self.board.reset("por")
        self.board.advance(2 * MS)
        self.assertEqual(self.read(reg.PWR_MGMT0)[0], 0)

    def test_the_wrong_mode_is_unreadable(self):
        self.assertEqual(self.exchange(self.part, 0xF5, 0, mode=(False, True)), b"\xff\xff")

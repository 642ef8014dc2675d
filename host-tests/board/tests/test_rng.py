"""The random number generator against RM0090 section 24."""

from .fake_board import US, PeripheralTest

CR, SR, DR = 0x00, 0x04, 0x08


class RngTest(PeripheralTest):
    name = "RNG"

    def setUp(self):
        super().setUp()
        self.board.run_at_168_mhz()  # and 48 MHz at Q
        self.board.enable("RNG")

    def test_a_number_comes_every_40_periods(self):
        self.write(CR, 4)
        self.assertEqual(self.read(SR), 0)
        self.board.advance(833_000)
        self.assertEqual(self.read(SR), 0)
        self.board.advance(1_000)
        self.assertEqual(self.read(SR), 1)
        first = self.read(DR)
        self.assertEqual(self.read(SR), 0)
        self.board.advance(834_000)
        self.assertNotEqual(self.read(DR), first)

    def test_a_seed_error_stops_it_until_it_is_enabled_again(self):
        self.board.peripherals["RNG"].configure("seed_error", True)
        self.write(CR, 4)
        self.board.advance(2 * US)
        self.assertEqual(self.read(SR), 1 << 6 | 1 << 2)
        self.board.peripherals["RNG"].configure("seed_error", False)
        self.assertEqual(self.read(SR), 1 << 6)
        self.write(SR, 0)
        self.write(CR, 0)
        self.write(CR, 4)
        self.board.advance(1 * US)
        self.assertEqual(self.read(SR), 1)

    def test_without_the_pll_there_is_a_clock_error(self):
        self.board.write("RCC", 0x08, 0x9400)
        self.board.advance(1 * US)
        self.board.write("RCC", 0x00, self.board.read("RCC", 0x00) & ~(1 << 24))
        self.board.advance(1 * US)
        self.write(CR, 4)
        self.board.advance(10 * US)
        self.assertEqual(self.read(SR), 1 << 5 | 1 << 1)

"""The random number generator against RM0090 section 24."""

import unittest

from .fake_board import FakeBoard, US

CR, SR, DR = 0x00, 0x04, 0x08
AHB2ENR = 0x34


class RngTest(unittest.TestCase):
    def setUp(self):
        self.board = FakeBoard()
        self.rcc = self.board.rcc
        # HSE of 8 MHz, 336 MHz, Q of 7: 48 MHz.
        self.rcc.crystal_hz = 8_000_000
        self.board.write("RCC", 0x00, self.board.read("RCC", 0x00) | 1 << 16)
        self.board.advance(10_000 * US)
        self.board.write("RCC", 0x04, 7 << 24 | 1 << 22 | 336 << 6 | 8)
        self.board.write("RCC", 0x00, self.board.read("RCC", 0x00) | 1 << 24)
        self.board.advance(10_000 * US)
        self.board.write("RCC", AHB2ENR, 1 << 6)
        self.board.advance(1 * US)

    def test_a_number_comes_every_40_periods(self):
        self.board.write("RNG", CR, 4)
        self.assertEqual(self.board.read("RNG", SR), 0)
        self.board.advance(833_000)
        self.assertEqual(self.board.read("RNG", SR), 0)
        self.board.advance(1_000)
        self.assertEqual(self.board.read("RNG", SR), 1)
        first = self.board.read("RNG", DR)
        self.assertEqual(self.board.read("RNG", SR), 0)
        self.board.advance(834_000)
        self.assertNotEqual(self.board.read("RNG", DR), first)

    def test_a_seed_error_stops_it_until_it_is_enabled_again(self):
        self.board.peripherals["RNG"].configure("seed_error", True)
        self.board.write("RNG", CR, 4)
        self.board.advance(2 * US)
        self.assertEqual(self.board.read("RNG", SR), 1 << 6 | 1 << 2)
        self.board.peripherals["RNG"].configure("seed_error", False)
        self.assertEqual(self.board.read("RNG", SR), 1 << 6)
        self.board.write("RNG", SR, 0)
        self.board.write("RNG", CR, 0)
        self.board.write("RNG", CR, 4)
        self.board.advance(1 * US)
        self.assertEqual(self.board.read("RNG", SR), 1)

    def test_without_the_pll_there_is_a_clock_error(self):
        self.board.write("RCC", 0x00, self.board.read("RCC", 0x00) & ~(1 << 24))
        self.board.advance(1 * US)
        self.board.write("RNG", CR, 4)
        self.board.advance(10 * US)
        self.assertEqual(self.board.read("RNG", SR), 1 << 5 | 1 << 1)

"""Ports and the debug component: sections 8 and 38 of RM0090."""

import unittest

from virtual_board.chips import STM32F405
from virtual_board.memory import Memory

from .fake_board import FakeBoard


class Gpio(unittest.TestCase):
    def setUp(self):
        self.board = FakeBoard()

    def test_reset_values(self):
        self.assertEqual([self.board.read("GPIOA", offset) for offset in (0, 8, 12)], [0xA800_0000, 0x0C00_0000, 0x6400_0000])
        self.assertEqual([self.board.read("GPIOB", offset) for offset in (0, 8, 12)], [0x280, 0xC0, 0x100])
        self.assertEqual(self.board.read("GPIOC", 0), 0)

    def test_bsrr_sets_before_it_resets(self):
        self.board.write("GPIOC", 0x14, 0x000F)
        self.board.write("GPIOC", 0x18, 0x0003_0031)
        self.assertEqual(self.board.read("GPIOC", 0x14), 0x003D)

    def test_an_output_is_seen_and_recorded(self):
        self.board.configure("GPIOA", "watch", [10])
        self.board.write("GPIOA", 0x00, 0xA800_0000 | 1 << 20)
        self.board.write("GPIOA", 0x18, 1 << 10)
        self.assertEqual(self.board.read("GPIOA", 0x10) >> 10 & 1, 1)
        self.assertEqual([event["level"] for event in self.board.events("pin")], [True])

    def test_inputs(self):
        self.assertEqual(self.board.read("GPIOD", 0x10), 0)
        self.board.write("GPIOD", 0x0C, 1)
        self.assertEqual(self.board.read("GPIOD", 0x10), 1)
        self.board.configure("GPIOD", "drive", (0, False))
        self.assertEqual(self.board.read("GPIOD", 0x10), 0)

    def test_identity(self):
        self.assertEqual(self.board.read("DBGMCU", 0) & 0xFFF, 0x413)
        self.assertEqual(Memory(0).read(STM32F405.flash_kib, 2), (1024).to_bytes(2, "little"))

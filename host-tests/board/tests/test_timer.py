"""Timers: sections 18 and 19 of RM0090."""

import random
import unittest

from .fake_board import MS, US, FakeBoard
from virtual_board.violation import Violation

CR1, DIER, SR, EGR, CCMR1, CCER, CNT, PSC, ARR, CCR1, OR = 0, 0x0C, 0x10, 0x14, 0x18, 0x20, 0x24, 0x28, 0x2C, 0x34, 0x50


class Timers(unittest.TestCase):
    def setUp(self):
        self.board = FakeBoard()
        self.board.enable("TIM5", "TIM11")

    def microseconds(self, timer, **registers):
        """Starts a timer that counts microseconds of 16 MHz."""
        values = {"psc": 15, "egr": 1, "sr": 0, **registers, "cr1": 1}
        for name, value in values.items():
            self.board.write(timer, globals()[name.upper()], value)

    def crystal_on_tim11(self, mode):
        self.board.run_at_168_mhz()
        self.board.write("RCC", 0x08, self.board.read("RCC", 0x08) & ~(31 << 16) | 25 << 16)
        for offset, value in ((OR, 2), (CCMR1, mode), (CCER, 1), (CR1, 1)):
            self.board.write("TIM11", offset, value)

    def test_free_running_microseconds_over_the_wrap(self):
        self.microseconds("TIM5")
        self.board.advance(123 * US)
        self.assertEqual(self.board.read("TIM5", CNT), 123)
        self.board.advance(2**32 * US)
        self.assertEqual(self.board.read("TIM5", CNT), 123)
        self.assertEqual(self.board.read("TIM5", SR) & 1, 1)

    def test_update_interrupt(self):
        self.microseconds("TIM5", arr=999, dier=1)
        self.board.advance(999 * US)
        self.assertFalse(self.board.lines[50])
        self.board.advance(1 * US)
        self.assertTrue(self.board.lines[50])
        self.board.write("TIM5", SR, 0)
        self.assertFalse(self.board.lines[50])
        self.board.advance(1 * MS)
        self.assertTrue(self.board.lines[50])

    def test_compare_interrupt(self):
        self.microseconds("TIM5", ccr1=500, dier=2)
        self.board.advance(499 * US)
        self.assertFalse(self.board.lines.get(50))
        self.board.advance(2 * US)
        self.assertTrue(self.board.lines[50])
        self.board.write("TIM5", SR, 0xFFFF_FFFD)
        self.board.write("TIM5", CCR1, 600)
        self.assertFalse(self.board.lines[50])
        self.board.advance(100 * US)
        self.assertTrue(self.board.lines[50])

    def test_a_change_of_clock_keeps_the_count(self):
        self.microseconds("TIM5")
        self.board.advance(1 * MS)
        self.board.run_at_168_mhz()
        after = self.board.read("TIM5", CNT)
        self.board.advance(1 * MS)
        self.assertAlmostEqual(self.board.read("TIM5", CNT) - after, 84_000 / 16, delta=1)

    def test_tim11_measures_the_crystal_against_the_bus_clock(self):
        self.crystal_on_tim11(1 | 3 << 2)
        captures = []
        while len(captures) < 3:
            self.board.advance(1 * US)
            if self.board.read("TIM11", SR) & 2:
                captures.append(self.board.read("TIM11", CCR1))
        differences = {(b - a) % 65_536 for a, b in zip(captures, captures[1:])}
        self.assertEqual(differences, {8 * 168})

    def test_overcapture(self):
        self.crystal_on_tim11(1)
        self.board.advance(10 * US)
        self.assertEqual(self.board.read("TIM11", SR) & 0x202, 0x202)

    def test_against_a_count_step_by_step(self):
        """Flags and counter after any wait are those of a counter that is stepped one by one."""
        source = random.Random(1)
        for _ in range(200):
            board = FakeBoard()
            board.enable("TIM5")
            arr, ccr, counter = source.randrange(1, 30), source.randrange(40), source.randrange(30)
            prescaler = source.randrange(4)
            for offset, value in ((PSC, prescaler), (ARR, arr), (CCR1, ccr), (EGR, 1), (CNT, min(counter, arr)), (SR, 0), (CR1, 1)):
                board.write("TIM5", offset, value)
            counter = min(counter, arr)
            flags, clock = 0, 0
            for _ in range(3):
                wait = source.randrange(300)
                board.advance(wait * 62_500)
                for _ in range(wait):
                    clock += 1
                    if clock > prescaler:
                        clock = 0
                        if counter == arr:
                            counter = 0
                            flags |= 1
                        else:
                            counter += 1
                        flags |= 2 if counter == ccr else 0
                if source.random() < 0.5:
                    self.assertEqual(board.read("TIM5", CNT), counter)
                self.assertEqual(board.read("TIM5", SR) & 3, flags)
                self.assertEqual(board.read("TIM5", CNT), counter)

    def test_modes_left_out(self):
        for offset, value in ((CR1, 0x11), (CR1, 8), (DIER, 1 << 8), (EGR, 2), (0x04, 0)):
            with self.assertRaises(Violation):
                self.board.write("TIM5", offset, value)
        self.microseconds("TIM5", arr=999)
        self.board.write("TIM5", PSC, 7)
        self.board.advance(2 * MS)
        with self.assertRaisesRegex(Violation, "an overflow loads"):
            self.board.read("TIM5", SR)

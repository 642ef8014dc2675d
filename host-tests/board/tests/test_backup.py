"""Backup registers, window watchdog and CRC unit: sections 26, 22 and 4 of RM0090."""

import unittest
import zlib

from .fake_board import MS, US, FakeBoard


class Backup(unittest.TestCase):
    def setUp(self):
        self.board = FakeBoard()
        self.board.enable("PWR")

    def test_backup_registers_want_dbp_and_survive_a_reset(self):
        self.board.write("RTC", 0x50, 7)
        self.assertEqual(self.board.read("RTC", 0x50), 0)
        self.board.write("PWR", 0, 0x4100)
        self.board.write("RTC", 0x50, 7)
        self.board.reset("iwdg")
        self.assertEqual(self.board.read("RTC", 0x50), 7)
        self.board.reset("por")
        self.assertEqual(self.board.read("RTC", 0x50), 0)

    def test_backup_domain_reset(self):
        self.board.write("PWR", 0, 0x4100)
        self.board.write("RTC", 0x9C, 7)
        self.board.write("RCC", 0x70, 1 << 16)
        self.assertEqual(self.board.read("RTC", 0x9C), 0)


class Wwdg(unittest.TestCase):
    def setUp(self):
        self.board = FakeBoard()
        self.board.enable("WWDG")

    def test_timeout(self):
        self.board.write("WWDG", 0, 0xFF)
        self.board.advance(16 * MS)
        self.assertEqual(self.board.resets, [])
        self.board.advance(1 * MS)
        self.assertEqual([cause for _, cause in self.board.resets], ["wwdg"])

    def test_a_refresh_outside_of_the_window(self):
        self.board.write("WWDG", 4, 0x50)
        self.board.write("WWDG", 0, 0xFF)
        self.board.advance(300 * US)
        self.board.write("WWDG", 0, 0xFF)
        self.assertEqual([cause for _, cause in self.board.resets], ["wwdg"])

    def test_early_warning(self):
        self.board.write("WWDG", 4, 0x7F | 1 << 9)
        self.board.write("WWDG", 0, 0xC2)
        self.board.advance(520 * US)
        self.assertTrue(self.board.lines[0])


class CrcUnit(unittest.TestCase):
    def test_crc_32_of_a_word(self):
        board = FakeBoard()
        board.write("CRC", 0, 0)
        self.assertEqual(board.read("CRC", 0), 0xC704_DD7B)
        board.write("CRC", 8, 1)
        word = 0x1234_5678
        board.write("CRC", 0, word)
        reflected = int(f"{word:032b}"[::-1], 2).to_bytes(4, "little")
        expected = int(f"{zlib.crc32(reflected) ^ 0xFFFF_FFFF:032b}"[::-1], 2)
        self.assertEqual(board.read("CRC", 0), expected)


if __name__ == "__main__":
    unittest.main()

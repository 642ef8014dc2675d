"""Embedded flash interface: section 3 of RM0090."""

from .fake_board import MS, US, PeripheralTest
from virtual_board.violation import Violation

ACR, KEYR, OPTKEYR, SR, CR, OPTCR = 0x00, 0x04, 0x08, 0x0C, 0x10, 0x14
LOCK, STRT, BSY = 1 << 31, 1 << 16, 1 << 16
X32 = 2 << 8
SECTOR_1 = 0x0800_4000


class Flash(PeripheralTest):
    name = "FLASH"

    def setUp(self):
        super().setUp()
        self.flash = self.board.peripherals["FLASH"]

    def unlock(self):
        self.write(KEYR, 0x4567_0123)
        self.write(KEYR, 0xCDEF_89AB)

    def word(self, address=SECTOR_1):
        return int.from_bytes(self.board.memory_read(address, 4), "little")

    def test_reset_values(self):
        self.assertEqual([self.read(offset) for offset in (ACR, SR, CR, OPTCR)], [0, 0, LOCK, 0x0FFF_AAED])

    def test_lock_blocks_the_control_register(self):
        self.write(CR, 0x2)
        self.write(CR, STRT | 0x2)
        self.assertEqual(self.read(CR), LOCK)
        self.assertEqual(self.read(SR), 0)

    def test_a_write_that_carries_lock_locks_again(self):
        self.unlock()
        self.write(CR, LOCK | X32 | 0x0A)
        self.write(CR, LOCK | STRT | X32 | 0x0A)
        self.assertFalse(self.read(SR) & BSY)
        self.assertTrue(self.read(CR) & LOCK)

    def test_a_wrong_key_locks_until_the_next_reset(self):
        self.write(KEYR, 0x4567_0123)
        self.write(KEYR, 0x4567_0123)
        self.unlock()
        self.assertTrue(self.read(CR) & LOCK)
        self.board.reset("software")
        self.unlock()
        self.assertFalse(self.read(CR) & LOCK)

    def test_a_controller_that_a_reset_does_not_lock(self):
        self.flash.configure("starts_unlocked", True)
        self.board.reset("software")
        self.assertEqual(self.read(CR), 0)

    def test_sector_erase_takes_its_time_and_stalls(self):
        self.board.memory_write(SECTOR_1, bytes(0x4000))
        self.unlock()
        self.write(CR, X32 | 1 << 3 | 2)
        self.write(CR, STRT | X32 | 1 << 3 | 2)
        self.assertTrue(self.read(SR) & BSY)
        self.assertEqual(self.board.stalled_until - self.board.now, 250 * MS)
        self.board.advance(249 * MS)
        self.assertTrue(self.read(SR) & BSY)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(SR), 0)
        self.assertEqual(self.board.memory_read(SECTOR_1, 0x4000), b"\xFF" * 0x4000)
        self.assertFalse(self.read(CR) & STRT)

    def test_erase_times_by_sector(self):
        for sector, milliseconds in ((1, 250), (4, 550), (11, 1000)):
            self.unlock()
            self.write(CR, STRT | X32 | sector << 3 | 2)
            self.assertEqual(self.board.stalled_until - self.board.now, milliseconds * MS)
            self.board.advance(3000 * MS)
            self.write(CR, LOCK)

    def test_what_is_left_out_ends_the_run(self):
        self.unlock()
        for value in (X32 | 4, X32 | 1 << 24, STRT | 1 << 3 | 2, STRT | X32 | 12 << 3 | 2, STRT | X32 | 1 << 3 | 3):
            with self.assertRaises(Violation):
                self.write(CR, value)

    def test_programming_only_clears_bits(self):
        self.unlock()
        self.write(CR, X32 | 1)
        self.flash.program(SECTOR_1, 0x1234_5678, 4)
        self.assertEqual(self.board.stalled_until - self.board.now, 16 * US)
        self.board.advance(16 * US)
        self.assertEqual(self.word(), 0x1234_5678)
        self.flash.program(SECTOR_1, 0xFFFF_0000, 4)
        self.board.advance(16 * US)
        self.assertEqual(self.word(), 0x1234_0000)
        self.assertEqual(len(self.board.events("programmed_over")), 1)

    def test_programming_errors(self):
        self.flash.program(SECTOR_1, 0, 4)
        self.assertEqual(self.read(SR), 1 << 7)
        self.write(SR, 1 << 7)
        self.unlock()
        self.write(CR, X32 | 1)
        self.flash.program(SECTOR_1, 0, 1)
        self.assertEqual(self.read(SR), 1 << 6)
        self.flash.program(SECTOR_1 + 14, 0, 4)
        self.assertEqual(self.read(SR), 1 << 6 | 1 << 5)
        self.write(SR, 0xFF)
        self.assertEqual(self.read(SR), 0)
        self.assertEqual(self.word(), 0xFFFF_FFFF)

    def test_protected_sector(self):
        self.board.configure("FLASH", "option_bytes", 0x0FFD_AAED)
        self.unlock()
        self.write(CR, STRT | X32 | 1 << 3 | 2)
        self.assertEqual(self.read(SR), 1 << 4)

    def test_low_supply_leaves_garbage(self):
        self.board.configure("PWR", "supply_mv", 2500)
        self.unlock()
        self.write(CR, X32 | 1)
        self.flash.program(SECTOR_1, 0x1234_5678, 4)
        self.board.advance(16 * US)
        self.assertNotEqual(self.word(), 0x1234_5678)
        self.assertEqual(len(self.board.events("program_below_voltage")), 1)

    def test_a_power_cut_in_an_erase_leaves_a_mixture(self):
        self.board.memory_write(SECTOR_1, bytes(0x4000))
        self.unlock()
        self.write(CR, STRT | X32 | 1 << 3 | 2)
        self.board.advance(100 * MS)
        self.board.configure("PWR", "supply_mv", 0)
        ones = int.from_bytes(self.board.memory_read(SECTOR_1, 0x4000), "little").bit_count() / (8 * 0x4000)
        self.assertAlmostEqual(ones, 0.4, delta=0.02)
        self.assertEqual(self.read(SR), 0)

    def test_a_power_cut_in_a_word_leaves_some_of_its_bits(self):
        self.unlock()
        self.write(CR, X32 | 1)
        self.flash.program(SECTOR_1, 0, 4)
        self.board.advance(8 * US)
        self.board.reset("por")
        self.assertNotIn(self.word(), (0, 0xFFFF_FFFF))

    def test_caches_are_reset_only_while_disabled(self):
        self.write(ACR, 1 << 9)
        with self.assertRaises(Violation):
            self.write(ACR, 1 << 9 | 1 << 11)

    def test_brown_out_level_is_programmed_and_loaded_at_reset(self):
        self.write(OPTKEYR, 0x0819_2A3B)
        self.write(OPTKEYR, 0x4C5D_6E7F)
        self.write(OPTCR, 0x0FFF_AAE0)
        self.write(OPTCR, 0x0FFF_AAE2)
        self.assertTrue(self.read(SR) & BSY)
        self.board.advance(1000 * MS)
        self.assertEqual(self.flash.bor_level, 3)
        self.board.reset("software")
        self.assertEqual(self.flash.bor_level, 0)
        self.assertEqual(self.read(OPTCR), 0x0FFF_AAE1)

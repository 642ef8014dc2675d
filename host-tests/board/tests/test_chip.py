"""Core and peripherals together: stores to flash, stalls, clock gates, cuts of the power."""

import struct
import unittest

from virtual_board.board import Board
from virtual_board.peripherals import create
from virtual_board.snapshot import Snapshot
from virtual_board.violation import Violation

MAIN = 0x0800_0400
TARGET = 0x0806_0000  # the first word of sector 7
KEYS = {"r1": 0x4567_0123, "r2": 0xCDEF_89AB}
PROGRAM_X32, ERASE_SECTOR_7 = 0x201, 0x2 | 7 << 3 | 2 << 8 | 1 << 16
# str r1, [r0, #4]; str r2, [r0, #4]; str r3, [r0, #0x10]; str r5, [r4]; ldr r6, [r0, #0xc]; ldr r7, [r4]; b .
STORE = "416042600361" "2560" "c66827 68fee7".replace(" ", "")
# str r1, [r0, #4]; str r2, [r0, #4]; str r3, [r0, #0x10]; ldr r6, [r0, #0xc]; ldr r7, [r4]; b .
ERASE = "416042600361" "c66827 68fee7".replace(" ", "")
US, MS = 1_000_000, 1_000_000_000


def chip(main: str, **registers: int) -> Board:
    """A whole chip at 16 MHz with a program in flash."""
    board = Board(None, create)
    board.memory_write(0x0800_0000, struct.pack("<2I", 0x2000_2000, MAIN | 1))
    board.memory_write(MAIN, bytes.fromhex(main))
    board.power_on()
    for name, value in registers.items():
        board.processor.set(name, value)
    return board


def flash_chip(main: str, command: int) -> Board:
    return chip(main, r0=0x4002_3C00, r3=command, r4=TARGET, r5=0x1234_5678, **KEYS)


def word(board: Board) -> int:
    return int.from_bytes(board.memory_read(TARGET, 4), "little")


class Flash(unittest.TestCase):
    def test_a_store_programs_the_array_and_holds_the_core_for_16_us(self):
        board = flash_chip(STORE, PROGRAM_X32)
        board.run(10 * US)
        self.assertEqual(word(board), 0xFFFF_FFFF)
        self.assertLess(board.instructions, 6)
        board.run(30 * US)
        self.assertEqual(word(board), 0x1234_5678)
        self.assertEqual(board.processor.get("r7"), 0x1234_5678)
        self.assertEqual(board.processor.get("r6"), 0)

    def test_a_store_without_pg_changes_nothing(self):
        board = flash_chip(STORE, 0x200)
        board.run(100 * US)
        self.assertEqual(word(board), 0xFFFF_FFFF)
        self.assertEqual(board.processor.get("r6"), 1 << 7)  # PGSERR

    def test_an_erase_holds_the_core_until_the_sector_is_blank(self):
        board = flash_chip(ERASE, ERASE_SECTOR_7)
        board.memory_write(TARGET, bytes(16))
        board.run(900 * MS)
        self.assertEqual(board.processor.get("r7"), 0)
        board.run(1_100 * MS)
        self.assertEqual(board.processor.get("r7"), 0xFFFF_FFFF)
        self.assertLess(board.instructions, 2_000_000)

    def test_a_cut_at_each_access_of_a_store_leaves_the_word_old_new_or_between(self):
        board = flash_chip(STORE, PROGRAM_X32)
        start = Snapshot(board)
        seen = set()
        for accesses in range(1, 6):
            for delay in (0, 8 * US, 20 * US):
                start.restore(board)
                board.bus.count("FLASH", accesses, lambda: board.schedule(delay, board.power_off))
                board.run(100 * US)
                self.assertFalse(board.powered)
                self.assertEqual(word(board) & 0x1234_5678, 0x1234_5678)
                seen.add(word(board))
        self.assertIn(0xFFFF_FFFF, seen)
        self.assertIn(0x1234_5678, seen)


class Conditional(unittest.TestCase):
    #: cmp r0, #1; itt ne; <access>; movne r3, #3; movs r6, #0; b .+2; adds r4, r4, #1; adds r5, r5, #1; b .
    BLOCK = "0128" "1cbf" "{}" "0323" "0026" "ffe7" "641c" "6d1c" "fee7"
    LOAD, STORE = "1168", "1160"  # r1 at r2

    def test_what_follows_an_it_block_does_not_depend_on_its_condition(self):
        places = {"RAM": 0x2000_0000, "core-coupled memory": 0x1000_0000, "a register": 0x4002_3C0C, "flash": 0x0806_0000}
        for place, address in places.items():
            for access in (self.LOAD, self.STORE):
                with self.subTest(place, access=access):
                    board = chip(self.BLOCK.format(access), r0=0, r2=address, r3=0, r4=0, r5=0)
                    board.run(10 * US)
                    self.assertEqual([board.processor.get(name) for name in ("r3", "r4", "r5")], [3, 1, 1])


class Gates(unittest.TestCase):
    def test_a_peripheral_answers_once_its_clock_is_on(self):
        # str r1, [r0]; nop; nop; ldr r2, [r3]; b .
        board = chip("016000bf00bf1a68fee7", r0=0x4002_3840, r1=1 << 17, r3=0x4000_4400)
        board.run(10 * US)
        self.assertEqual(board.processor.get("r2"), 0xC0)  # the reset value of USART2_SR

    def test_a_peripheral_without_its_clock_ends_the_run(self):
        board = chip("00bf00bf00bf1a68fee7", r3=0x4000_4400)
        with self.assertRaisesRegex(Violation, "USART2"):
            board.run(10 * US)

"""Reset, power, snapshots and the counted cut."""

import unittest

from virtual_board.elf import Elf
from virtual_board.snapshot import Snapshot

from .program import HERE, INSTRUCTION, MAIN, STACK, US, Program

# str r1, [r0]; adds r1, r1, #1; b .-4
WRITE_FOR_EVER = "0160491cfff7fcbf"


class Resets(unittest.TestCase):
    def test_a_reset_loads_stack_and_program_counter_and_leaves_ram(self):
        program = Program(HERE)
        program.board.memory_write(0x2000_0100, b"kept")
        program.set(sp=0x2000_0800, primask=1)
        program.board.schedule(0, lambda: program.board.request_reset("pin"))
        program.run(3)
        self.assertEqual((program.get("sp"), program.get("primask")), (STACK, 0))
        self.assertEqual(program.get("lr"), 0xFFFF_FFFF)
        self.assertEqual(program.board.memory_read(0x2000_0100, 4), b"kept")

    def test_software_resets_with_the_key_alone(self):
        # str r1, [r0]; movs r4, #9; b .
        for value, reset in ((0x05FA_0004, True), (0x1234_0004, False)):
            program = Program("01600924fee7", r0=0xE000_ED0C, r1=value, r4=0).run(1)
            program.run(6)
            self.assertEqual(program.board.log[-1].get("cause") == "software", reset)

    def test_ram_holds_noise_after_power_on_and_the_same_noise_for_a_seed(self):
        first, second = Program(HERE).board, Program(HERE).board
        self.assertEqual(first.memory_read(0x2000_4000, 64), second.memory_read(0x2000_4000, 64))
        self.assertGreater(len(set(first.memory_read(0x2000_4000, 64))), 16)
        before = first.memory_read(0x2000_4000, 64)
        first.power_off()
        first.power_on()
        self.assertNotEqual(before, first.memory_read(0x2000_4000, 64))

    def test_nothing_happens_without_power_but_time(self):
        program = Program(HERE).run(10)
        program.board.power_off()
        instructions = program.board.instructions
        program.board.run(program.board.now + 1_000 * US)
        self.assertEqual(program.board.instructions, instructions)

    def test_flash_is_seen_at_address_zero(self):
        board = Program(HERE).board
        self.assertEqual(board.memory_read(0, 8), board.memory_read(0x0800_0000, 8))


class Cuts(unittest.TestCase):
    def test_power_goes_right_after_the_counted_access(self):
        program = Program(WRITE_FOR_EVER, r0=0x4000_0000, r1=1)
        board = program.board
        board.bus.count("ECHO", 5, board.power_off)
        board.run(1_000 * US)
        self.assertFalse(board.powered)
        self.assertEqual(board.peripherals["ECHO"].values, {0: 5})


class Snapshots(unittest.TestCase):
    def state(self, program):
        board = program.board
        registers = program.board.processor.general.read()
        return registers, board.now, board.instructions, dict(board.peripherals["ECHO"].values), bytes(board.memory.sram.view)

    def test_a_restored_board_does_the_same_again(self):
        # str r1, [r0]; adds r1, r1, #1; push {r1}; b .-6
        program = Program("0160491c02b4fff7fbbf", r0=0x4000_0000, r1=1).run(50)
        snapshot = Snapshot(program.board)
        program.run(100)
        later = self.state(program)
        for _ in range(2):
            snapshot.restore(program.board)
            self.assertNotEqual(self.state(program), later)
            program.run(100)
            self.assertEqual(self.state(program), later)

    def test_changed_code_and_scheduled_calls_come_back(self):
        program = Program("0134fdf7feff"[:4] + "fde7", r4=0)  # adds r4, #1; b .-2
        seen = []
        program.board.schedule(100 * INSTRUCTION, lambda: seen.append(program.board.now))
        program.run(10)
        snapshot = Snapshot(program.board)
        program.board.memory_write(MAIN, bytes.fromhex(HERE))
        program.run(200)
        frozen = program.get("r4")
        snapshot.restore(program.board)
        program.run(200)
        self.assertGreater(program.get("r4"), frozen + 50)
        self.assertEqual(len(seen), 2)


class Images(unittest.TestCase):
    def test_what_is_no_elf_file_is_refused(self):
        with self.assertRaises(ValueError):
            Elf(b"\x7fELF\x02\x01" + bytes(60))

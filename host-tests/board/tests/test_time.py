"""Time, SysTick, the cycle counter and sleep: DDI0403 B3.3, C1.8 and B1.5.17."""

import unittest

from .program import COUNT, CORE_HZ, HERE, INSTRUCTION, US, Program

SYSTICK = 15
CLOCK = 10**12 // CORE_HZ
# wfi; adds r4, r4, #1; b .-4
SLEEP = "30bf641cfff7fcbf"
CSR, RVR, CVR = range(0xE000_E010, 0xE000_E01C, 4)
CYCCNT = 0xE000_1004


def start_systick(program, reload):
    bus = program.board.bus
    bus.write(RVR, reload, 4)
    bus.write(CVR, 0, 4)
    bus.write(CSR, 7, 4)


class Ticks(unittest.TestCase):
    def test_a_period_is_reload_plus_one_clocks(self):
        program = Program(HERE, {SYSTICK: COUNT}, r0=0x2000_0000)
        program.board.memory_write(0x2000_0000, bytes(4))
        start_systick(program, CORE_HZ // 1000 - 1)
        program.board.run(100_500 * US)
        self.assertEqual(program.words(0x2000_0000, 1), (100,))

    def test_short_periods_do_not_drift(self):
        program = Program(HERE, {SYSTICK: COUNT}, r0=0x2000_0000)
        program.board.memory_write(0x2000_0000, bytes(4))
        start_systick(program, 99)
        program.board.run(100_050 * CLOCK)
        self.assertEqual(program.words(0x2000_0000, 1), (1_000,))

    def test_the_counter_counts_down_and_reloads(self):
        program = Program(HERE)
        start_systick(program, 999)
        read = program.board.bus.read
        program.board.run(301 * CLOCK)
        self.assertAlmostEqual(read(CVR, 4), 700, delta=3)
        program.board.run(1_301 * CLOCK)
        self.assertAlmostEqual(read(CVR, 4), 700, delta=3)

    def test_a_loop_sees_time_pass_between_two_register_reads(self):
        # nop x4; ldr r1, [r0]; nop x8; ldr r2, [r0]; subs r1, r1, r2; b .
        program = Program("00bf" * 4 + "0168" + "00bf" * 8 + "0268" + "891a" + HERE, r0=CVR)
        start_systick(program, 99_999)
        program.run(20)
        self.assertAlmostEqual(program.get("r1"), 9 * 1.3, delta=1)

    def test_an_instruction_takes_its_time(self):
        program = Program(HERE)
        program.board.run(1_000 * INSTRUCTION)
        self.assertEqual(program.board.instructions, 1_000)

    def test_the_cycle_counter_counts_once_tracing_and_counter_are_on(self):
        program = Program(HERE)
        bus = program.board.bus
        program.run(100)
        self.assertEqual(bus.read(CYCCNT, 4), 0)
        bus.write(0xE000_EDFC, 1 << 24, 4)
        bus.write(0xE000_1000, 1, 4)
        program.run(1_000)
        self.assertAlmostEqual(bus.read(CYCCNT, 4), 1_300, delta=2)

    def test_a_changed_core_clock_changes_the_pace(self):
        program = Program(HERE)
        program.board.rcc.core_hz = CORE_HZ // 10
        program.board.clocks_changed()
        program.board.run(1_000 * INSTRUCTION)
        self.assertEqual(program.board.instructions, 100)

    def test_the_cycle_counter_follows_a_changed_core_clock(self):
        program = Program(HERE)
        bus = program.board.bus
        bus.write(0xE000_EDFC, 1 << 24, 4)
        bus.write(0xE000_1000, 1, 4)
        program.run(1_000)
        program.board.rcc.core_hz = CORE_HZ // 10
        program.board.clocks_changed()
        program.board.run(2_000 * INSTRUCTION)
        self.assertAlmostEqual(bus.read(CYCCNT, 4), 1_430, delta=3)


class Sleep(unittest.TestCase):
    def test_wfi_waits_for_the_next_interrupt(self):
        program = Program(SLEEP, {SYSTICK: "7047"}, r4=0)
        start_systick(program, CORE_HZ // 1000 - 1)
        program.board.run(10_500 * US)
        self.assertEqual(program.get("r4"), 10)
        self.assertLess(program.board.instructions, 100)
        self.assertGreater(program.board.slept, 10_000 * US)

    def test_wfi_ends_for_an_interrupt_that_primask_holds_back(self):
        program = Program("72b630bf0924fee7", r4=0)  # cpsid i; wfi; movs r4, #9; b .
        start_systick(program, 9_999)
        program.board.run(50 * US)
        self.assertEqual(program.get("r4"), 0)
        program.board.run(200 * US)
        self.assertEqual(program.get("r4"), 9)
        self.assertIsNone(program.handler)

    def test_wfi_with_an_interrupt_pending_goes_on_at_once(self):
        program = Program("72b630bf0924fee7", r4=0)
        program.set(primask=1)
        program.board.nvic.pend(SYSTICK)
        program.run(10)
        self.assertEqual(program.get("r4"), 9)

    def test_a_stall_holds_the_core_and_lets_time_pass(self):
        program = Program(HERE)
        program.board.stall(1_000 * US)
        program.board.run(1_000 * US)
        self.assertEqual(program.board.instructions, 0)
        program.board.run(1_001 * US)
        self.assertGreater(program.board.instructions, 0)

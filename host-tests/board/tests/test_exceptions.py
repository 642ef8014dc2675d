"""Exception entry, return and priorities: DDI0403 B1.5."""

import unittest

from .program import COUNT, HERE, MAIN, STACK, Program

SVC, PENDSV, SYSTICK = 11, 14, 15
RETURN = "7047"  # bx lr
# movs r0, #1; movs r1, #2; movs r2, #3; movs r3, #4; mov r12, r1; svc #0; b .
SVC_WITH_REGISTERS = "01200221032204238c4600dffee7"
# cpsid i; nop; nop; nop; nop; cpsie i; nop; nop; b .
MASKED = "72b600bf00bf00bf00bf62b600bf00bffee7"
# movs r0, #0x40; msr basepri, r0; nop; nop; movs r0, #0; msr basepri, r0; nop; nop; b .
MASKED_BY_PRIORITY = "402080f3118800bf00bf002080f3118800bf00bffee7"
# mov r0, sp; msr psp, r0; movs r1, #2; msr control, r1; isb; sub sp, sp, #256; svc #0; movs r4, #9; b .
ON_PROCESS_STACK = "684680f30988022181f31488bff36f8fc0b000df0924fee7"
# vmov.f32 s0, #1.0; vmov.f32 s15, #2.0; svc #0; b .
WITH_FPU = "b7ee000af0ee007a00dffee7"
# vmov.f32 s0, #1.0; vmov.f32 s15, #2.0; vcmp.f32 s0, s15; svc #0; vmrs apsr_nzcv, fpscr; b .
COMPARED = "b7ee000af0ee007ab4ee670a00dff1ee10fafee7"
# vmov.f32 s0, #2.0; bx lr
SPOIL_FPU = "b0ee000a7047"


class Entry(unittest.TestCase):
    def test_an_svc_stores_the_frame_of_eight_words(self):
        program = Program(SVC_WITH_REGISTERS, lr=0xAAAA_AAAA).run(30)
        self.assertEqual(program.handler, SVC)
        self.assertEqual(program.get("sp"), STACK - 32)
        *general, pc, xpsr = program.words(STACK - 32, 8)
        self.assertEqual(general, [1, 2, 3, 4, 2, 0xAAAA_AAAA])
        self.assertEqual(pc, MAIN + 12)
        self.assertEqual(xpsr & 0x0100_03FF, 0x0100_0000)
        self.assertEqual(program.get("lr"), 0xFFFF_FFF9)
        self.assertEqual(program.get("xpsr") & 0x1FF, SVC)

    def test_the_frame_is_aligned_to_eight_bytes_and_the_step_is_kept_in_it(self):
        program = Program("00df0924fee7", {SVC: HERE}, stack=STACK - 4)  # svc #0; movs r4, #9; b .
        program.run(20)
        self.assertEqual(program.get("sp"), STACK - 40)
        self.assertTrue(program.words(STACK - 40, 8)[7] & 1 << 9)

    def test_a_return_goes_on_behind_the_svc_with_the_old_stack_and_flags(self):
        # movs r5, #0 (sets Z); svc #0; mov r4, r7; b . -- the handler clears Z: movs r5, #1; bx lr
        program = Program("002500df3c46fee7", {SVC: "01257047"}, stack=STACK - 4, r4=0, r7=9).run(2)
        program.run(20)
        self.assertEqual(program.get("r4"), 9)
        self.assertEqual(program.get("sp"), STACK - 4)
        self.assertEqual(program.get("xpsr") >> 28, 0b0100)
        self.assertEqual(program.get("xpsr") & 0x1FF, 0)
        self.assertIsNone(program.handler)

    def test_a_thread_on_the_process_stack_returns_to_it(self):
        program = Program(ON_PROCESS_STACK, {SVC: RETURN}, r4=0).run(60)
        self.assertEqual(program.get("r4"), 9)
        self.assertEqual(program.get("sp"), STACK - 256)
        self.assertEqual(program.get("msp"), STACK)
        self.assertEqual(program.get("control") & 2, 2)

    def test_a_handler_runs_on_the_main_stack(self):
        program = Program(ON_PROCESS_STACK).run(30)
        self.assertEqual(program.handler, SVC)
        self.assertEqual(program.get("lr"), 0xFFFF_FFFD)
        self.assertEqual(program.get("psp"), STACK - 256 - 32)
        self.assertEqual(program.get("sp"), STACK)
        self.assertEqual(program.get("control") & 2, 0)

    def test_a_program_that_used_the_fpu_has_a_frame_of_26_words(self):
        program = Program(WITH_FPU).run(30)
        self.assertEqual(program.get("sp"), STACK - 104)
        self.assertEqual(program.get("lr"), 0xFFFF_FFE9)
        stored = program.words(STACK - 104, 26)
        self.assertEqual((stored[8], stored[23]), (0x3F80_0000, 0x4000_0000))
        self.assertEqual(program.get("control") & 4, 0)

    def test_a_return_restores_the_fpu_and_fpscr_for_its_next_instruction(self):
        """DDI0403 B1.5.8, PopStack: FPSCR comes from the frame, with the flags of the comparison before the exception."""
        program = Program(COMPARED, {SVC: SPOIL_FPU}).run(60)
        self.assertIsNone(program.handler)
        self.assertEqual(program.get("d0") & 0xFFFF_FFFF, 0x3F80_0000)
        self.assertEqual(program.get("control") & 4, 4)
        self.assertEqual(program.get("sp"), STACK)
        self.assertEqual(program.get("fpscr") >> 28, 8)
        self.assertEqual(program.get("xpsr") >> 28, 8)


class Priorities(unittest.TestCase):
    def pend(self, program, **priorities):
        """Enables interrupts by number (`n3=0x40`) and makes them pending."""
        nvic = program.board.nvic
        for name, priority in priorities.items():
            number = 16 + int(name[1:])
            nvic.enabled |= 1 << number
            nvic.priority[number] = priority
            nvic.pend(number)

    def test_the_higher_priority_comes_first_and_at_equal_ones_the_lower_number(self):
        for ninth, first in ((0x30, 9), (0x40, 3)):
            program = Program(HERE)
            self.pend(program, n3=0x40, n9=ninth)
            program.run(20)
            self.assertEqual(program.handler, 16 + first)

    def test_a_higher_priority_preempts_a_handler_and_an_equal_one_does_not(self):
        program = Program(HERE)
        self.pend(program, n3=0x40)
        program.run(20)
        self.pend(program, n1=0x40)
        program.run(20)
        self.assertEqual(program.handler, 16 + 3)
        self.pend(program, n9=0x30)
        program.run(20)
        self.assertEqual(program.handler, 16 + 9)
        self.assertEqual(program.get("lr"), 0xFFFF_FFF1)

    def test_pending_exceptions_follow_each_other_without_an_instruction_between(self):
        program = Program(HERE, {16 + 3: COUNT, 16 + 4: COUNT}, r0=0x2000_0000)
        program.board.memory_write(0x2000_0000, bytes(4))
        self.pend(program, n3=0x40, n4=0x40)
        program.run(100)
        self.assertEqual(program.words(0x2000_0000, 1), (2,))
        self.assertIsNone(program.handler)
        self.assertEqual(program.board.nvic.active, 0)

    def test_primask_holds_an_interrupt_back_until_it_is_cleared(self):
        program = Program(MASKED).run(2)
        self.pend(program, n3=0)
        program.run(2)
        self.assertIsNone(program.handler)
        program.run(60)
        self.assertEqual(program.handler, 16 + 3)

    def test_basepri_holds_back_its_own_priority_and_lower_ones(self):
        program = Program(MASKED_BY_PRIORITY).run(2)
        self.pend(program, n3=0x40)
        program.run(2)
        self.assertIsNone(program.handler)
        self.pend(program, n9=0x30)
        program.run(10)
        self.assertEqual(program.handler, 16 + 9)

    def test_basepri_releases_what_it_held_back(self):
        program = Program(MASKED_BY_PRIORITY).run(2)
        self.pend(program, n3=0x40)
        program.run(60)
        self.assertEqual(program.handler, 16 + 3)

    def test_a_line_that_stays_high_makes_its_interrupt_pending_again(self):
        program = Program(HERE, {16 + 5: COUNT}, r0=0x2000_0000)
        program.board.memory_write(0x2000_0000, bytes(4))
        program.board.nvic.enabled |= 1 << 16 + 5
        program.board.irq(5, True)
        program.run(300)
        self.assertGreater(program.words(0x2000_0000, 1)[0], 5)
        program.board.irq(5, False)
        program.run(100)
        self.assertIsNone(program.handler)

    def test_an_edge_while_the_handler_runs_brings_it_once_more(self):
        # ldr r1, [r0]; adds r1, r1, #1; str r1, [r0]; nop x8; bx lr
        program = Program(HERE, {16 + 5: "0168491c0160" + "00bf" * 8 + "7047"}, r0=0x2000_0000)
        program.board.memory_write(0x2000_0000, bytes(4))
        program.board.nvic.enabled |= 1 << 16 + 5
        program.board.irq(5, True)
        program.board.irq(5, False)
        program.run(14)
        self.assertEqual(program.handler, 16 + 5)
        program.board.irq(5, True)
        program.board.irq(5, False)
        program.run(100)
        self.assertEqual(program.words(0x2000_0000, 1), (2,))

    def test_a_register_write_that_raises_an_interrupt_is_followed_by_its_handler(self):
        # movs r1, #1; str r1, [r0, #4]; movs r4, #9; b .
        program = Program("012141600924fee7", r0=0x4000_0000, r4=0)
        program.board.nvic.enabled |= 1 << 16 + 5
        program.run(30)
        self.assertEqual(program.handler, 16 + 5)
        self.assertEqual(program.get("r4"), 0)
        self.assertEqual(program.words(STACK - 32, 8)[6], MAIN + 4)

    def test_pendsv_is_set_and_cleared_through_icsr(self):
        program = Program(HERE)
        program.board.bus.write(0xE000_ED04, 1 << 28, 4)
        program.board.bus.write(0xE000_ED04, 1 << 27, 4)
        program.run(10)
        self.assertIsNone(program.handler)
        program.board.bus.write(0xE000_ED04, 1 << 28, 4)
        program.run(20)
        self.assertEqual(program.handler, PENDSV)

    def test_registers_of_the_controller_read_back(self):
        program = Program(HERE)
        bus = program.board.bus
        bus.write(0xE000_E104, 1 << 6, 4)
        self.assertEqual(bus.read(0xE000_E104, 4), 1 << 6)
        bus.write(0xE000_E184, 1 << 6, 4)
        self.assertEqual(bus.read(0xE000_E104, 4), 0)
        bus.write(0xE000_E426, 0xFF, 1)
        self.assertEqual(bus.read(0xE000_E424, 4), 0x00F0_0000)
        bus.write(0xE000_ED23, 0xC7, 1)  # the priority of SysTick
        self.assertEqual(bus.read(0xE000_ED20, 4), 0xC000_0000)

"""Faults, their status registers, escalation and lockup: DDI0403 B1.5.14, B1.5.15 and B3.2."""

import unittest

from virtual_board.violation import Violation

from .program import HERE, MAIN, STACK, Program

HARD_FAULT, SVC = 3, 11
FORCED, VECTTBL, DEBUGEVT = 1 << 30, 1 << 1, 1 << 31
UNDEFINED = "00de"  # udf #0
# movw r0, #0; movt r0, #0x3000; ldr r1, [r0, #4]; b .
BAD_READ = "40f20000c3f200004168fee7"
# movw r0, #1; movt r0, #0x1000; bx r0
FETCH_FROM_CCM = "40f20100c1f200000047"
FETCH_FROM_REGISTERS = "40f20100c4f200000047"  # as above, 0x4000_0000
# movs r0, #0; movt r0, #0x2000; bx r0
EVEN_TARGET = "0020c2f200000047"
# push {r0-r7}; b .-2
OVERFLOW = "ffb4fff7fdbf"
# vmov.f32 s0, #1.0; b .
FPU = "b7ee000afee7"


def events(program: Program, kind: str) -> list[dict]:
    return [entry for entry in program.board.log if entry["kind"] == kind]


class Faults(unittest.TestCase):
    def check(self, program, handler, cfsr, hfsr=0):
        self.assertEqual(program.handler, handler)
        self.assertEqual(program.board.scb.cfsr, cfsr)
        self.assertEqual(program.board.scb.hfsr, hfsr)

    def test_faults_without_a_handler_of_their_own_are_hardfaults(self):
        for name, main, cfsr, hfsr in (("an undefined instruction", UNDEFINED, 1 << 16, FORCED), ("a fetch from registers", FETCH_FROM_REGISTERS, 1 << 0, FORCED),
                                       ("a branch to an even address", EVEN_TARGET, 1 << 17, FORCED), ("the FPU is off", FPU, 1 << 19, FORCED),
                                       ("a breakpoint without a debugger", "00befee7", 0, DEBUGEVT)):
            with self.subTest(name):
                program = Program(main, fpu=False).run(20)
                self.check(program, HARD_FAULT, cfsr, hfsr)
                if main in (UNDEFINED, FPU):
                    self.assertEqual(program.words(STACK - 32, 8)[6], MAIN)

    def test_a_read_where_nothing_is_gives_a_precise_bus_fault_with_its_address(self):
        program = Program(BAD_READ, r1=77).run(20)
        self.check(program, HARD_FAULT, 1 << 9 | 1 << 15, FORCED)
        self.assertEqual(program.board.scb.bfar, 0x3000_0004)
        self.assertEqual(program.words(STACK - 32, 8)[6], MAIN + 8)
        self.assertEqual(program.get("r1"), 77)

    def test_nothing_can_be_fetched_from_the_core_coupled_memory(self):
        program = Program(FETCH_FROM_CCM)
        program.board.memory_write(0x1000_0000, b"\xfe\xe7" * 8)
        program.run(20)
        self.check(program, HARD_FAULT, 1 << 8, FORCED)

    def test_code_runs_from_ram(self):
        program = Program("40f20100c2f200000047")  # as above, 0x2000_0000
        program.board.memory_write(0x2000_0000, bytes.fromhex("0924fee7"))  # movs r4, #9; b .
        program.run(20)
        self.assertEqual(program.get("r4"), 9)
        self.assertIsNone(program.handler)

    def test_the_fpu_works_once_it_is_on(self):
        # ldr r0, =0xE000ED88 (movw, movt); movs r1, #0xF0; lsls r1, #16; str r1, [r0]; vmov.f32 s0, #1.0; b .
        program = Program("4ef68850cef20000f0210904" + "0160" + FPU, fpu=False).run(30)
        self.assertIsNone(program.handler)
        self.assertEqual(program.get("d0") & 0xFFFF_FFFF, 0x3F80_0000)

    def test_an_svc_that_is_masked_is_a_hardfault(self):
        program = Program("72b600dffee7")  # cpsid i; svc #0; b .
        program.run(20)
        self.assertEqual(program.handler, HARD_FAULT)

    def test_a_return_with_a_wrong_exc_return_is_an_invalid_pc(self):
        # movs r0, #14; mvns r0, r0 (0xFFFFFFF1: to a handler, where none is active); bx r0
        program = Program("00dffee7", {SVC: "0e20c0430047"}).run(40)
        self.check(program, HARD_FAULT, 1 << 18, FORCED)
        # No second frame (B1.5.8): the one of the SVC is still there, and LR keeps the value that was refused.
        self.assertEqual(program.get("sp"), STACK - 32)
        self.assertEqual(program.get("lr"), 0xFFFF_FFF1)

    def test_a_fault_in_hardfault_locks_the_core_up_and_time_goes_on(self):
        program = Program(UNDEFINED, {HARD_FAULT: UNDEFINED}).run(50)
        self.assertTrue(program.board.locked_up)
        self.assertEqual(len(events(program, "lockup")), 1)
        instructions, now = program.board.instructions, program.board.now
        program.run(1000)
        self.assertEqual(program.board.instructions, instructions)
        self.assertGreater(program.board.now, now)

    def test_a_reset_ends_the_lockup(self):
        program = Program(UNDEFINED, {HARD_FAULT: UNDEFINED}).run(50)
        program.board.memory_write(MAIN, bytes.fromhex(HERE))
        program.board.schedule(0, lambda: program.board.request_reset("iwdg"))
        program.run(20)
        self.assertFalse(program.board.locked_up)
        self.assertEqual(program.get("pc"), MAIN)
        self.assertEqual(events(program, "reset")[-1]["cause"], "iwdg")

    def test_a_stack_overflow_enters_hardfault_with_the_bad_stack_pointer(self):
        program = Program(OVERFLOW, stack=0x2000_0040).run(40)
        self.assertEqual(program.handler, HARD_FAULT)
        self.assertTrue(program.board.scb.cfsr & 1 << 12)  # STKERR
        self.assertLess(program.get("sp"), 0x2000_0000)

    def test_a_hardfault_handler_that_pushes_locks_up_after_a_stack_overflow(self):
        program = Program(OVERFLOW, {HARD_FAULT: "10b4fee7"}, stack=0x2000_0040)  # push {r4}; b .
        program.run(60)
        self.assertTrue(program.board.locked_up)

    def test_an_interrupt_whose_frame_cannot_be_stored_gives_a_hardfault_and_stays_pending(self):
        program = Program(HERE, stack=0x2000_0010)
        program.board.nvic.enabled |= 1 << 16 + 5
        program.board.nvic.pend(16 + 5)
        program.run(20)
        self.check(program, HARD_FAULT, 1 << 12, FORCED)
        self.assertTrue(program.board.nvic.pending >> 16 + 5 & 1)

    def test_a_vector_that_cannot_be_read_is_a_hardfault(self):
        program = Program("00dffee7")
        program.board.scb.vtor = 0x1000_FFE0  # The vectors of HardFault and SVCall would lie behind the memory's end,
        program.board.memory_write(0x1000_FFE0 + 12, (0x0800_1301).to_bytes(4, "little"))  # but for this one.
        program.run(30)
        self.assertEqual(program.handler, HARD_FAULT)
        self.assertEqual(program.board.scb.hfsr, VECTTBL)


class Refusals(unittest.TestCase):
    def refused(self, program) -> str:
        with self.assertRaises(Violation) as caught:
            program.run(20)
        return str(caught.exception)

    def test_an_address_without_a_peripheral_ends_the_run_and_says_where(self):
        program = Program("0168fee7", r0=0x4000_7000)  # ldr r1, [r0]; b .
        self.assertIn("address 0x40007000, pc 0x08000400", self.refused(program))

    def test_a_peripheral_without_its_clock_ends_the_run(self):
        program = Program("0160fee7", r0=0x4000_0400)  # str r1, [r0]; b .
        self.assertIn("GATED is used while its clock (GATED) is off", self.refused(program))

    def test_what_the_model_leaves_out_ends_the_run(self):
        bus = Program(HERE).board.bus
        for address, value in ((0xE000_ED24, 7 << 16), (0xE000_ED0C, 0x05FA_0600), (0xE000_ED94, 1), (0xE000_EF34, 0)):
            with self.assertRaises(Violation):
                bus.write(address, value, 4)

    def test_a_bit_band_alias_ends_the_run(self):
        for address in (0x2200_0000, 0x4200_0000):
            self.assertIn("bit-band", self.refused(Program("0168fee7", r0=address)))

    def test_nothing_runs_behind_the_refused_access(self):
        program = Program("01600924fee7", r0=0x4000_0400, r4=0)  # str r1, [r0]; movs r4, #9; b .
        self.refused(program)
        self.assertEqual(program.get("r4"), 0)

"""bxCAN and its bus: section 32 of RM0090 and ISO 11898-1."""

import unittest

from .fake_board import MS, US, PeripheralTest
from virtual_board.peripherals import can_frame
from virtual_board.peripherals.can_frame import Frame, frame_bits, priority
from virtual_board.violation import Violation

MCR, MSR, TSR, RF0R, IER, ESR, BTR = 0x00, 0x04, 0x08, 0x0C, 0x14, 0x18, 0x1C
FMR, FM1R, FS1R, FFA1R, FA1R, BANK = 0x200, 0x204, 0x20C, 0x214, 0x21C, 0x240
INRQ, TXFP = 1, 1 << 2
#: 16 MHz, prescaler 2, 1 + 13 + 2 quanta: 500 kbit/s.
BTR_500K = 1 << 24 | 1 << 20 | 12 << 16 | 1
BIT = 2 * US


class FrameLength(unittest.TestCase):
    def test_length_against_a_search_for_runs(self):
        """A frame of 8 bytes has 98 bits that may be stuffed, at most 24 times (ISO 11898-1)."""
        for identifier in (0, 0x78, 0x2AA, 0x7FF, 0x0F):
            for data in (bytes(8), b"\xAA" * 8, b"\xFF" * 8, bytes.fromhex("3C3C3C3C3C3C3C3C")):
                inserted = len(self.stuffing(identifier, data))
                self.assertLessEqual(inserted, 24)
                self.assertEqual(frame_bits(Frame.of(identifier, data)) - can_frame.TAIL_BITS - inserted, 98)

    @staticmethod
    def stuffing(identifier, data):
        """The stuff bits of a standard frame, found by a search for runs in the bits as written."""
        bits = f"0{identifier:011b}000{len(data):04b}" + "".join(f"{byte:08b}" for byte in data)
        bits += f"{can_frame._crc(bits):015b}"
        inserted, sent = [], ""
        for bit in bits:
            sent += bit
            if len(sent) >= 5 and len(set(sent[-5:])) == 1:
                inserted.append(len(sent))
                sent += "1" if bit == "0" else "0"
        return inserted

    def test_crc_of_frame_and_crc_is_zero(self):
        bits = "0" + f"{0x123:011b}" + "000" + "0001" + "10100101"
        crc = can_frame._crc(bits)
        self.assertEqual(can_frame._crc(bits + f"{crc:015b}"), 0)

    def test_priority(self):
        self.assertLess(priority(Frame.of(0x100)), priority(Frame.of(0x100, remote=True)))
        self.assertLess(priority(Frame.of(0x100, remote=True)), priority(Frame.of(0x100 << 18, extended=True)))
        self.assertLess(priority(Frame.of(0x100 << 18, extended=True)), priority(Frame.of(0x101)))


class BxCan(PeripheralTest):
    name, gates = "CAN1", ("CAN1", "GPIOA")

    def setUp(self):
        super().setUp()
        self.board.alternate("A", 11, 9)
        self.board.alternate("A", 12, 9)
        self.bus = self.board.peripherals["CAN1"].bus

    def initialise(self, timing=BTR_500K):
        self.write(MCR, INRQ)
        self.board.advance(10 * US)
        self.assertEqual(self.read(MSR) & 3, 1)
        self.write(BTR, timing)

    def start(self, mode=TXFP, timing=BTR_500K):
        self.initialise(timing)
        self.write(FMR, self.read(FMR) | 1)
        self.write(FS1R, 1)
        self.write(FA1R, 1)
        self.write(FMR, self.read(FMR) & ~1)
        self.write(MCR, mode)
        self.board.advance(100 * US)

    def transmit(self, identifier, data=b"\x01\x02", box=0):
        base = 0x180 + 16 * box
        self.write(base + 4, len(data))
        word = int.from_bytes(data.ljust(8, b"\0"), "little")
        self.write(base + 8, word & 0xFFFF_FFFF)
        self.write(base + 12, word >> 32)
        self.write(base, identifier << 21 | 1)

    def test_reset_values(self):
        expected = {MCR: 0x0001_0002, MSR: 0xC02, TSR: 0x1C00_0000, RF0R: 0, IER: 0, ESR: 0, BTR: 0x0123_0000, FMR: 0x2A1C_0E01}
        self.assertEqual({offset: self.read(offset) for offset in expected}, expected)

    def test_sleep_keeps_inak_away(self):
        self.write(MCR, 0x0001_0003)
        self.board.advance(10 * MS)
        self.assertEqual(self.read(MSR) & 3, 2)

    def test_leaving_initialisation_with_sleep_set_goes_to_sleep(self):
        self.initialise()
        self.write(MCR, 0x0001_0006)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(MSR) & 3, 2)

    def test_normal_mode_after_eleven_recessive_bits(self):
        self.initialise()
        self.write(MCR, TXFP)
        self.board.advance(21 * US)
        self.assertEqual(self.read(MSR) & 1, 1)
        self.board.advance(2 * US)
        self.assertEqual(self.read(MSR) & 3, 0)

    def test_asking_again_for_normal_mode_does_not_start_the_wait_anew(self):
        self.initialise()
        for _ in range(12):
            self.write(MCR, TXFP)
            self.board.advance(2 * US)
        self.assertEqual(self.read(MSR) & 3, 0)

    def test_what_is_left_out_ends_the_run(self):
        for offset, value in ((MCR, 1 << 3), (MCR, 1 << 4), (MCR, 1 << 5), (MCR, 1 << 6), (MCR, 1 << 7), (MCR, 1 << 15), (IER, 1 << 16),
                              (IER, 4), (0x10, 1 << 5), (0x1B0, 0), (0x184, 0x100)):
            with self.assertRaises(Violation):
                self.write(offset, value)
        with self.assertRaisesRegex(Violation, "TXFP"):
            self.start(0)
        for mode, scale, fifo in ((1, 1, 0), (0, 0, 0), (0, 1, 1)):
            with self.assertRaisesRegex(Violation, "FIFO 1"):
                self.start()
                self.filters(1, mode, scale, fifo, [0, 0])
                self.bus.send(0xAA)
                self.board.advance(1 * MS)

    def test_without_the_receive_pin_it_never_synchronises(self):
        self.board.alternate("A", 11, 1)
        self.initialise()
        self.write(MCR, 0)
        self.board.advance(10 * MS)
        self.assertEqual(self.read(MSR) & 1, 1)

    def test_bit_timing_only_in_initialisation(self):
        self.write(BTR, BTR_500K)
        self.assertEqual(self.read(BTR), 0x0123_0000)

    def test_a_frame_goes_out_with_its_exact_duration(self):
        self.start()
        begun = self.board.now
        self.transmit(0x1A1)
        self.assertEqual(self.read(TSR) >> 26 & 7, 0b110)
        self.board.advance(1 * MS)
        (logged,) = self.bus.take_log()
        self.assertEqual((logged.frame.identifier, logged.frame.data, logged.error), (0x1A1, b"\x01\x02", None))
        self.assertEqual(logged.end_ps - begun, frame_bits(logged.frame) * BIT)
        self.assertEqual(self.read(TSR), 0x1C00_0003)
        self.write(TSR, 1)
        self.assertEqual(self.read(TSR), 0x1C00_0000)

    def test_mailboxes_go_by_request(self):
        self.start()
        for box, identifier in ((0, 0x300), (2, 0x200), (1, 0x100)):
            self.transmit(identifier, box=box)
        self.board.advance(10 * MS)
        self.assertEqual([logged.frame.identifier for logged in self.bus.take_log()], [0x300, 0x200, 0x100])

    def test_code_and_low(self):
        self.board.configure("CAN1", "babble", True)
        self.start()
        self.board.advance(1 * MS)
        self.transmit(0x300, box=0)
        self.assertEqual(self.read(TSR) >> 24, 0b000_110_01)
        self.transmit(0x100, box=1)
        self.assertEqual(self.read(TSR) >> 24, 0b010_100_10)
        self.transmit(0x200, box=2)
        self.assertEqual(self.read(TSR) >> 24, 0b100_000_10)

    def test_a_pending_mailbox_is_write_protected(self):
        self.start()
        self.board.configure("CAN1", "acknowledge", False)
        self.transmit(0x100)
        self.write(0x188, 0xFFFF_FFFF)
        self.assertEqual(self.read(0x188), 0x0201)

    def test_transmit_interrupt(self):
        self.start()
        self.write(IER, 1)
        self.transmit(0x100)
        self.board.advance(1 * MS)
        self.assertTrue(self.board.lines[19])
        self.write(TSR, 1)
        self.assertFalse(self.board.lines[19])

    def test_missing_acknowledgement_ends_error_passive_not_bus_off(self):
        self.start()
        self.board.configure("CAN1", "acknowledge", False)
        self.transmit(0x100)
        self.board.advance(200 * MS)
        status = self.read(ESR)
        self.assertEqual((status & 7, status >> 4 & 7, status >> 16 & 0xFF), (3, 3, 128))
        self.board.configure("CAN1", "acknowledge", True)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(TSR) & 3, 3)
        self.assertEqual(self.read(ESR) >> 16 & 0xFF, 127)

    def test_abort(self):
        self.start()
        self.board.configure("CAN1", "connected", False)
        self.transmit(0x100)
        self.board.advance(10 * US)
        self.write(TSR, 1 << 7)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(TSR) & 0xFF, 1 | 8)
        self.bus.take_log()
        self.board.configure("CAN1", "connected", True)
        self.board.advance(10 * MS)
        self.assertEqual(self.bus.take_log(), [])

    def recover(self):
        """Software starts the recovery: it enters initialisation and leaves it."""
        self.write(MCR, INRQ | TXFP)
        self.board.advance(10 * US)
        self.assertEqual(self.read(MSR) & 1, 1)
        self.write(MCR, TXFP)

    def test_a_short_ends_in_bus_off_until_software_starts_the_recovery(self):
        self.start()
        self.write(IER, 1 << 15 | 1 << 10)
        self.board.configure("CAN1", "short", "recessive")
        self.transmit(0x100)
        self.board.advance(2 * MS)
        self.assertEqual(self.read(ESR) & 7, 7)
        self.assertTrue(self.board.lines[22])
        self.write(MSR, 4)
        self.assertFalse(self.board.lines[22])
        self.board.configure("CAN1", "short", None)
        self.board.advance(50 * MS)
        self.assertTrue(self.read(ESR) & 4)
        self.recover()
        begun = self.board.now
        self.board.advance(4 * MS)
        self.assertEqual(self.read(ESR) & 7, 0)
        self.assertEqual(self.read(TSR) & 3, 3)
        (ended,) = [event["at"] for event in self.board.log if event["kind"] == "bus_off_ended"]
        self.assertAlmostEqual(ended - begun, (11 + 1408) * BIT, delta=12 * BIT)

    def test_dominant_short_in_a_frame_ends_in_bus_off(self):
        self.start()
        self.transmit(0x100)
        self.board.advance(50 * US)
        self.board.configure("CAN1", "short", "dominant")
        self.board.advance(2 * MS)
        self.assertTrue(self.read(ESR) & 4)
        self.write(MCR, INRQ | TXFP)
        self.board.advance(1 * MS)
        self.write(MCR, TXFP)
        self.board.advance(100 * MS)
        self.assertTrue(self.read(ESR) & 4)
        self.board.configure("CAN1", "short", None)
        self.board.advance(10 * MS)
        self.assertFalse(self.read(ESR) & 4)

    def test_a_wrong_bit_rate_ends_in_bus_off(self):
        self.start(timing=BTR_500K & ~0x3FF | 2)
        self.transmit(0x100)
        self.board.advance(6 * MS)
        self.assertTrue(self.read(ESR) & 4)
        self.assertEqual({logged.error for logged in self.bus.take_log()}, {"bit rate"})

    def test_babble_lets_nothing_through(self):
        self.start()
        self.board.configure("CAN1", "babble", True)
        self.transmit(0x100)
        self.board.advance(100 * MS)
        sources = {logged.source for logged in self.bus.take_log()}
        self.assertEqual(sources, {"babble"})
        self.assertTrue(self.read(TSR) & 4)
        self.board.configure("CAN1", "babble", None)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(TSR) & 3, 3)

    def test_reception_and_overrun(self):
        self.start()
        self.write(IER, 2)
        for number in range(4):
            self.bus.send(0xAA, bytes([number, 9]))
        self.board.advance(300 * US)
        self.assertTrue(self.board.lines[20])
        self.board.advance(1 * MS)
        self.assertEqual(self.read(RF0R), 3 | 1 << 3 | 1 << 4)
        self.assertEqual([self.read(0x1B0), self.read(0x1B4), self.read(0x1B8)], [0xAA << 21, 2, 0x0900])
        self.write(RF0R, 1 << 5)
        self.write(RF0R, 1 << 5)
        self.assertEqual(self.read(0x1B8), 0x0903)
        self.write(RF0R, 1 << 5 | 1 << 4 | 1 << 3)
        self.assertEqual(self.read(RF0R), 0)
        self.assertFalse(self.board.lines[20])

    def filters(self, active, mode, scale, fifo, banks):
        self.write(FMR, self.read(FMR) | 1)
        for offset, value in ((FA1R, 0), (FM1R, mode), (FS1R, scale), (FFA1R, fifo)):
            self.write(offset, value)
        for index, value in enumerate(banks):
            self.write(BANK + 4 * index, value)
        self.write(FA1R, active)
        self.write(FMR, self.read(FMR) & ~1)

    def test_filter_masks(self):
        self.start()
        self.filters(0b101, 0, 0b101, 0, [0xAA << 21, 0x7FF << 21, 0, 0, 0x100 << 21, 0x7F0 << 21])
        for identifier in (0xAA, 0xAB, 0x10F, 0x110):
            self.bus.send(identifier)
        self.board.advance(3 * MS)
        self.assertEqual(self.read(RF0R) & 3, 2)
        self.assertEqual((self.read(0x1B0) >> 21, self.read(0x1B4) >> 8), (0xAA, 0))
        self.write(RF0R, 1 << 5)
        self.assertEqual((self.read(0x1B0) >> 21, self.read(0x1B4) >> 8), (0x10F, 3))

    def test_filter_locks(self):
        self.start()
        self.write(FM1R, 1)
        self.assertEqual(self.read(FM1R), 0)
        self.write(BANK, 5)
        self.assertEqual(self.read(BANK), 0)
        self.write(BANK + 8, 5)
        self.assertEqual(self.read(BANK + 8), 5)

    def test_no_reception_while_finit(self):
        self.start()
        self.write(FMR, self.read(FMR) | 1)
        self.bus.send(0xAA)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(RF0R), 0)

    def test_silent_loopback_is_heard_by_nobody(self):
        self.board.alternate("A", 11, 1)
        self.start(timing=BTR_500K | 1 << 31 | 1 << 30)
        self.transmit(0x123, b"\x77")
        self.board.advance(1 * MS)
        self.assertEqual(self.read(TSR) & 3, 3)
        self.assertEqual((self.read(RF0R) & 3, self.read(0x1B8)), (1, 0x77))
        self.assertEqual(self.bus.take_log(), [])

    def test_arbitration_with_another_node(self):
        self.start()
        self.bus.send(0x700, b"x")
        self.board.advance(10 * US)
        self.transmit(0x300)
        self.bus.send(0x200)
        self.board.advance(2 * MS)
        self.assertEqual([logged.frame.identifier for logged in self.bus.take_log()], [0x700, 0x200, 0x300])

    def test_a_reset_cuts_the_frame(self):
        self.start()
        self.transmit(0x100)
        self.board.advance(50 * US)
        self.board.reset("software")
        self.assertEqual(self.bus.take_log()[0].error, "reset")
        self.board.advance(1 * MS)
        self.assertEqual(self.bus.take_log(), [])

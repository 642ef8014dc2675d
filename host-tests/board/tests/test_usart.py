"""USARTs: section 30 of RM0090."""

from .fake_board import MS, US, PeripheralTest
from virtual_board.violation import Violation

SR, DR, BRR, CR1 = range(0, 0x10, 4)
RXNE, TC, TXE, ORE, FE, IDLE = 1 << 5, 1 << 6, 1 << 7, 1 << 3, 1 << 1, 1 << 4
UE_TE_RE = 0x200C


class Usart(PeripheralTest):
    name, gates = "USART2", ("USART2", "GPIOA")

    def setUp(self):
        super().setUp()
        self.usart = self.board.peripherals["USART2"]
        self.board.alternate("A", 2, 7)
        self.board.alternate("A", 3, 7)
        self.write(BRR, 139)
        self.write(CR1, UE_TE_RE)
        self.board.advance(1 * MS)

    def test_reset_value(self):
        self.assertEqual(self.board.read("USART6", SR), 0xC0)

    def test_a_byte_takes_ten_bits(self):
        begun = self.board.now
        self.write(DR, 0x55)
        self.assertTrue(self.read(SR) & TXE)
        self.read(SR)
        self.write(DR, 0xAA)
        self.assertFalse(self.read(SR) & (TXE | TC))
        self.board.advance(1 * MS)
        sent = self.usart.take_sent()
        self.assertEqual([byte for _, byte in sent], [0x55, 0xAA])
        frame = 10 * 139 * 62_500
        self.assertEqual([at - begun for at, _ in sent], [frame, 2 * frame])
        self.assertTrue(self.read(SR) & TC)

    def test_the_first_byte_after_te_waits_for_an_idle_frame(self):
        self.write(CR1, 0x2004)
        self.write(CR1, UE_TE_RE)
        begun = self.board.now
        self.write(DR, 1)
        self.board.advance(1 * MS)
        self.assertEqual(self.usart.take_sent()[0][0] - begun, 2 * 10 * 139 * 62_500)

    def test_bytes_are_read_from_the_data_register_alone(self):
        self.usart.inject(b"\x5A")
        self.board.advance(1 * MS)
        self.assertEqual(self.board.read("USART2", DR, 1), 0x5A)
        with self.assertRaises(Violation):
            self.board.read("USART2", SR, 1)

    def test_no_pin_no_byte(self):
        self.board.alternate("A", 2, 1)
        self.write(DR, 0x55)
        self.board.advance(1 * MS)
        self.assertEqual(self.usart.take_sent(), [])

    def test_receive_and_overrun(self):
        self.write(CR1, UE_TE_RE | 1 << 5)
        self.usart.inject(b"ab")
        self.board.advance(90 * US)
        self.assertTrue(self.board.lines[38])
        self.board.advance(1 * MS)
        self.assertTrue(self.read(SR) & ORE)
        self.assertEqual(self.read(DR), ord("a"))
        self.assertFalse(self.read(SR) & (RXNE | ORE))
        self.assertFalse(self.board.lines[38])

    def test_overrun_stays_without_the_status_read(self):
        self.usart.inject(b"ab")
        self.board.advance(1 * MS)
        self.read(DR)
        self.assertTrue(self.read(SR) & ORE)
        self.read(DR)
        self.assertFalse(self.read(SR) & ORE)

    def test_idle_is_set_once_after_a_frame_of_silence(self):
        self.usart.inject(b"a")
        self.board.advance(100 * US)
        self.assertFalse(self.read(SR) & IDLE)
        self.board.advance(100 * US)
        self.assertTrue(self.read(SR) & IDLE)
        self.read(DR)
        self.board.advance(1 * MS)
        self.assertFalse(self.read(SR) & IDLE)

    def test_idle_interrupt(self):
        self.write(CR1, UE_TE_RE | 1 << 4)
        self.usart.inject(b"a")
        self.board.advance(400 * US)
        self.assertTrue(self.board.lines[38])

    def test_a_wrong_baud_gives_framing_errors_and_wrong_bytes(self):
        for baud, wrong in ((115_200, False), (118_000, False), (121_000, True), (230_400, True), (57_600, True)):
            self.board.configure("USART2", "baud", baud)
            self.usart.inject(b"\x35")
            self.board.advance(2 * MS)
            status = self.read(SR)
            value = self.read(DR)
            self.assertEqual((bool(status & FE) or value != 0x35), wrong, baud)

    def test_modes_left_out(self):
        for offset, value in ((CR1, 0x8000 | UE_TE_RE), (CR1, UE_TE_RE | 1 << 7), (0x10, 1 << 12), (0x14, 1 << 3), (0x18, 1)):
            with self.assertRaises(Violation):
                self.write(offset, value)

    def test_bytes_before_the_receiver_is_on_are_lost(self):
        self.write(CR1, 0x2008)
        self.usart.inject(b"x")
        self.board.advance(10 * US)
        self.write(CR1, UE_TE_RE)
        self.board.advance(1 * MS)
        self.assertFalse(self.read(SR) & RXNE)
        self.assertEqual(self.usart.lost, 1)

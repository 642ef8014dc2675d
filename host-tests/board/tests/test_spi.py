"""SPI master: section 28 of RM0090."""

from .fake_board import US, PeripheralTest
from virtual_board.violation import Violation

CR1, CR2, SR, DR = 0, 4, 8, 12
MASTER = 1 << 9 | 1 << 8 | 1 << 6 | 1 << 2
RXNE, TXE, OVR, BSY = 1, 2, 1 << 6, 1 << 7


class Echo:
    """A slave that answers each byte with its complement."""

    def __init__(self):
        self.heard, self.frames = [], 0

    def select(self):
        self.frames += 1

    def deselect(self):
        pass

    def transfer(self, byte, mode, hz):
        self.heard.append(byte)
        return byte ^ 0xFF


class Spi(PeripheralTest):
    name, gates = "SPI1", ("SPI1", "GPIOA")

    def setUp(self):
        super().setUp()
        for pin in (5, 6, 7):
            self.board.alternate("A", pin, 5)
        self.spi = self.board.peripherals["SPI1"]
        self.echo = self.spi.slaves[0] = Echo()
        self.board.write("GPIOA", 0x18, 1 << 4)
        self.board.write("GPIOA", 0x00, self.board.read("GPIOA", 0) & ~0x300 | 0x100)

    def chip_select(self, low):
        self.board.write("GPIOA", 0x18, 1 << 20 if low else 1 << 4)

    def test_reset_values(self):
        self.assertEqual([self.read(offset) for offset in (CR1, SR)], [0, 2])

    def test_a_byte_takes_eight_clocks(self):
        self.write(CR1, MASTER | 1 << 3)
        self.chip_select(True)
        self.write(DR, 0x5A)
        self.assertEqual(self.read(SR), TXE | BSY)
        self.board.advance(2 * US - 1)
        self.assertEqual(self.read(SR), TXE | BSY)
        self.board.advance(1)
        self.assertEqual(self.read(SR), TXE | RXNE)
        self.assertEqual(self.read(DR), 0xA5)
        self.assertEqual(self.read(SR), TXE)

    def test_without_chip_select_the_line_is_high(self):
        self.write(CR1, MASTER)
        self.write(DR, 0x5A)
        self.board.advance(10 * US)
        self.assertEqual(self.read(DR), 0xFF)
        self.assertEqual(self.echo.heard, [])

    def test_without_alternate_functions_nothing_comes_through(self):
        self.write(CR1, MASTER)
        self.chip_select(True)
        self.board.alternate("A", 5, 4)
        self.write(DR, 0x5A)
        self.board.advance(10 * US)
        self.assertEqual(self.echo.heard, [])
        self.board.alternate("A", 5, 5)
        self.board.alternate("A", 6, 4)
        self.read(DR)
        self.write(DR, 0x5A)
        self.board.advance(10 * US)
        self.assertEqual((self.echo.heard, self.read(DR)), ([0x5A], 0))

    def test_overrun(self):
        self.write(CR1, MASTER)
        self.chip_select(True)
        for byte in (1, 2):
            self.write(DR, byte)
            self.board.advance(10 * US)
        self.assertTrue(self.read(SR) & OVR)
        self.assertEqual(self.read(DR), 0xFE)
        self.read(SR)
        self.assertFalse(self.read(SR) & OVR)

    def test_slow_pins_are_recorded(self):
        self.board.alternate("A", 7, 5, speed=0)
        self.write(CR1, MASTER)
        self.chip_select(True)
        self.write(DR, 0)
        self.board.advance(10 * US)
        self.assertEqual(len(self.board.events("slow_pin")), 1)

    def test_modes_left_out(self):
        for offset, value in ((CR1, MASTER | 1 << 15), (CR1, MASTER | 1 << 11), (CR1, MASTER & ~(1 << 8)), (CR1, 1 << 6), (CR2, 1 << 6)):
            with self.assertRaises(Violation):
                self.write(offset, value)

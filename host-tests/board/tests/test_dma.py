"""DMA controllers: section 10 of RM0090."""

import unittest

from .fake_board import MS, RAM, FakeBoard
from virtual_board.violation import Violation

UE_TE_RE = 0x200C
DR = 0x4000_4404


class Dma(unittest.TestCase):
    def setUp(self):
        self.board = FakeBoard()
        self.board.enable("USART2", "GPIOA", "DMA1")
        self.usart = self.board.peripherals["USART2"]
        self.board.alternate("A", 2, 7)
        self.board.alternate("A", 3, 7)
        self.board.write("USART2", 0x08, 139)
        self.board.write("USART2", 0x0C, UE_TE_RE)
        self.board.advance(1 * MS)

    def stream(self, number, cr, count, memory=RAM):
        base = 0x10 + 0x18 * number
        self.board.write("DMA1", base + 4, count)
        self.board.write("DMA1", base + 8, DR)
        self.board.write("DMA1", base + 12, memory)
        self.board.write("DMA1", base, cr | 1)
        return base

    def test_circular_reception_with_half_and_full(self):
        base = self.stream(5, 4 << 25 | 1 << 10 | 1 << 8, 8)
        self.board.write("USART2", 0x14, 1 << 6)
        self.usart.inject(b"0123")
        self.board.advance(1 * MS)
        self.assertEqual(self.board.read("DMA1", 4) >> 6, 0x10)
        self.board.write("DMA1", 0x0C, 0x10 << 6)
        self.usart.inject(b"456789")
        self.board.advance(2 * MS)
        self.assertEqual(self.board.memory_read(RAM, 8), b"89234567")
        self.assertEqual(self.board.read("DMA1", base + 4), 6)
        self.assertEqual(self.board.read("DMA1", 4) >> 6, 0x20)
        self.assertFalse(self.board.read("USART2", 0) & 1 << 3)

    def test_bytes_without_interrupts_are_there_when_the_stream_is_looked_at(self):
        base = self.stream(5, 4 << 25 | 1 << 10 | 1 << 8, 8)
        self.board.write("USART2", 0x14, 1 << 6)
        self.usart.inject(b"0123456789")
        frame = self.usart.frame_ps
        for count in range(1, 11):
            self.board.advance(frame)
            self.assertEqual(self.board.read("DMA1", base + 4), 8 - count % 8)
        self.board.advance(frame)
        self.assertEqual(self.board.memory_read(RAM, 8), b"89234567")
        self.assertFalse(self.board.read("USART2", 0) & 1 << 3)

    def test_transmission_ends_the_stream(self):
        self.board.memory_write(RAM, b"hello")
        self.board.write("USART2", 0x14, 1 << 7)
        base = self.stream(6, 4 << 25 | 1 << 10 | 1 << 6, 5)
        self.board.advance(2 * MS)
        self.assertEqual(bytes(byte for _, byte in self.usart.take_sent()), b"hello")
        self.assertFalse(self.board.read("DMA1", base) & 1)

    def test_ccm_ram_is_out_of_reach(self):
        base = self.stream(5, 4 << 25 | 1 << 10 | 1 << 8, 8, memory=0x1000_0000)
        self.board.write("USART2", 0x14, 1 << 6)
        self.usart.inject(b"0")
        self.board.advance(1 * MS)
        self.assertEqual(self.board.read("DMA1", 4) >> 6 & 8, 8)
        self.assertFalse(self.board.read("DMA1", base) & 1)

    def test_a_wrong_channel_and_modes_left_out(self):
        for mode in (5 << 25 | 1 << 10 | 1 << 8, 4 << 25 | 1 << 10, 4 << 25 | 1 << 10 | 1 << 8 | 1 << 4, 4 << 25 | 1 << 11 | 1 << 10 | 1 << 8):
            with self.assertRaises(Violation):
                self.stream(5, mode, 8)

    def test_an_enabled_stream_keeps_its_addresses(self):
        base = self.stream(5, 4 << 25 | 1 << 10 | 1 << 8, 8)
        self.board.write("DMA1", base + 8, 0)
        self.assertEqual(self.board.read("DMA1", base + 8), DR)

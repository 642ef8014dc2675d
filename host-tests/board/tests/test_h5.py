"""The STM32H563: clocks, USART and FDCAN behave as the manual, or what stood in for it, says."""

import unittest
from types import SimpleNamespace

from virtual_board.chips import STM32H563
from virtual_board.violation import Violation

from .fake_board import MS, US, FakeBoard

RF0N, TC, BO = 1, 1 << 7, 1 << 19


class H5(unittest.TestCase):
    def setUp(self):
        self.board = FakeBoard(STM32H563)

    def start_pll(self, latency=5, scale=3):
        """HSE of 8 MHz, PLL1 with 250 MHz at P and 50 MHz at Q."""
        write = self.board.write
        write("PWR", 0x10, scale << 4)
        write("FLASH", 0, latency | 2 << 4)
        write("RCC", 0x00, 0x0015_0023)
        self.board.advance(1 * MS)
        write("RCC", 0x28, 0x0003_0000 | 2 << 8 | 1 << 2 | 3)
        write("RCC", 0x34, 124 | 1 << 9 | 9 << 16)
        write("RCC", 0x00, 0x0115_0023)
        self.board.advance(1 * MS)
        write("RCC", 0x1C, 3)
        self.board.advance(1 * MS)

    def test_clocks_after_reset_and_from_the_pll(self):
        rcc = self.board.rcc
        self.assertEqual((rcc.core_hz, self.board.read("RCC", 0xF4)), (64_000_000, 0x0C00_0000))
        self.start_pll()
        self.assertEqual(self.board.read("RCC", 0x1C), 3 | 3 << 3)
        self.assertEqual((rcc.core_hz, rcc.clock_hz("TIM_APB1"), rcc.clock_hz("FDCAN")), (250_000_000, 250_000_000, 8_000_000))
        self.board.write("RCC", 0xE8, 1 << 8)
        self.assertEqual(rcc.clock_hz("FDCAN"), 50_000_000)

    def test_too_few_wait_states_and_too_low_a_voltage_are_violations(self):
        for latency, scale in ((4, 3), (5, 2)):
            self.board = FakeBoard(STM32H563)
            with self.assertRaises(Violation):
                self.start_pll(latency, scale)

    def test_the_pll_needs_a_fitting_input_range(self):
        self.board.write("RCC", 0x28, 0x0001_0000 | 4 << 8 | 0 << 2 | 1)
        with self.assertRaises(Violation):
            self.board.write("RCC", 0x00, 0x0100_0023)

    def test_random_numbers_come_by_four_after_a_conditioning_reset(self):
        read, write = self.board.read, self.board.write
        write("RCC", 0x00, 0x1023)
        self.board.advance(10 * US)
        write("RCC", 0x8C, 1 << 18)
        write("RNG", 0x00, 0x00F0_0E04)
        write("RNG", 0x10, 0x6A91)
        self.assertEqual((read("RNG", 0x00), read("RNG", 0x10)), (0x0087_1F04, 0x72AC), "a configuration needs CONDRST")
        write("RNG", 0x00, 0)
        write("RNG", 0x00, 0x40F0_0E00)
        write("RNG", 0x10, 0x6A91)
        write("RNG", 0x0C, 0x3AF66)
        write("RNG", 0x00, 0x00F0_0E00)
        self.assertEqual(read("RNG", 0x00), 0x40F0_0E00)
        self.board.advance(1 * US)
        self.assertEqual((read("RNG", 0x00), read("RNG", 0x10)), (0x00F0_0E00, 0x6A91))
        write("RNG", 0x00, 0x00F0_0E04)
        self.assertEqual((read("RNG", 0x04), read("RNG", 0x08)), (0, 0))
        self.board.advance(10 * US)
        words = {read("RNG", 0x08) for _ in range(4)}
        self.assertEqual((len(words), read("RNG", 0x04), read("RNG", 0x08)), (4, 0, 0))
        self.board.peripherals["RNG"].configure("seed_error", True)
        self.board.advance(10 * US)
        self.assertEqual(read("RNG", 0x04), 1 << 6 | 1 << 2)

    def test_gates_and_resets(self):
        self.assertFalse(self.board.rcc.enabled("USART1"))
        self.board.write("RCC", 0xA4, 1 << 14)
        self.assertTrue(self.board.rcc.enabled("USART1"))
        self.board.write("USART1", 0x0C, 0x123)
        self.board.write("RCC", 0x7C, 1 << 14)
        self.assertFalse(self.board.rcc.enabled("USART1"))
        self.assertEqual(self.board.read("USART1", 0x0C), 0)

    def test_the_usart_keeps_eight_bytes_and_then_overruns(self):
        self.board.write("GPIOB", 0x00, 2 << 14)
        self.board.write("GPIOB", 0x20, 7 << 28)
        self.board.write("USART1", 0x0C, 64_000_000 // 115_200)
        self.board.write("USART1", 0x00, 1 << 29 | 1 << 5 | 1 << 2 | 1)
        self.board.peripherals["USART1"].inject(bytes(range(9)))
        self.board.advance(2 * MS)
        self.assertEqual(self.board.read("USART1", 0x1C) & 0x28, 0x28)
        self.assertTrue(self.board.lines[58])
        self.assertEqual([self.board.read("USART1", 0x24) for _ in range(8)], list(range(8)))
        self.assertEqual(self.board.read("USART1", 0x1C) & 0x28, 8)
        self.board.write("USART1", 0x20, 8)
        self.assertEqual(self.board.read("USART1", 0x1C) & 0x28, 0)
        self.assertFalse(self.board.lines[58])

    def test_the_watchdog_has_longer_prescalers_and_says_that_it_runs(self):
        self.board.write("IWDG", 0x00, 0x5555)
        self.board.write("IWDG", 0x04, 8)
        self.board.write("IWDG", 0x08, 9)
        self.board.write("IWDG", 0x00, 0xCCCC)
        self.board.advance(10 * MS)
        self.assertEqual(self.board.read("IWDG", 0x0C), 1 << 8)
        self.board.write("IWDG", 0x00, 0xAAAA)
        self.board.advance(319 * MS)
        self.assertEqual(self.board.resets, [])
        self.board.advance(2 * MS)
        self.assertEqual([cause for _, cause in self.board.resets], ["iwdg"])

    # -- flash -------------------------------------------------------------------------------------------------------

    def unlock(self):
        for key in (0x4567_0123, 0xCDEF_89AB):
            self.board.write("FLASH", 0x04, key)

    def program(self, address, words):
        """Stores words to the array, as a program does."""
        for number, word in enumerate(words):
            self.board.peripherals["FLASH"].program(address + 4 * number, word, 4)

    def test_a_quad_word_is_programmed_when_it_is_full(self):
        self.unlock()
        self.board.write("FLASH", 0x28, 2)
        self.program(0x0810_0000, (1, 2, 3))
        self.assertEqual(self.board.read("FLASH", 0x20), 2)
        self.program(0x0810_000C, (4,))
        self.assertEqual(self.board.read("FLASH", 0x20), 1)
        self.assertEqual(self.board.memory_read(0x0810_0000, 4), b"\xFF" * 4)
        self.board.advance(1 * MS)
        self.assertEqual(self.board.read("FLASH", 0x20), 1 << 16)
        self.assertEqual(self.board.memory_read(0x0810_0000, 8), bytes((1, 0, 0, 0, 2, 0, 0, 0)))
        with self.assertRaises(Violation):
            self.program(0x0810_0000, (0, 0, 0, 0))

    def test_stores_that_do_not_fit_are_flagged_until_nsccr(self):
        self.program(0x0810_0000, (1,))
        self.unlock()
        self.board.write("FLASH", 0x28, 2)
        self.program(0x0810_0000, (1,))
        self.program(0x0810_0010, (1,))
        self.board.write("FLASH", 0x20, 0)
        self.assertEqual(self.board.read("FLASH", 0x20), 1 << 18 | 1 << 20)
        self.board.write("FLASH", 0x30, 1 << 18 | 1 << 20)
        self.assertEqual(self.board.read("FLASH", 0x20), 0)

    def test_a_sector_of_the_second_bank_is_erased(self):
        self.board.write("FLASH", 0x28, 1 << 31 | 3 << 6 | 1 << 5 | 4)
        self.assertEqual(self.board.read("FLASH", 0x28), 1)
        self.board.memory_write(0x0810_5FF0, bytes(32))
        self.unlock()
        self.board.write("FLASH", 0x28, 1 << 31 | 2 << 6 | 1 << 5 | 4)
        self.assertEqual(self.board.read("FLASH", 0x20), 1)
        self.board.advance(10 * MS)
        self.assertEqual(self.board.memory_read(0x0810_5FF0, 32), b"\xFF" * 16 + bytes(16))

    def swap(self, value=1 << 31):
        for key in (0x0819_2A3B, 0x4C5D_6E7F):
            self.board.write("FLASH", 0x0C, key)
        self.board.write("FLASH", 0x54, value)
        self.board.write("FLASH", 0x1C, 2)

    def test_with_swapped_banks_an_erase_goes_by_the_bank_itself(self):
        self.board.memory_write(0x0810_0000, bytes(4))
        self.assertEqual(self.board.read("FLASH", 0x50), 0)
        self.swap()
        self.assertEqual((self.board.read("FLASH", 0x20), self.board.read("FLASH", 0x50)), (1, 0))
        self.board.advance(20 * MS)
        self.assertEqual((self.board.read("FLASH", 0x20), self.board.read("FLASH", 0x50)), (0, 1 << 31))
        self.assertEqual(self.board.memory_read(0x0810_0000, 4), bytes(4), "until the next reset")
        self.board.reset("software")
        self.assertEqual((self.board.read("FLASH", 0x1C), self.board.read("FLASH", 0x18)), (1 << 31 | 1, 0))
        self.assertEqual(self.board.memory_read(0x0800_0000, 4), bytes(4))
        self.unlock()
        self.board.write("FLASH", 0x28, 1 << 31 | 2 << 6 | 1 << 5 | 4)
        self.assertEqual(self.board.events("flash_erase")[0]["sectors"], [2])

    def test_options_need_their_keys_and_a_change_that_is_interrupted_leaves_either_value(self):
        self.board.write("FLASH", 0x54, 1 << 31)
        self.board.write("FLASH", 0x1C, 2)
        self.board.write("FLASH", 0x0C, 1)
        self.swap()
        self.assertEqual((self.board.read("FLASH", 0x20), self.board.events("options")), (0, []))
        left = set()
        for seed in range(8):
            self.board = FakeBoard(STM32H563)
            self.board.memory.random.seed(seed)
            self.swap()
            self.board.reset("iwdg")
            self.assertEqual(self.board.read("FLASH", 0x18), 6 << 29)
            left.add(self.board.read("FLASH", 0x50) >> 31)
        self.assertEqual(left, {0, 1})
        with self.assertRaises(Violation):
            self.swap(1)

    def test_a_reset_during_an_operation_leaves_quad_words_without_their_ecc(self):
        flash = self.board.peripherals["FLASH"]
        self.board.watched_from = 0x0800_0000
        self.unlock()
        self.board.write("FLASH", 0x28, 2)
        self.program(0x0810_0010, (1, 2, 3, 4))
        self.board.reset("iwdg")
        self.assertEqual(flash.torn, {0x0810_0010})
        flash._was_read(0x0810_0000)
        self.assertEqual((self.board.read("FLASH", 0x104), self.board.nmis), (0, 0))
        flash._was_read(0x0810_0014)
        self.assertEqual((self.board.read("FLASH", 0x104), self.board.nmis), (1 << 31 | 1 << 22 | 1, 1))
        self.board.write("FLASH", 0x104, 1 << 31)
        self.assertEqual(self.board.read("FLASH", 0x104), 0)
        self.unlock()
        self.board.write("FLASH", 0x28, 1 << 31 | 1 << 5 | 4)
        self.board.advance(10 * MS)
        self.assertEqual(flash.torn, set())

    def test_a_wrong_key_locks_until_a_reset(self):
        self.board.write("FLASH", 0x04, 1)
        self.unlock()
        self.assertEqual(self.board.read("FLASH", 0x28), 1)
        self.board.reset("software")
        self.unlock()
        self.assertEqual(self.board.read("FLASH", 0x28), 0)

    # -- SPI ---------------------------------------------------------------------------------------------------------

    def start_spi(self, config_2=1 << 22 | 1 << 24 | 1 << 25 | 1 << 26 | 1 << 28):
        """Mode 3 at 50 MHz / 8 from PLL1, with a slave at PD14 that answers each byte with its complement."""
        self.start_pll()
        self.board.write("RCC", 0xA4, 1 << 12)
        for letter, pin in (("A", 5), ("B", 5), ("G", 9)):
            self.board.alternate(letter, pin, 5)
        self.heard = []
        answer = lambda byte, mode, hz: self.heard.append((byte, mode, hz)) or byte ^ 0xFF
        self.board.peripherals["SPI1"].slaves[0] = SimpleNamespace(select=lambda: None, deselect=lambda: None, transfer=answer)
        self.board.write("GPIOD", 0x18, 1 << 14)
        self.board.write("GPIOD", 0x00, self.board.read("GPIOD", 0) & ~(2 << 28))
        self.board.write("SPI1", 0x0C, config_2)
        self.board.write("SPI1", 0x08, 0x2007_0007)
        self.board.write("SPI1", 0x00, 1)
        self.board.write("SPI1", 0x00, 1 | 1 << 9)
        self.board.write("GPIOD", 0x18, 1 << 30)

    def test_spi_sends_the_bytes_of_its_fifo_and_keeps_what_comes(self):
        self.start_spi()
        self.assertEqual(self.board.read("SPI1", 0x14), 1 << 12 | 2)
        for byte in (0x5A, 1):
            self.board.write("SPI1", 0x20, byte, 1)
        self.assertEqual(self.board.read("SPI1", 0x14), 2)
        self.board.advance(3 * US)
        self.assertEqual(self.board.read("SPI1", 0x14), 1 << 12 | 7)
        self.assertEqual([self.board.read("SPI1", 0x30, 1) for _ in range(2)], [0xA5, 0xFE])
        self.assertEqual(self.heard, [(byte, (True, True), 6_250_000) for byte in (0x5A, 1)])
        self.board.write("SPI1", 0x20, 7, 1)
        self.board.write("SPI1", 0x00, 0)
        self.assertEqual(len(self.board.events("disabled_in_transfer")), 1)

    def test_a_full_receive_fifo_overruns(self):
        self.start_spi()
        for byte in range(17):
            self.board.write("SPI1", 0x20, byte, 1)
        self.board.advance(40 * US)
        self.assertEqual((len(self.heard), self.board.read("SPI1", 0x14) & 1 << 6), (17, 1 << 6))
        self.board.write("SPI1", 0x18, 1 << 6)
        self.assertEqual(self.board.read("SPI1", 0x14) & 1 << 6, 0)

    def test_modes_of_spi_that_are_left_out_end_the_run(self):
        for offset, value in ((0x08, 0x2007_000F), (0x08, 0x2047_0007), (0x0C, 1 << 22), (0x0C, 1 << 26 | 1 << 23), (0x10, 1), (0x04, 5)):
            self.board = FakeBoard(STM32H563)
            self.board.write("RCC", 0xA4, 1 << 12)
            with self.assertRaises(Violation):
                self.board.write("SPI1", offset, value)
        for config_2 in (1 << 26, 1 << 22 | 1 << 26):
            self.board = FakeBoard(STM32H563)
            with self.assertRaises(Violation):
                self.start_spi(config_2)

    # -- FDCAN -------------------------------------------------------------------------------------------------------

    def start_can(self, cccr=0x300, nominal=11 << 8 | 2, config=1 << 16 | 2 << 4 | 2 << 2):
        """500 kbit/s and 2 Mbit/s from 8 MHz; one filter for 0xAA."""
        write = self.board.write
        self.board.alternate("D", 0, 9)
        self.board.alternate("D", 1, 9)
        write("RCC", 0x00, 0x0015_0023)
        self.board.advance(1 * MS)
        write("FDCAN1", 0x18, 1)
        write("FDCAN1", 0x18, 3)
        write("FDCAN1", 0x1C, nominal)
        write("FDCAN1", 0x0C, 1 << 8)
        write("FDCAN1", 0x80, config)
        write("SRAMCAN", 0x00, 2 << 30 | 1 << 27 | 0xAA << 16 | 0x7FF)
        write("FDCAN1", 0xDC, 7)
        write("FDCAN1", 0x54, RF0N | TC | BO)
        write("FDCAN1", 0x5C, 1)
        write("FDCAN1", 0x18, 3 | cccr)
        write("FDCAN1", 0x18, cccr)
        self.board.advance(1 * MS)
        return self.board.peripherals["FDCAN1"].bus

    def request(self, index, identifier):
        """Puts a frame of two bytes into a transmit buffer."""
        base = 0x278 + 72 * index
        for offset, word in ((0, identifier << 18), (4, 2 << 16), (8, 0x2211)):
            self.board.write("SRAMCAN", base + offset, word)
        self.board.write("FDCAN1", 0xCC, 1 << index)

    def test_configuration_needs_init_and_cce(self):
        self.board.write("FDCAN1", 0x1C, 0x1234)
        self.assertEqual(self.board.read("FDCAN1", 0x1C), 0x0600_0A03)
        self.board.write("FDCAN1", 0x18, 0x101)
        self.assertEqual(self.board.read("FDCAN1", 0x18), 1)
        self.assertEqual(len(self.board.events("ignored_write")), 2)

    def test_a_sample_point_away_from_80_percent_is_a_violation(self):
        with self.assertRaises(Violation):
            self.start_can(nominal=13 << 8 | 0)

    def test_the_fifo_sends_in_order_whatever_the_identifiers(self):
        bus = self.start_can()
        for index, identifier in enumerate((0x300, 0x200, 0x100)):
            self.request(index, identifier)
        self.assertEqual(self.board.read("FDCAN1", 0xC4), 1 << 21)
        self.board.advance(1 * MS)
        self.assertEqual([entry.frame.identifier for entry in bus.take_log()], [0x300, 0x200, 0x100])
        self.assertEqual((self.board.read("FDCAN1", 0xC4), self.board.read("FDCAN1", 0xD4)), (3, 7))
        self.assertTrue(self.board.read("FDCAN1", 0x50) & TC and self.board.lines[39])

    def test_a_cancelled_request_ends_at_once_or_with_its_attempt(self):
        bus = self.start_can()
        bus.configure("acknowledge", False)
        self.request(0, 0x100)
        self.board.advance(50 * US)
        self.request(1, 0x200)
        self.board.write("FDCAN1", 0xD0, 3)
        self.assertEqual((self.board.read("FDCAN1", 0xC8), self.board.read("FDCAN1", 0xD8)), (1, 2))
        self.board.advance(1 * MS)
        self.assertEqual((self.board.read("FDCAN1", 0xC8), self.board.read("FDCAN1", 0xD8)), (0, 3))
        self.assertEqual(self.board.read("FDCAN1", 0xD4), 0)

    def test_filters_and_the_full_fifo(self):
        bus = self.start_can()
        for number in range(4):
            bus.send(0xAA, bytes([number]))
        bus.send(0xAB, b"")
        self.board.advance(2 * MS)
        # Full, three elements, the first at 0; the fourth was lost; and 0xAB is not for this node.
        self.assertEqual(self.board.read("FDCAN1", 0x90), 1 << 25 | 1 << 24 | 3)
        self.assertEqual(self.board.peripherals["FDCAN1"].filtered, 1)
        self.assertEqual([self.board.read("SRAMCAN", 0xB0 + 72 * place + 8) for place in range(3)], [0, 1, 2])
        self.board.write("FDCAN1", 0x94, 0)
        self.assertEqual(self.board.read("FDCAN1", 0x90) & 0x3030F, 1 << 8 | 2)

    def test_what_is_left_out_ends_the_run(self):
        for offset, value in ((0xC0, 1 << 24), (0x9C, 0), (0xF0, 0)):
            self.board = FakeBoard(STM32H563)
            self.board.write("FDCAN1", 0x18, 1)
            self.board.write("FDCAN1", 0x18, 3)
            with self.assertRaises(Violation):
                self.board.write("FDCAN1", offset, value)
        # A range, two identifiers, a mask for FIFO 1; the rest in FIFO 1; a FIFO that overwrites.
        for kind, action, config in ((0, 1, 0), (1, 1, 0), (2, 2, 0), (2, 0, 1 << 4), (2, 1, 1 << 9)):
            self.board = FakeBoard(STM32H563)
            bus = self.start_can(config=1 << 16 | config)
            self.board.write("SRAMCAN", 0x00, kind << 30 | action << 27 | 0xAA << 16 | 0x7FF)
            bus.send(0xAA)
            with self.assertRaises(Violation):
                self.board.advance(1 * MS)

    def test_can_fd_is_received_or_an_error(self):
        for cccr, error in ((0x300, None), (0, "CAN FD")):
            self.board = FakeBoard(STM32H563)
            bus = self.start_can(cccr)
            bus.send(0xAA, bytes(range(64)), fd=True, fast=True)
            self.board.advance(500 * US)
            first = bus.take_log()[0]
            self.assertEqual((first.error, self.board.read("FDCAN1", 0x90) & 0xF), (error, 0 if error else 1))
            if not error:
                # 64 bytes alone take 256 us at 2 Mbit/s; 27 more bits take 54 us at 500 kbit/s.
                self.assertTrue(310 < (first.end_ps - first.start_ps) / US < 400)

    def test_can_fd_is_sent_where_it_is_enabled_and_ends_at_a_classic_node(self):
        data = bytes(range(24))
        cases = ((0x300, False, "24f", None), (0x100, False, "24-", None), (0, False, "8", None), (0x300, True, "24f", "CAN FD"))
        for cccr, classic, expected, error in cases:
            self.board = FakeBoard(STM32H563)
            bus = self.start_can(cccr)
            bus.configure("classic", classic)
            for offset, word in ((0, 0x1A7 << 18), (4, 12 << 16 | 1 << 20 | 1 << 21)):
                self.board.write("SRAMCAN", 0x278 + offset, word)
            for at in range(0, 24, 4):
                self.board.write("SRAMCAN", 0x280 + at, int.from_bytes(data[at : at + 4], "little"))
            self.board.write("FDCAN1", 0xCC, 1)
            self.board.advance(800 * US)
            first = bus.take_log()[0]
            frame = first.frame
            sent = f"{len(frame.data)}{('-', 'f')[frame.fast] if frame.fd else ''}"
            self.assertEqual((sent, first.error, frame.data), (expected, error, data[: len(frame.data)]))
            self.assertEqual(self.board.read("FDCAN1", 0xD4), 0 if error else 1)
            if expected == "24f" and not error:
                # 27 bits at 500 kbit/s, about 226 at 2 Mbit/s, and stuff bits.
                self.assertTrue(160 < (first.end_ps - first.start_ps) / US < 200)
        self.board.advance(50 * MS)
        self.assertEqual(self.board.read("FDCAN1", 0x44) >> 7 & 1, 1)

    def test_bus_off_ends_129_sequences_after_init_is_cleared(self):
        bus = self.start_can()
        bus.configure("short", "recessive")
        self.request(0, 0x100)
        self.board.advance(20 * MS)
        self.assertEqual(self.board.read("FDCAN1", 0x44) >> 7 & 1, 1)
        self.assertEqual(self.board.read("FDCAN1", 0x18) & 1, 1)
        bus.configure("short", None)
        self.board.advance(10 * MS)
        self.assertEqual(self.board.read("FDCAN1", 0x44) >> 7 & 1, 1)
        self.board.write("FDCAN1", 0x50, BO)
        self.board.write("FDCAN1", 0x18, 0x300)
        self.board.advance(129 * 11 * 2 * US - 1 * US)
        self.assertEqual(self.board.read("FDCAN1", 0x50) & BO, 0)
        self.board.advance(2 * US)
        self.assertEqual((self.board.read("FDCAN1", 0x44) >> 7 & 1, self.board.read("FDCAN1", 0x50) & BO), (0, BO))

    def test_the_last_error_is_read_once(self):
        bus = self.start_can()
        bus.configure("acknowledge", False)
        self.request(0, 0x100)
        self.board.advance(200 * US)
        self.assertEqual([self.board.read("FDCAN1", 0x44) & 7 for _ in range(2)], [3, 7])

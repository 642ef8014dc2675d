"""Power control: section 5 of RM0090 with the thresholds of DS8626."""

from .fake_board import MS, S, PeripheralTest

PVDE = 1 << 4


class Pwr(PeripheralTest):
    name, gates = "PWR", ("PWR",)

    def supply(self, millivolts):
        self.board.configure("PWR", "supply_mv", millivolts)

    def pvdo(self):
        return bool(self.read(4) & 4)

    def test_reset_value_selects_scale_1(self):
        self.assertEqual(self.read(0), 0x4000)

    def test_pvdo_only_while_enabled(self):
        self.supply(2000)
        self.assertFalse(self.pvdo())
        self.write(0, 0x4000 | PVDE)
        self.assertTrue(self.pvdo())

    def test_levels_and_hysteresis(self):
        for level, (falling, rising) in {0: (2040, 2140), 4: (2660, 2760), 7: (3030, 3140)}.items():
            self.supply(3300)
            self.write(0, 0x4000 | PVDE | level << 5)
            self.supply(falling + 1)
            self.assertFalse(self.pvdo(), level)
            self.supply(falling - 1)
            self.assertTrue(self.pvdo(), level)
            self.supply(rising - 1)
            self.assertTrue(self.pvdo(), level)
            self.supply(rising + 1)
            self.assertFalse(self.pvdo(), level)

    def test_exti_line_16_interrupts_on_the_rising_edge_of_pvdo(self):
        self.board.write("EXTI", 0x00, 1 << 16)
        self.board.write("EXTI", 0x08, 1 << 16)
        self.write(0, 0x4000 | PVDE | 4 << 5)
        self.supply(2600)
        self.assertTrue(self.board.lines[1])
        self.board.write("EXTI", 0x14, 1 << 16)
        self.assertFalse(self.board.lines[1])
        self.supply(3300)
        self.assertFalse(self.board.lines[1])

    def test_brown_out_is_off_as_delivered(self):
        self.supply(1900)
        self.assertEqual(self.board.resets, [])

    def test_brown_out_level_3_resets_and_holds_until_the_supply_returns(self):
        self.board.configure("FLASH", "option_bytes", 0x0FFF_AAE1)
        self.supply(2800)
        self.assertEqual([cause for _, cause in self.board.resets], ["bor"])
        self.assertGreater(self.board.stalled_until, self.board.now + S)
        self.supply(2900)
        self.board.advance(MS)
        self.assertGreater(self.board.stalled_until, self.board.now + S)
        self.supply(3300)
        self.board.advance(MS)
        self.assertEqual(self.board.stalled_until, 0)
        self.board.enable("PWR")
        self.assertEqual(self.board.read("RCC", 0x74) & 0xFE00_0000, 0x0E00_0000)

    def test_power_on_reset(self):
        self.supply(0)
        self.board.advance(S)
        self.supply(3300)
        self.board.advance(2 * MS)
        self.assertEqual(self.board.resets[-1][1], "por")
        self.assertEqual(self.board.stalled_until, 0)

    def test_brown_out_flags_without_power_on(self):
        self.board.write("RCC", 0x74, 1 << 24)
        self.board.configure("FLASH", "option_bytes", 0x0FFF_AAE1)
        self.supply(2500)
        self.supply(3300)
        self.board.advance(MS)
        self.assertEqual(self.board.read("RCC", 0x74) & 0xFE00_0000, 0x0600_0000)

"""Reset and clock control: section 7 of RM0090."""

from .fake_board import MS, S, US, PeripheralTest
from virtual_board.violation import Violation

CR, PLLCFGR, CFGR, CIR, APB1RSTR, AHB1ENR, APB1ENR, CSR = 0x00, 0x04, 0x08, 0x0C, 0x20, 0x30, 0x40, 0x74


class Rcc(PeripheralTest):
    name = "RCC"

    def test_reset_values(self):
        expected = {CR: 0x83, PLLCFGR: 0x2400_3010, CFGR: 0, CIR: 0, AHB1ENR: 0x0010_0000, APB1ENR: 0, CSR: 0x0E00_0000}
        self.assertEqual({offset: self.read(offset) for offset in expected}, expected)
        self.assertEqual(self.board.rcc.core_hz, 16_000_000)

    def test_crystal_takes_two_milliseconds_and_the_pll_reaches_168_mhz(self):
        self.write(CR, 0x0001_0083)
        self.board.advance(1_900 * US)
        self.assertFalse(self.read(CR) & 1 << 17)
        self.board.advance(200 * US)
        self.assertTrue(self.read(CR) & 1 << 17)
        self.board.run_at_168_mhz()
        hz = [self.board.rcc.clock_hz(name) for name in ("HCLK", "PCLK1", "PCLK2", "TIM_APB1", "TIM_APB2")]
        self.assertEqual(hz, [168_000_000, 42_000_000, 84_000_000, 84_000_000, 168_000_000])

    def test_sws_follows_sw_only_when_the_clock_is_ready(self):
        self.write(CR, 0x0001_0083)
        self.write(CFGR, 1)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(CFGR) & 0xC, 0)
        self.board.advance(2 * MS)
        self.assertEqual(self.read(CFGR) & 0xC, 4)
        self.assertEqual(self.board.rcc.core_hz, 25_000_000)

    def test_no_crystal_is_never_ready(self):
        self.board.configure("RCC", "crystal_hz", None)
        self.write(CR, 0x0001_0083)
        self.board.advance(10 * S)
        self.assertFalse(self.read(CR) & 1 << 17)

    def test_pllcfgr_is_read_only_while_pllon_is_set(self):
        self.board.run_at_168_mhz()
        before = self.read(PLLCFGR)
        self.write(PLLCFGR, 0x2400_3010)
        self.assertEqual(self.read(PLLCFGR), before)

    def test_the_clock_in_use_cannot_be_switched_off(self):
        self.board.run_at_168_mhz()
        self.write(CR, 0x83)
        self.assertEqual(self.read(CR) & 0x0303_0000, 0x0303_0000)

    def test_limits(self):
        self.write(CR, 0x0001_0083)
        self.board.advance(3 * MS)
        self.write(PLLCFGR, 0x0740_5419)
        self.write(CR, 0x0101_0083)
        self.board.advance(1 * MS)
        with self.assertRaisesRegex(Violation, "PCLK1|wait states"):
            self.write(CFGR, 2)
            self.board.advance(1 * US)

    def test_flash_latency_too_small(self):
        self.board.run_at_168_mhz()
        with self.assertRaisesRegex(Violation, "wait states"):
            self.board.write("FLASH", 0, 4)

    def test_pll_input_outside_its_range(self):
        self.board.configure("RCC", "crystal_hz", 16_000_000)
        self.write(CR, 0x0001_0083)
        self.board.advance(3 * MS)
        self.write(PLLCFGR, 0x0740_5419)
        with self.assertRaisesRegex(Violation, "PLL input of 640000 Hz"):
            self.write(CR, 0x0101_0083)

    def test_clock_security_falls_back_to_hsi_with_an_nmi(self):
        self.board.run_at_168_mhz()
        self.write(CR, self.read(CR) | 1 << 19)
        self.board.configure("RCC", "crystal_stop", True)
        self.assertEqual(self.board.nmis, 1)
        self.assertEqual(self.board.rcc.core_hz, 16_000_000 // 1)
        self.assertEqual(self.read(CFGR) & 0xF, 0)
        self.assertFalse(self.read(CR) & 0x0303_0000)
        self.assertTrue(self.read(CIR) & 1 << 7)
        self.write(CIR, 1 << 23)
        self.assertFalse(self.read(CIR) & 1 << 7)
        self.assertFalse(self.board.rcc.nmi_line)

    def test_without_clock_security_a_stopped_crystal_stops_the_core(self):
        self.board.run_at_168_mhz()
        self.board.configure("RCC", "crystal_stop", True)
        self.assertGreater(self.board.stalled_until, self.board.now + 1000 * S)
        self.assertEqual(self.board.nmis, 0)

    def test_hsi_error_changes_every_clock(self):
        self.board.configure("RCC", "hsi_error_percent", 1.0)
        self.assertEqual(self.board.rcc.core_hz, 16_160_000)

    def test_access_in_the_two_cycles_after_an_enable_is_recorded(self):
        self.write(APB1ENR, 1 << 28)
        self.assertTrue(self.board.rcc.enabled("PWR"))
        self.assertEqual(len(self.board.events("early_access")), 1)
        self.board.advance(1 * US)
        self.assertTrue(self.board.rcc.enabled("PWR"))
        self.assertEqual(len(self.board.events("early_access")), 1)

    def test_gate_and_reset_register(self):
        self.assertFalse(self.board.rcc.enabled("TIM5"))
        self.board.enable("TIM5")
        self.assertTrue(self.board.rcc.enabled("TIM5"))
        self.board.write("TIM5", 0x28, 77)
        self.write(APB1RSTR, 1 << 3)
        self.assertFalse(self.board.rcc.is_on("TIM5"))
        self.write(APB1RSTR, 0)
        self.assertEqual(self.board.read("TIM5", 0x28), 0)

    def test_reset_flags_gather_until_rmvf(self):
        self.board.reset("software")
        self.assertEqual(self.read(CSR) & 0xFE00_0000, 0x1E00_0000)
        self.write(CSR, 1 << 24)
        self.assertEqual(self.read(CSR), 0)
        self.board.reset("iwdg")
        self.assertEqual(self.read(CSR), 0x2400_0000)

    def test_lsi(self):
        self.write(CSR, 1)
        self.assertFalse(self.read(CSR) & 2)
        self.board.advance(50 * US)
        self.assertTrue(self.read(CSR) & 2)

    def test_what_is_left_out_ends_the_run(self):
        for offset, value in ((CR, 1 << 26), (CR, 0x0005_0083), (CIR, 1 << 11), (0x70, 0x8200), (0x80, 1), (0x28, 0)):
            with self.assertRaises(Violation):
                self.write(offset, value)
        with self.assertRaises(Violation):
            self.read(0x28)

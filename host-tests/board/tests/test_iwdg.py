"""Independent watchdog: section 21 of RM0090."""

from .fake_board import MS, S, US, FakeBoard, PeripheralTest

KR, PR, RLR, SR = 0, 4, 8, 12


class Iwdg(PeripheralTest):
    name = "IWDG"

    def test_reset_values_and_lock(self):
        self.assertEqual([self.read(offset) for offset in (KR, PR, RLR, SR)], [0, 0, 0xFFF, 0])
        self.write(PR, 4)
        self.assertEqual((self.read(PR), self.read(SR)), (0, 0))

    def test_default_timeout_is_512_ms_at_32_khz_and_changes_with_the_lsi(self):
        for lsi_hz, milliseconds in ((32_000, 512), (17_000, 963)):
            self.board = FakeBoard()
            self.board.configure("RCC", "lsi_hz", lsi_hz)
            self.write(KR, 0xCCCC)
            self.board.advance((milliseconds - 1) * MS)
            self.assertEqual(self.board.resets, [])
            self.board.advance(2 * MS)
            self.assertEqual([cause for _, cause in self.board.resets], ["iwdg"])
            self.assertTrue(self.board.read("RCC", 0x74) & 1 << 29)

    def test_feeding_starts_again(self):
        self.write(KR, 0xCCCC)
        for _ in range(10):
            self.board.advance(400 * MS)
            self.write(KR, 0xAAAA)
        self.assertEqual(self.board.resets, [])

    def test_new_values_are_taken_over_after_five_lsi_periods(self):
        self.write(KR, 0xCCCC)
        self.board.advance(100 * US)
        self.write(KR, 0x5555)
        self.write(PR, 3)
        self.write(RLR, 99)
        self.assertEqual(self.read(SR), 3)
        self.write(KR, 0xAAAA)
        self.board.advance(200 * US)
        self.assertEqual(self.read(SR), 0)
        begun = self.board.now
        self.write(KR, 0xAAAA)
        self.board.advance(1 * S)
        self.assertAlmostEqual((self.board.resets[0][0] - begun) / MS, 100, delta=0.2)

    def test_a_feed_before_the_takeover_loads_the_old_reload_value(self):
        self.write(KR, 0xCCCC)
        self.write(KR, 0x5555)
        self.write(PR, 6)
        self.write(RLR, 10)
        self.write(KR, 0xAAAA)
        self.board.advance(30 * S)
        self.assertEqual(self.board.resets, [])
        self.board.advance(4 * S)
        self.assertEqual(len(self.board.resets), 1)

    def test_without_lsi_nothing_is_taken_over(self):
        self.write(KR, 0x5555)
        self.write(PR, 6)
        self.board.advance(1 * S)
        self.assertEqual(self.read(SR), 1)
        self.write(KR, 0xCCCC)
        self.board.advance(1 * MS)
        self.assertEqual(self.read(SR), 0)

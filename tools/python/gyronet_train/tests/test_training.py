"""Training by its seed, which stops early."""

from .needs_torch import torch

from gyronet_train.recordings import find_drive, load_drive
from gyronet_train.training import Settings, Windows, train

from .in_folder import InFolder
from .made_csv import write_drive

SETTINGS = Settings(epochs=3, batch=256, lr=0.0015, turns=True, patience=9)
torch.set_num_threads(1)  # Several wait for each other on a busy machine.


class Training(InFolder):
    def setUp(self):
        super().setUp()
        drives = [load_drive(write_drive(self.folder / f"{name}.csv", 12, k)) for k, name in enumerate("abc")]
        self.data, self.validation = Windows(drives[:2]), drives[2:]

    def train(self, settings=SETTINGS):
        return train(self.data, self.validation, settings, 1, lambda epoch: None)

    def test_one_seed_gives_one_result(self):
        one, other = self.train(), self.train()
        for before, after in zip(one.model.parameters(), other.model.parameters(), strict=True):
            torch.testing.assert_close(before, after, atol=1e-4, rtol=1e-3)

    def test_it_stops_early_and_keeps_the_best(self):
        # Steps so large that nothing is learnt.
        trained = self.train(Settings(9, 256, 100.0, False, 2))
        self.assertEqual(len(trained.epochs), trained.epoch + 2)
        self.assertLess(len(trained.epochs), 9)

    def test_drives_have_any_name(self):
        self.assertEqual(find_drive(self.folder, "b").name, "b.csv")
        write_drive(self.folder / "monday 1.csv", 4)
        self.assertEqual(find_drive(self.folder, "monday").stem, "monday 1")
        with self.assertRaisesRegex(ValueError, "no drive matching the name tuesday"):
            find_drive(self.folder, "tuesday")

"""Training goes on from its state, and stops early."""

from .needs_torch import torch

from gyronet_train.recordings import find_drive, load_drive
from gyronet_train.training import Settings, Windows, train

from .in_folder import InFolder
from .made_csv import write_drive

SETTINGS = Settings(epochs=3, batch=256, lr=0.0015, turns=True, patience=9)


torch.set_num_threads(1)  # Several wait for each other on a busy machine.


class Killed(Exception):
    pass


class Training(InFolder):
    def setUp(self):
        super().setUp()
        drives = [load_drive(write_drive(self.folder / f"{name}.csv", 12, k)) for k, name in enumerate("abc")]
        self.data, self.validation = Windows(drives[:2]), drives[2:]
        self.state = self.folder / "a.state"

    def train(self, settings=SETTINGS, on_epoch=lambda epoch: None, state=None):
        return train(self.data, self.validation, settings, 1, on_epoch, state)

    def test_a_killed_training_ends_as_the_unbroken_one(self):
        def kill(epoch):
            if epoch.epoch == 2:
                raise Killed

        whole = self.train()
        with self.assertRaises(Killed):
            self.train(on_epoch=kill, state=self.state)
        ran = []
        rest = self.train(on_epoch=lambda epoch: ran.append(epoch.epoch), state=self.state)
        self.assertEqual((ran, len(rest.epochs)), ([2, 3], 3))
        for one, other in zip(whole.epochs, rest.epochs, strict=True):
            self.assertAlmostEqual(one.loss, other.loss, places=4)
        for one, other in zip(whole.model.parameters(), rest.model.parameters(), strict=True):
            torch.testing.assert_close(one, other, atol=1e-4, rtol=1e-3)
        # What is done is not done again.
        self.train(on_epoch=lambda epoch: self.fail("ran again"), state=self.state)

    def test_the_state_of_another_training_is_refused(self):
        self.train(state=self.state)
        with self.assertRaisesRegex(ValueError, r"a\.state: is of a training with other settings"):
            self.train(Settings(4, 256, 0.0015, True, 9), state=self.state)
        self.data.names = {"d": "0"}
        with self.assertRaisesRegex(ValueError, "other drives"):
            self.train(state=self.state)

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

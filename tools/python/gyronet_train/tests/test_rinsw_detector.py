"""RINS-W's detectors: what they learn, what they may see, their files; and the labels of the profiles."""

import unittest
from dataclasses import replace

from .needs_torch import torch

import numpy as np

from gyronet_train.rinsw_detector import WINDOW, DetectorError, Detectors, Settings, load_detectors, train
from gyronet_train.rinsw_profiles import Limits, agreement, label

from .in_folder import InFolder
from .made_drive import make_drive

SETTINGS = Settings(units=8, steps=60, batch=8, rate=0.02)
QUICK = Settings(units=4, steps=2, batch=2)


def shaken_or_still(seed, seconds=60):
    """Samples that are shaken in every other stretch of 3 s, and labels: all four profiles are stillness."""
    random = np.random.default_rng(seed)
    still = (np.arange(100 * seconds) // 300) % 2 == 0
    samples = np.where(still[:, None], 0.1, 1.0) * random.normal(size=(len(still), 6))
    return samples, np.repeat(still[:, None], 4, axis=1)


class Learning(unittest.TestCase):
    def test_shaken_and_still_are_told_apart(self):
        samples, labels = shaken_or_still(1)
        detectors, seconds = train([samples], [labels], SETTINGS)
        held_out, true = shaken_or_still(2)
        found = agreement(detectors.detect(held_out), true)
        for profile, numbers in found.items():
            self.assertGreater(numbers["precision"], 0.97, profile)
            self.assertGreater(numbers["recall"], 0.9, profile)
        self.assertEqual(set(seconds), set(found))

    def test_one_seed_gives_one_result(self):
        samples, labels = shaken_or_still(1, 6)
        runs = [train([samples], [labels], QUICK)[0].probabilities(samples) for _ in range(2)]
        np.testing.assert_array_equal(*runs)
        other = train([samples], [labels], replace(QUICK, seed=2))[0].probabilities(samples)
        self.assertGreater(abs(other - runs[0]).max(), 0.0)

    def test_drives_that_cannot_be_learned_from_are_named(self):
        samples, labels = shaken_or_still(1, 3)
        with self.assertRaisesRegex(DetectorError, f"a drive of 300 samples: training needs at least {WINDOW}"):
            train([samples], [labels], QUICK)
        samples, labels = shaken_or_still(1, 6)
        for bad in (0.0, np.nan):
            samples[:, 2] = bad
            with self.assertRaisesRegex(DetectorError, "600 samples: a channel is constant or not a number"):
                train([samples], [labels], QUICK)


class Past(unittest.TestCase):
    def setUp(self):
        torch.manual_seed(1)
        self.detectors = Detectors(Settings(units=8)).eval()
        self.samples, _ = shaken_or_still(1, 12)
        self.before = self.detectors.probabilities(self.samples)

    def test_a_sample_changes_nothing_before_it(self):
        self.samples[750:] += 1.0
        after = self.detectors.probabilities(self.samples)
        np.testing.assert_array_equal(after[:750], self.before[:750])
        self.assertTrue((after[750] != self.before[750]).all())

    def test_what_is_older_than_a_window_changes_nothing(self):
        self.samples[100:700] += 1.0
        after = self.detectors.probabilities(self.samples)
        np.testing.assert_array_equal(after[1000:], self.before[1000:])
        self.assertTrue((after[700:800] != self.before[700:800]).any())

    def test_a_network_has_two_layers_of_each_kind(self):
        # An LSTM layer has four gates of weights for its input and its state and of two biases.
        units = Settings().units
        layers = [4 * units * (inputs + units + 2) for inputs in (6, units)]
        count = sum(layers) + units * (units + 1) + units + 1
        network = Detectors(Settings()).networks["velocity"]
        self.assertEqual(sum(p.numel() for p in network.parameters()), count)


class Files(InFolder):
    def setUp(self):
        super().setUp()
        self.path = self.folder / "detectors.safetensors"

    def test_what_is_written_is_read_as_it_was(self):
        samples, labels = shaken_or_still(1, 6)
        detectors, _ = train([samples], [labels], QUICK)
        detectors.save(self.path)
        read = load_detectors(self.path)
        self.assertEqual(read.settings, QUICK)
        np.testing.assert_array_equal(read.probabilities(samples), detectors.probabilities(samples))

    def test_a_file_that_is_missing_or_holds_no_detectors_is_named(self):
        with self.assertRaisesRegex(DetectorError, "detectors.safetensors: not a file of RINS-W detectors"):
            load_detectors(self.path)
        for content in (b"", b"no tensors", b"\x02\0\0\0\0\0\0\0{}"):
            self.path.write_bytes(content)
            with self.assertRaisesRegex(DetectorError, "detectors.safetensors: not a file of RINS-W detectors"):
                load_detectors(self.path)


class Labels(unittest.TestCase):
    def test_profiles_are_those_of_the_motion(self):
        time = np.arange(2000)
        speed = np.where(time < 500, 0.0, 8.0)
        turning = np.where(time < 1000, 0.0, 0.1)
        found = label(make_drive(speed, turning))
        standing, straight, bend = slice(20, 480), slice(520, 980), slice(1020, None)
        self.assertEqual(found[standing].all(axis=0).tolist(), [True, True, True, True])
        self.assertEqual(found[straight].mean(axis=0).tolist(), [0.0, 1.0, 1.0, 1.0])
        self.assertEqual(found[bend].mean(axis=0).tolist(), [0.0, 0.0, 1.0, 1.0])

    def test_a_limit_decides(self):
        drive = make_drive(np.full(1000, 0.05), np.zeros(1000))
        self.assertFalse(label(drive)[:, 0].any())
        self.assertTrue(label(drive, Limits(velocity=0.06))[:, 0].all())

    def test_agreement_counts_hits(self):
        true = np.zeros((10, 4), bool)
        detected = np.zeros((10, 4), bool)
        true[:4, 0] = detected[2:8, 0] = True
        numbers = agreement(detected, true)
        self.assertEqual(numbers["velocity"], {"share": 0.4, "precision": 0.33333, "recall": 0.5})
        self.assertEqual(numbers["lateral"], {"share": 0.0, "precision": None, "recall": None})

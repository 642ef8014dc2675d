"""lwoi's Gaussian processes: their size, the exact process as a limit, what they learn."""

import unittest

from .needs_torch import torch

import gpytorch
import numpy as np
from torch import nn

from gyronet_train.lwoi_process import (
    FEATURES,
    Features,
    ProcessError,
    Settings,
    SparseProcess,
    train,
)

NOISE = 0.1
SETTINGS = Settings(steps=200, rate=0.02)


def speed_windows(seed, count):
    """Windows at constant speeds of 1 to 20 m/s, with a turn that has nothing to do with them."""
    random = np.random.default_rng(seed)
    way = random.uniform(0.01, 0.2, count)[:, None] * np.ones(100)
    turn = 1e-3 * random.normal(size=count)[:, None] * np.ones(100)
    return np.stack([way, way, turn], axis=2)


class Size(unittest.TestCase):
    def test_the_network_has_the_papers_number_of_parameters(self):
        features = Features()
        self.assertEqual(sum(p.numel() for p in features.parameters()), 20_070)
        self.assertEqual(features(torch.zeros(2, 300)).shape, (2, FEATURES))

    def test_a_window_keeps_its_channels_apart(self):
        window = torch.arange(300.0).reshape(1, 100, 3)
        features = Features()
        expected = features.layers(window.transpose(1, 2))
        torch.testing.assert_close(features(window.flatten(1)), expected)


class Exactness(unittest.TestCase):
    """With its inducing points at the data and the best posterior, a sparse process is the exact one."""

    def setUp(self):
        torch.manual_seed(1)
        self.inputs, self.targets = torch.randn(12, FEATURES).double(), torch.randn(12).double()
        self.process = SparseProcess(nn.Identity(), self.inputs.clone(), 1).double()
        self.process.train()
        self.process(self.inputs)  # sets the posterior up
        kernel = self.process.covariance(self.inputs).to_dense()[0]
        self.jitter = 1e-8
        with torch.no_grad():
            root = torch.linalg.cholesky(kernel + self.jitter * torch.eye(12))
            exact = kernel + NOISE * torch.eye(12)
            # Of the whitened values v = L^-1 f: K + noise = L L' + noise.
            gain = torch.linalg.solve(exact, root).T
            variational = self.process.variational_strategy.base_variational_strategy._variational_distribution
            variational.variational_mean[0] = gain @ self.targets
            variational.chol_variational_covar[0] = torch.linalg.cholesky(torch.eye(12) - gain @ root)
        self.exact = exact
        self.process.eval()

    def predicted(self, inputs):
        with torch.no_grad(), gpytorch.settings.variational_cholesky_jitter(double_value=self.jitter):
            out = self.process(inputs)
            return out.mean[:, 0], out.variance[:, 0]

    def test_near_the_data_it_is_the_exact_process(self):
        inputs = self.inputs[:5] + 0.1
        mean, variance = self.predicted(inputs)
        with torch.no_grad():
            cross = self.process.covariance(inputs, self.inputs).to_dense()[0]
            weights = torch.linalg.solve(self.exact, cross.T)
            torch.testing.assert_close(mean, weights.T @ self.targets, atol=1e-5, rtol=0)
            torch.testing.assert_close(variance, 1 - (cross.T * weights).sum(0), atol=1e-5, rtol=0)

    def test_far_from_the_data_it_expects_nothing(self):
        mean, variance = self.predicted(100 + torch.zeros(1, FEATURES).double())
        self.assertLess(abs(mean).item(), 1e-6)
        self.assertAlmostEqual(variance.item(), 1.0, places=5)


class Learning(unittest.TestCase):
    def test_wheels_that_are_too_large_are_learned(self):
        windows, held_out = speed_windows(1, 300), speed_windows(2, 100)

        def errors(windows):
            ahead = -0.01 * windows[:, :, 0].sum(axis=1)
            noise = np.random.default_rng(3).normal(size=(len(windows), 1))
            return np.concatenate([ahead[:, None], 1e-3 * noise], axis=1)

        process = train(windows, errors(windows), SETTINGS)
        expected = process.predict(held_out)
        left = errors(held_out)[:, 0] - expected[:, 0]
        self.assertLess(abs(left.mean()), 0.1 * abs(errors(held_out)[:, 0].mean()))
        self.assertLess(np.sqrt((left**2).mean()), 0.1 * np.sqrt((errors(held_out)[:, 0] ** 2).mean()))

    def test_one_seed_gives_one_result(self):
        windows, errors = speed_windows(1, 50), np.random.default_rng(1).normal(size=(50, 2))
        runs = [train(windows, errors, Settings(steps=3)).predict(windows) for _ in range(2)]
        np.testing.assert_array_equal(*runs)

    def test_errors_without_spread_are_named(self):
        with self.assertRaisesRegex(ProcessError, "10 windows: .*constant"):
            train(speed_windows(1, 10), np.zeros((10, 2)), SETTINGS)

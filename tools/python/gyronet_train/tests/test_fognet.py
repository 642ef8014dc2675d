"""FoGNet's correction has no constant of its own once it is taken out; what is linear in the gyro's increments stays."""

import unittest

from .needs_torch import torch

import numpy as np

from gyronet_train.fognet import Windows, normalisation, take_out_constant
from gyronet_train.fognet_model import FoGNet
from gyronet_train.seconds import Seconds


class ConstantTest(unittest.TestCase):
    def test_the_constant_goes_and_the_linear_part_stays(self):
        random = np.random.default_rng(4)
        turn = random.normal(size=200) * 1e-2
        features = random.normal(size=(200, 9))
        features[:, 8] = 1.001 * turn
        data = Windows([Seconds("made", "", features, turn)], "repeat")
        torch.manual_seed(2)
        model = FoGNet(*normalisation(data)).eval()
        with torch.no_grad():
            model.fc3.weight.fill_(0.02)
            model.fc2.weight.normal_(std=0.1)
            model.fc4.bias.fill_(3.0)

        def parts():
            x, _ = data.take(data.full)
            with torch.no_grad():
                layers = model.layers(x)
                linear = model.correction_scale * model.fc4.weight[0, 1] * (layers["f3"] - model.fc3.bias)
            return layers["correction"] - linear, linear

        before, linear = parts()
        taken = take_out_constant(model, data)
        after, same = parts()
        self.assertGreater(abs(taken), 1e-5)
        self.assertAlmostEqual(taken, before.mean().item(), delta=1e-3 * abs(taken))
        self.assertLess(abs(after.mean().item()), 1e-4 * abs(taken))
        self.assertTrue(torch.equal(linear, same))
        self.assertTrue(torch.allclose(before - after, torch.full_like(before, taken), rtol=1e-3))

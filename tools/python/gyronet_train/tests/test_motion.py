"""Rotation vectors and their Jacobian."""

import unittest

import numpy as np
from scipy.spatial.transform import Rotation

from gyronet_train.motion import left_jacobian


class LeftJacobian(unittest.TestCase):
    def test_it_is_the_derivative_of_the_exponential(self):
        for rotation in (np.array([0.3, -0.8, 0.5]), np.array([1e-5, 2e-5, -1e-5]), np.array([1e-3, 0.0, 1e-3])):
            at, step = Rotation.from_rotvec(rotation), 1e-6
            columns = [
                (Rotation.from_rotvec(rotation + step * e) * at.inv()).as_rotvec() / step
                - (Rotation.from_rotvec(rotation - step * e) * at.inv()).as_rotvec() / step
                for e in np.eye(3)
            ]
            np.testing.assert_allclose(left_jacobian(rotation), np.array(columns).T / 2, atol=1e-8)

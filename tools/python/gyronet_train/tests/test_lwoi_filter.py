"""lwoi's filter: Jacobians, consistency on its own noise, divergence."""

import unittest

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from gyronet_train.lwoi_filter import (
    REFUSED_IN_A_ROW,
    Filter,
    Measured,
    Motion,
    expectation,
    motion_jacobian,
    twist_jacobian,
)
from gyronet_train.lwoi_motion import corrected
from gyronet_train.trajectory import FilterError

STEP = 1e-6
SPEEDS = (9.0, 9.5)
TWIST_STD = np.array([0.05, 0.01, 0.02, 0.004, 0.004, 0.001])
MEASURED_STD = np.array([0.002, 0.002, 0.002, 0.05, 0.05, 0.05, 0.02, 0.02, 0.02])
SPEED_STD = 0.02
SECONDS, RUNS = 15, 60


def some_state():
    state = Filter(Rotation.from_rotvec([0.1, -0.2, 1.5]), np.array([3.0, -7.0, 1.0]))
    state.move(Motion(Rotation.from_rotvec([0.02, -0.05, 0.3]), np.array([9.0, 1.0, 0.2]), np.eye(6)))
    return state


def differences(function, size):
    """The Jacobian of a function of an error at zero, by central differences."""
    columns = [(function(STEP * e) - function(-STEP * e)) / (2 * STEP) for e in np.eye(size)]
    return np.array(columns).T


class Jacobians(unittest.TestCase):
    def test_of_the_measurement_by_the_state(self):
        def expected(error):
            state = some_state()
            state.correct(error)
            return expectation(state, SPEEDS)[0]

        jacobian = expectation(some_state(), SPEEDS)[1]
        np.testing.assert_allclose(jacobian, differences(expected, 12), atol=1e-7)

    def test_of_the_measurement_by_the_speeds(self):
        jacobian = expectation(some_state(), SPEEDS)[2]
        by_speeds = differences(lambda e: expectation(some_state(), tuple(SPEEDS + e))[0], 2)
        np.testing.assert_allclose(jacobian, by_speeds, atol=1e-7)

    def test_of_a_motion_by_the_pose_and_by_its_twist(self):
        attitude, position = Rotation.from_rotvec([0.1, -0.2, 1.5]), np.array([3.0, -7.0, 1.0])
        rotation, way = Rotation.from_rotvec([0.02, -0.05, 0.3]), np.array([9.0, 1.0, 0.2])
        ahead = Filter(attitude, position)
        ahead.move(Motion(rotation, way, np.zeros((6, 6))))

        def after(error):
            state = Filter(Rotation.from_rotvec(error[:3]) * attitude, position + error[3:6])
            turned, moved = corrected(rotation, way[None], error[None, 6:])
            state.move(Motion(turned[0], moved[0], np.zeros((6, 6))))
            return ahead.error(state.attitude, state.position)

        jacobian = np.hstack([motion_jacobian(attitude, way), twist_jacobian(ahead.attitude)])
        np.testing.assert_allclose(jacobian, differences(after, 12), atol=1e-7)


def drive_with_noise(random, updates):
    """A drive whose noise is the filter's own; returns the pose's squared error by its covariance at the end."""
    true_attitude, true_position = Rotation.from_rotvec([0.0, 0.0, 1.0]), np.zeros(3)
    state, speed = Filter(true_attitude, true_position), 8.0
    for second in range(SECONDS):
        rotation, way = Rotation.from_rotvec([0, 0, 0.2 * np.sin(second)]), np.array([speed, 0.3, 0.0])
        twist = TWIST_STD * random.normal(size=6)
        turned, moved = corrected(rotation, way[None], twist[None])
        truth = Filter(true_attitude, true_position)
        truth.move(Motion(turned[0], moved[0], np.zeros((6, 6))))
        true_attitude, true_position = truth.attitude, truth.position
        state.move(Motion(rotation, way, np.diag(TWIST_STD**2)))
        if updates:
            true_speeds = (speed, speed + 0.1)
            value = expectation(truth, true_speeds)[0] + MEASURED_STD * random.normal(size=9)
            seen = tuple(true_speeds + SPEED_STD * random.normal(size=2))
            state.update(Measured(value, np.diag(MEASURED_STD**2), seen, SPEED_STD**2))
    error = state.error(true_attitude, true_position)
    return error @ np.linalg.solve(state.covariance[:6, :6], error), state.refused


class Consistency(unittest.TestCase):
    def test_the_error_is_what_the_covariance_says(self):
        for updates in (False, True):
            with self.subTest(updates=updates):
                random = np.random.default_rng(1)
                runs = [drive_with_noise(random, updates) for _ in range(RUNS)]
                low, high = chi2.ppf([0.025, 0.975], 6 * RUNS) / RUNS
                squared = np.mean([run[0] for run in runs])
                self.assertTrue(low < squared < high, f"{squared:.2f}, not within {low:.2f} to {high:.2f}")
                self.assertLess(sum(run[1] for run in runs), 0.01 * RUNS * SECONDS)

    def test_measurements_make_the_pose_surer(self):
        state = some_state()
        before = state.covariance.trace()
        value = expectation(state, SPEEDS)[0]
        self.assertTrue(state.update(Measured(value, np.diag(MEASURED_STD**2), SPEEDS, SPEED_STD**2)))
        self.assertLess(state.covariance.trace(), before)
        self.assertTrue((np.linalg.eigvalsh(state.covariance) > -1e-9).all())


class Divergence(unittest.TestCase):
    def test_measurements_that_never_fit_are_named(self):
        state = some_state()
        wrong = Measured(np.full(9, 1e3), np.diag(MEASURED_STD**2), SPEEDS, SPEED_STD**2)
        for _ in range(REFUSED_IN_A_ROW):
            self.assertFalse(state.update(wrong))
        with self.assertRaisesRegex(FilterError, "second 1: no measurement fits for 30 s"):
            state.update(wrong)

    def test_a_motion_that_is_not_a_number_is_named(self):
        state = some_state()
        with self.assertRaisesRegex(FilterError, "second 2: .*not finite"):
            state.move(Motion(Rotation.identity(), np.full(3, np.nan), np.eye(6)))

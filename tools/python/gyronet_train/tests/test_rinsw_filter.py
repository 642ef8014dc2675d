"""RINS-W's filter: exact motion, linear errors, biases at rest, consistency on its own noise, divergence."""

import unittest
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from gyronet_train.motion import GRAVITY, left_jacobian
from gyronet_train.rinsw_filter import STATES, Filter, Noise
from gyronet_train.sequence import DT
from gyronet_train.trajectory import FilterError

STEP = 1e-6
NOTHING, EVERYTHING = np.zeros(4, bool), np.ones(4, bool)
NO_SLIP = np.array([False, False, True, True])
LEVEL_REST = np.concatenate([np.zeros(3), -GRAVITY])
RUNS, SECONDS = 25, 6


def some_state(noise=Noise()):
    state = Filter(Rotation.from_rotvec([0.1, -0.2, 1.5]).as_matrix(), noise)
    state.velocity, state.position = np.array([9.0, 1.0, 0.2]), np.array([30.0, -70.0, 1.0])
    state.gyro_bias, state.force_bias = np.array([0.01, -0.02, 0.005]), np.array([0.1, 0.2, -0.1])
    return state


def error_of(state, truth):
    """The invariant error of a state, as `correct` takes it."""
    turn = Rotation.from_matrix(truth.attitude @ state.attitude.T)
    inverse = np.linalg.inv(left_jacobian(turn.as_rotvec()))
    vectors = [(truth.velocity, state.velocity), (truth.position, state.position)]
    ways = [inverse @ (true - turn.apply(estimate)) for true, estimate in vectors]
    biases = truth.gyro_bias - state.gyro_bias, truth.force_bias - state.force_bias
    return np.concatenate([turn.as_rotvec(), *ways, *biases])


def differences(function, size):
    """The Jacobian of a function of an error at zero, by central differences."""
    return np.array([(function(STEP * e) - function(-STEP * e)) / (2 * STEP) for e in np.eye(size)]).T


class Motion(unittest.TestCase):
    def test_a_constant_turn_is_its_closed_sum(self):
        speed, rate, count = 10.0, 0.1, 6000
        state = Filter(np.eye(3))
        state.velocity = np.array([speed, 0.0, 0.0])
        sample = np.array([0.0, 0.0, rate, 0.0, speed * rate, -GRAVITY[2]])
        for _ in range(count):
            state.move(sample, NOTHING)
        # As complex numbers: the force turns by q a step, and its sums are geometric series.
        q, force = np.exp(1j * rate * DT), 1j * speed * rate
        k = np.arange(count)
        velocity = speed + force * DT * (1 - q**k) / (1 - q)
        way = (velocity * DT + force * q**k * DT**2 / 2).sum()
        np.testing.assert_allclose(state.position, [way.real, way.imag, 0.0], atol=1e-9)
        turned = Rotation.from_euler("z", rate * count * DT).as_matrix()
        np.testing.assert_allclose(state.attitude, turned, atol=1e-9)
        circle = speed / rate * np.array([np.sin(rate * count * DT), 1 - np.cos(rate * count * DT), 0.0])
        self.assertLess(np.linalg.norm(state.position - circle), 0.5)

    def test_a_finite_error_of_the_pose_grows_linearly(self):
        truth, state = some_state(), some_state()
        error = np.array([0.5, -0.3, 0.8, 2.0, -1.0, 0.5, 10.0, 20.0, -5.0, 0, 0, 0, 0, 0, 0])
        truth.correct(error)
        sample = np.array([0.1, -0.2, 0.3, 1.0, 2.0, 9.0])
        time = 200 * DT
        for _ in range(200):
            truth.move(sample, NOTHING)
            state.move(sample, NOTHING)
        gained = np.cross(GRAVITY, error[:3])
        expected = error.copy()
        expected[3:6] += gained * time
        expected[6:9] += error[3:6] * time + gained * time**2 / 2
        np.testing.assert_allclose(error_of(state, truth), expected, atol=1e-9)

    def test_the_covariance_moves_as_errors_do(self):
        still = Noise(*np.zeros(4), start=tuple(np.linspace(0.1, 1.0, STATES)))
        sample = np.array([0.1, -0.2, 0.3, 1.0, 2.0, 9.0])
        for detected in (NOTHING, EVERYTHING, np.array([True, False, False, False]), ~EVERYTHING | NO_SLIP):
            with self.subTest(detected=detected):

                def after(error):
                    truth, state = some_state(), some_state()
                    truth.correct(error)
                    truth.move(sample, detected)
                    state.move(sample, detected)
                    return error_of(state, truth)

                state = some_state(still)
                transition = differences(after, STATES)
                expected = transition @ state.covariance @ transition.T
                state.move(sample, detected)
                np.testing.assert_allclose(state.covariance, expected, atol=3e-3)

    def test_what_is_detected_as_zero_is_not_integrated(self):
        state = some_state()
        before = state.attitude, state.velocity, state.position
        state.move(np.array([0.1, 0.2, 0.3, 1.0, 2.0, 3.0]), EVERYTHING)
        for now, then in zip((state.attitude, state.velocity, state.position), before):
            np.testing.assert_array_equal(now, then)


class Measurements(unittest.TestCase):
    def test_jacobians_are_derivatives(self):
        def expected(error):
            state = some_state()
            state.correct(error)
            in_body = state.attitude.T @ state.velocity
            return np.concatenate([in_body, state.gyro_bias, state.force_bias - state.attitude.T @ GRAVITY])

        state = some_state()
        jacobian = np.vstack([state.velocity_row(), state.gyro_row(), state.force_row()])
        np.testing.assert_allclose(jacobian, differences(expected, STATES), atol=1e-7)

    def test_a_straight_drive_with_exact_sensors_stays_as_it_is(self):
        state = Filter(np.eye(3))
        state.velocity = np.array([10.0, 0.0, 0.0])
        for _ in range(1000):
            state.move(LEVEL_REST, NO_SLIP)
            state.measure(LEVEL_REST, NO_SLIP)
        np.testing.assert_allclose(state.position, [100.0, 0.0, 0.0], atol=1e-9)
        np.testing.assert_allclose(state.attitude, np.eye(3), atol=1e-12)

    def test_a_bias_is_found_at_rest(self):
        bias = np.array([0.01, -0.005, 0.01])
        state = Filter(np.eye(3), replace(Noise(), start=(*Noise().start[:9], 0.02, 0.02, 0.02, 0.01, 0.01, 0.01)))
        sample = LEVEL_REST + np.pad(bias, (0, 3))
        for _ in range(1000):
            state.move(sample, EVERYTHING)
            state.measure(sample, EVERYTHING)
        np.testing.assert_allclose(state.gyro_bias, bias, atol=1e-4)
        np.testing.assert_allclose(state.position, np.zeros(3), atol=1e-9)

    def test_the_start_takes_bias_and_level_and_leaves_the_heading(self):
        random = np.random.default_rng(1)
        attitude = Rotation.from_euler("ZYX", [1.5, -0.03, 0.02])
        bias = np.array([0.004, -0.002, 0.003])
        rest = np.concatenate([bias, attitude.inv().apply(-GRAVITY)])
        noise = random.normal(size=(300, 6)) * np.repeat([5e-3, 0.1], 3)
        state = Filter(Rotation.from_euler("z", 1.5).as_matrix())
        state.start(rest + noise)
        np.testing.assert_allclose(state.gyro_bias, bias, atol=1e-3)
        off = (Rotation.from_matrix(state.attitude) * attitude.inv()).as_rotvec()
        np.testing.assert_allclose(off, np.zeros(3), atol=2e-3)
        self.assertLess(state.covariance[0, 0] ** 0.5, 2e-3)
        self.assertAlmostEqual(state.covariance[2, 2] ** 0.5, Noise().start[2], places=5)

    def test_a_shaken_sensor_is_no_measurement_of_rest(self):
        state = Filter(np.eye(3))
        state.measure(LEVEL_REST + [0.2, 0, 0, 1.0, 0, 0], EVERYTHING)
        self.assertEqual(state.refused, 2)
        np.testing.assert_array_equal(state.gyro_bias, np.zeros(3))


def drive_with_noise(random, noise):
    """A drive whose noise is the filter's own; returns the error's square by the covariance at the end."""
    state = Filter(Rotation.from_euler("z", 1.0).as_matrix(), noise)
    state.velocity = np.array([4.0, 6.0, 0.0])
    truth = Filter(state.attitude, noise)
    truth.velocity = state.velocity
    truth.correct(noise.start * random.normal(size=STATES))
    walk = np.repeat([noise.gyro_bias, noise.force_bias], 3) * DT
    per_sample = np.repeat([noise.gyro, noise.force], 3)
    variance = np.array([noise.lateral, noise.vertical]) ** 2
    for k in range(100 * SECONDS):
        rate = np.array([0.0, 0.0, 0.3 * np.sin(k * DT)])
        force = truth.attitude.T @ (-GRAVITY + np.cross([0, 0, rate[2]], truth.velocity))
        exact = np.concatenate([rate + truth.gyro_bias, force + truth.force_bias])
        truth.move(exact, NOTHING)
        state.move(exact + per_sample * random.normal(size=6), NOTHING)
        truth.gyro_bias, truth.force_bias = np.split(
            np.concatenate([truth.gyro_bias, truth.force_bias]) + walk * random.normal(size=6), 2
        )
        seen = (truth.attitude.T @ truth.velocity)[1:] + variance**0.5 * random.normal(size=2)
        expected = (state.attitude.T @ state.velocity)[1:]
        state.update(seen - expected, state.velocity_row()[1:], variance)
    error = error_of(state, truth)
    return error @ np.linalg.solve(state.covariance, error)


class Consistency(unittest.TestCase):
    def test_the_error_is_what_the_covariance_says(self):
        random = np.random.default_rng(1)
        noise = replace(Noise(), start=(0.02, 0.02, 0.02, 0.5, 0.5, 0.5, 1, 1, 1, *(1e-3,) * 3, *(1e-2,) * 3))
        low, high = chi2.ppf([0.025, 0.975], STATES * RUNS) / RUNS
        squared = np.mean([drive_with_noise(random, noise) for _ in range(RUNS)])
        self.assertTrue(low < squared < high, f"{squared:.2f}, not within {low:.2f} to {high:.2f}")


class Divergence(unittest.TestCase):
    def test_a_speed_that_no_car_has_is_named(self):
        state = Filter(np.eye(3))
        with self.assertRaisesRegex(FilterError, r"second 10\.0\d: diverged, its speed is 100 m/s"):
            for _ in range(2000):
                state.move(LEVEL_REST + [0, 0, 0, 10.0, 0, 0], NOTHING)

    def test_a_sample_that_is_not_a_number_is_named(self):
        with self.assertRaisesRegex(FilterError, r"second 0\.01: diverged, its speed is nan"):
            Filter(np.eye(3)).move(np.full(6, np.nan), NOTHING)

"""The invariant extended Kalman filter of RINS-W: inertial navigation with detected zero motions as measurements.

The state is attitude, velocity and position in a level frame, and the biases of gyro and
accelerometer. Errors are right-invariant, [turn, velocity, position, gyro bias, force bias]. The true
attitude is Exp(turn) times the estimate, the true velocity is Exp(turn) v + J(turn) error, and the
true position likewise, with J the left Jacobian; biases add. A detected profile is a measurement of
zero, and a motion that is detected as zero is not integrated.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .motion import GRAVITY, exponential, left_jacobian, skew
from .rinsw_profiles import LATERAL, ROTATION, VELOCITY, VERTICAL
from .sequence import DT
from .trajectory import FilterError

TURN, SPEED, PLACE, GYRO_BIAS, FORCE_BIAS = (slice(k, k + 3) for k in range(0, 15, 3))
STATES = 15
IDENTITY, ALL, GRAVITY_CROSS = np.eye(3), np.eye(STATES), skew(GRAVITY)
FASTEST = 100.0  # m/s: a filter with a higher speed has diverged
STILL_RATE, STILL_FORCE = 0.1, 0.6  # rad/s, m/s^2: largest residual of a sensor at standstill


@dataclass(frozen=True)
class Noise:
    """Standard deviations of each sample, of the biases' random walk, and of the measurements of zero."""

    gyro: float = 5e-3  # rad/s
    force: float = 0.1  # m/s^2
    gyro_bias: float = 1e-3  # rad/s^2
    force_bias: float = 2e-2  # m/s^3
    lateral: float = 2.0  # m/s
    vertical: float = 3.0  # m/s
    velocity: float = 1.0  # m/s, of each axis at standstill
    still_gyro: float = 0.04  # rad/s
    still_force: float = 0.4  # m/s^2
    # At the start: turn (the third is the heading), velocity, position, gyro bias, force bias.
    start: tuple = (0.1, 0.1, 1e-3, 0, 0, 0, 0.01, 0.01, 0.01, 1e-3, 1e-3, 1e-3, 1e-2, 1e-2, 1e-2)


class Filter:
    """The state at one sample, and the covariance of its error (15, 15)."""

    def __init__(self, attitude: np.ndarray, noise: Noise = Noise()):
        self.noise = noise
        self.attitude = np.array(attitude, dtype=float)
        self.velocity, self.position, self.gyro_bias, self.force_bias = np.zeros((4, 3))
        self.covariance = np.diag(np.square(noise.start).astype(float))
        self.steps = self.refused = 0

    def start(self, samples: np.ndarray) -> None:
        """Initialises gyro bias, roll, pitch and the accelerometer's bias from samples (n, 6) at standstill; the
        heading is kept."""
        gyro, force = samples.mean(axis=0).reshape(2, 3)
        yaw = Rotation.from_matrix(self.attitude).as_euler("ZYX")[0]
        pitch, roll = np.arctan2(-force[0], np.hypot(force[1], force[2])), np.arctan2(force[1], force[2])
        self.attitude = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
        self.gyro_bias, self.force_bias = gyro, force + self.attitude.T @ GRAVITY
        jacobian = np.vstack([self.gyro_row(), self.force_row()])
        spread = np.repeat([self.noise.gyro, self.noise.force], 3)
        self.update(np.zeros(6), jacobian, spread**2 / len(samples))

    def move(self, sample: np.ndarray, detected: np.ndarray) -> None:
        """Integrates a sample over a step. Velocity or attitude stays if it is detected as constant."""
        noise, moving, turning = self.noise, not detected[VELOCITY], not detected[ROTATION]
        growth, covariance = np.zeros((STATES, STATES)), self.covariance.copy()
        if turning:
            lever = np.concatenate([IDENTITY, skew(self.velocity), skew(self.position)])
            turned = lever @ self.attitude
            growth[:9, GYRO_BIAS] = -turned
            covariance[:9, :9] += (noise.gyro * DT) ** 2 * turned @ turned.T
        if moving:
            growth[SPEED, TURN], growth[SPEED, FORCE_BIAS] = GRAVITY_CROSS, -self.attitude
            growth[PLACE, SPEED] = IDENTITY
            covariance[range(3, 6), range(3, 6)] += (noise.force * DT) ** 2
            acceleration = self.attitude @ (sample[3:] - self.force_bias) + GRAVITY
            self.position = self.position + self.velocity * DT + acceleration * DT**2 / 2
            self.velocity = self.velocity + acceleration * DT
        if turning:
            self.attitude = self.attitude @ exponential((sample[:3] - self.gyro_bias) * DT)
        covariance[range(9, 12), range(9, 12)] += (noise.gyro_bias * DT) ** 2
        covariance[range(12, 15), range(12, 15)] += (noise.force_bias * DT) ** 2
        growth *= DT
        transition = ALL + growth + growth @ growth / 2
        self.covariance = transition @ covariance @ transition.T
        self.steps += 1
        self.check()

    def measure(self, sample: np.ndarray, detected: np.ndarray) -> None:
        """Corrects the state by each detected profile."""
        noise, residuals, jacobians, variances = self.noise, [], [], []

        def add(residual: np.ndarray, jacobian: np.ndarray, deviation: float) -> None:
            residuals.append(residual)
            jacobians.append(jacobian)
            variances.append(np.full(len(residual), deviation**2))

        in_body = self.attitude.T @ self.velocity
        if detected[VELOCITY]:
            add(-in_body, self.velocity_row(), noise.velocity)
            off = sample[3:] - self.force_bias + self.attitude.T @ GRAVITY
            if self.near(off, STILL_FORCE):
                add(off, self.force_row(), noise.still_force)
        else:
            for profile, axis, deviation in ((LATERAL, 1, noise.lateral), (VERTICAL, 2, noise.vertical)):
                if detected[profile]:
                    add(-in_body[axis : axis + 1], self.velocity_row()[axis : axis + 1], deviation)
        if detected[ROTATION]:
            off = sample[:3] - self.gyro_bias
            if self.near(off, STILL_RATE):
                add(off, self.gyro_row(), noise.still_gyro)
        if residuals:
            self.update(np.concatenate(residuals), np.concatenate(jacobians), np.concatenate(variances))

    def near(self, off: np.ndarray, limit: float) -> bool:
        """Returns whether a residual at standstill is within a limit; counts a measurement that is not as refused."""
        near = bool(off @ off < limit**2)
        self.refused += not near
        return near

    def velocity_row(self) -> np.ndarray:
        """Returns the Jacobian of the velocity in body axes."""
        row = np.zeros((3, STATES))
        row[:, SPEED] = self.attitude.T
        return row

    def gyro_row(self) -> np.ndarray:
        """Returns the Jacobian of the gyro's sample at rest."""
        row = np.zeros((3, STATES))
        row[:, GYRO_BIAS] = IDENTITY
        return row

    def force_row(self) -> np.ndarray:
        """Returns the Jacobian of the accelerometer's sample at rest."""
        row = np.zeros((3, STATES))
        row[:, TURN], row[:, FORCE_BIAS] = -self.attitude.T @ GRAVITY_CROSS, IDENTITY
        return row

    def update(self, residual: np.ndarray, jacobian: np.ndarray, variance: np.ndarray) -> None:
        """Corrects the state by measurements with independent noise."""
        across = jacobian @ self.covariance
        spread = across @ jacobian.T
        spread[np.diag_indices_from(spread)] += variance
        gain = np.linalg.solve(spread, across).T
        self.correct(gain @ residual)
        rest = ALL - gain @ jacobian
        self.covariance = rest @ self.covariance @ rest.T + gain * variance @ gain.T

    def correct(self, error: np.ndarray) -> None:
        """Applies an error (15) to the state."""
        jacobian = left_jacobian(error[TURN])
        turn = IDENTITY + skew(error[TURN]) @ jacobian
        self.attitude = turn @ self.attitude
        self.velocity = turn @ self.velocity + jacobian @ error[SPEED]
        self.position = turn @ self.position + jacobian @ error[PLACE]
        self.gyro_bias = self.gyro_bias + error[GYRO_BIAS]
        self.force_bias = self.force_bias + error[FORCE_BIAS]

    def check(self) -> None:
        """Raises FilterError if the filter has diverged; orthonormalises the attitude every 10,000 steps."""
        if not self.velocity @ self.velocity < FASTEST**2:
            speed = np.linalg.norm(self.velocity)
            raise FilterError(f"second {self.steps * DT:.2f}: diverged, its speed is {speed:.0f} m/s")
        if self.steps % 10_000 == 0:
            if not np.isfinite(self.covariance).all():
                raise FilterError(f"second {self.steps * DT:.2f}: diverged, the covariance is not finite")
            left, _, right = np.linalg.svd(self.attitude)
            self.attitude = left @ right

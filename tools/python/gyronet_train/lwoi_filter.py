"""The extended Kalman filter of lwoi: a pose every second, with its covariance.

The state is the pose and a copy of the pose one second earlier, since the inertial sensor's measurement
depends on both. Errors are [turn in world axes, position] of the pose, then of the copy; the true
attitude is Exp(turn) times the estimate. Odometry moves the pose on by a motion whose error is a twist at
its end. The inertial sensor then measures the second's rotation, velocity change and displacement, with
the wheels' speeds along the body's x axis as velocities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .lwoi_motion import WINDOW_S
from .motion import GRAVITY, left_jacobian, skew
from .trajectory import FilterError

POSE, COPY = slice(0, 6), slice(6, 12)
TURN, PLACE, OLD_TURN, OLD_PLACE = (slice(k, k + 3) for k in (0, 3, 6, 9))
AHEAD = np.array([1.0, 0.0, 0.0])
GATE = 27.88  # chi squared of nine numbers, exceeded with probability 0.001
REFUSED_IN_A_ROW = 30  # s of refused measurements after which the filter has diverged


@dataclass(frozen=True)
class Motion:
    """The motion in a second relative to its beginning, and the covariance of its twist (6, 6), translation first."""

    rotation: Rotation
    way: np.ndarray
    covariance: np.ndarray


@dataclass(frozen=True)
class Measured:
    """Rotation, velocity change and displacement in a second by the inertial sensor (9), their covariance, and the
    wheels' speeds at the beginning and the end of the second with their variance."""

    value: np.ndarray
    covariance: np.ndarray
    speeds: tuple[float, float]
    speed_variance: float


class Filter:
    """The pose, its copy of one second earlier, and the covariance of both."""

    def __init__(self, attitude: Rotation, position: np.ndarray):
        self.attitude = self.old_attitude = attitude
        self.position = self.old_position = np.array(position, dtype=float)
        self.covariance = np.zeros((12, 12))
        self.seconds = self.refused = self.refused_in_a_row = 0

    def move(self, motion: Motion) -> None:
        """Copies the pose, then moves it on by a second."""
        transition = motion_jacobian(self.attitude, motion.way)
        self.old_attitude, self.old_position = self.attitude, self.position
        self.position = self.position + self.attitude.apply(motion.way)
        self.attitude = self.attitude * motion.rotation
        both = np.vstack([transition, np.eye(6)])
        self.covariance = both @ self.covariance[POSE, POSE] @ both.T
        enters = twist_jacobian(self.attitude)
        self.covariance[POSE, POSE] += enters @ motion.covariance @ enters.T
        self.seconds += 1
        if not np.isfinite(self.covariance).all():
            raise FilterError(f"second {self.seconds}: the covariance is not finite")

    def update(self, measured: Measured) -> bool:
        """Corrects pose and copy by the inertial sensor's measurement; returns false if the measurement is refused."""
        expected, jacobian, by_speeds = expectation(self, measured.speeds)
        noise = measured.covariance + measured.speed_variance * by_speeds @ by_speeds.T
        spread = jacobian @ self.covariance @ jacobian.T + noise
        innovation = measured.value - expected
        if innovation @ np.linalg.solve(spread, innovation) > GATE:
            self.refused += 1
            self.refused_in_a_row += 1
            if self.refused_in_a_row > REFUSED_IN_A_ROW:
                raise FilterError(f"second {self.seconds}: no measurement fits for {REFUSED_IN_A_ROW} s")
            return False
        self.refused_in_a_row = 0
        gain = np.linalg.solve(spread, jacobian @ self.covariance).T
        self.correct(gain @ innovation)
        rest = np.eye(12) - gain @ jacobian
        self.covariance = rest @ self.covariance @ rest.T + gain @ noise @ gain.T
        return True

    def correct(self, error: np.ndarray) -> None:
        """Applies an error of the state (12) to the estimate."""
        self.attitude = Rotation.from_rotvec(error[TURN]) * self.attitude
        self.position = self.position + error[PLACE]
        self.old_attitude = Rotation.from_rotvec(error[OLD_TURN]) * self.old_attitude
        self.old_position = self.old_position + error[OLD_PLACE]

    def error(self, attitude: Rotation, position: np.ndarray) -> np.ndarray:
        """Returns the error of the pose (6) against a true pose."""
        return np.concatenate([(attitude * self.attitude.inv()).as_rotvec(), position - self.position])


def motion_jacobian(attitude: Rotation, way: np.ndarray) -> np.ndarray:
    """Returns the Jacobian of the error of a pose over a motion (6, 6)."""
    jacobian = np.eye(6)
    jacobian[PLACE, TURN] = -skew(attitude.apply(way))
    return jacobian


def twist_jacobian(attitude: Rotation) -> np.ndarray:
    """Returns the Jacobian of the error of a pose with respect to a twist at the end of the motion (6, 6)."""
    jacobian = np.zeros((6, 6))
    jacobian[TURN, 3:] = jacobian[PLACE, :3] = attitude.as_matrix()
    return jacobian


def expectation(state: Filter, speeds: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the expected measurement of the inertial sensor (9), and its Jacobians with respect to the state (9, 12)
    and to both speeds (9, 2)."""
    to_body = state.old_attitude.as_matrix().T
    ahead, old_ahead = state.attitude.apply(AHEAD), state.old_attitude.apply(AHEAD)
    velocity, old_velocity = speeds[1] * ahead, speeds[0] * old_ahead
    gained = velocity - old_velocity - GRAVITY * WINDOW_S
    moved = state.position - state.old_position - old_velocity * WINDOW_S - GRAVITY * WINDOW_S**2 / 2
    turn = (state.old_attitude.inv() * state.attitude).as_rotvec()
    jacobian = np.zeros((9, 12))
    by_turn = np.linalg.solve(left_jacobian(turn), to_body)
    jacobian[0:3, TURN], jacobian[0:3, OLD_TURN] = by_turn, -by_turn
    jacobian[3:6, TURN] = -to_body @ skew(velocity)
    jacobian[3:6, OLD_TURN] = to_body @ (skew(gained) + skew(old_velocity))
    jacobian[6:9, PLACE], jacobian[6:9, OLD_PLACE] = to_body, -to_body
    jacobian[6:9, OLD_TURN] = to_body @ (skew(moved) + WINDOW_S * skew(old_velocity))
    by_speeds = np.zeros((9, 2))
    by_speeds[3:6, 0], by_speeds[3:6, 1] = -to_body @ old_ahead, to_body @ ahead
    by_speeds[6:9, 0] = -WINDOW_S * to_body @ old_ahead
    return np.concatenate([turn, to_body @ gained, to_body @ moved]), jacobian, by_speeds

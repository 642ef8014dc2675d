"""Drives made for lwoi's tests: wheels, gyro and inertial sensor agree with a path."""

import numpy as np
from scipy.spatial.transform import Rotation

from gyronet_train.lwoi_motion import GRAVITY, odometry_motion
from gyronet_train.lwoi_sequence import DT, STEPS, Sequence

START = np.array([355_000.0, 4_025_000.0, 60.0])
START_YAW = 2.0


def make_drive(speed, yaw_rate):
    """A level drive of whole seconds by speed and yaw rate at its steps; its truth is odometry's own sum."""
    speed, yaw_rate = np.asarray(speed, float), np.asarray(yaw_rate, float)
    yaw = START_YAW + np.concatenate([[0.0], np.cumsum(yaw_rate * DT)])
    steps = (speed * DT)[:, None] * np.stack([np.cos(yaw[:-1]), np.sin(yaw[:-1]), 0 * speed], axis=1)
    position = START + np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    force = np.stack([np.gradient(speed, DT), speed * yaw_rate, 0 * speed - GRAVITY[2]], axis=1)
    gyro = np.stack([0 * speed, 0 * speed, yaw_rate], axis=1)
    return Sequence(
        name="made",
        sha256="",
        start_ns=1_524_000_000_010_000_000,
        odometry=np.stack([speed * DT, speed * DT, yaw_rate * DT], axis=1).reshape(-1, STEPS, 3),
        inertial=np.concatenate([gyro, force], axis=1).reshape(-1, STEPS, 6),
        attitude=Rotation.from_euler("z", yaw[:, None]),
        position=position,
    )


def expected_end(drive):
    """The pose at the end of the drive by its windows, one after the other."""
    rotation, way = odometry_motion(drive.odometry)
    attitude, position = drive.attitude[0], drive.position[0]
    for k in range(len(drive)):
        position = position + attitude.apply(way[k])
        attitude = attitude * rotation[k]
    return attitude, position

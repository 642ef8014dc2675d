"""Drives made for the tests of rivals: wheels, gyro and inertial sensor agree with a path."""

import numpy as np
from scipy.spatial.transform import Rotation

from gyronet_train.lwoi_motion import odometry_motion
from gyronet_train.motion import GRAVITY
from gyronet_train.sequence import DT, STEPS, Sequence

START = np.array([355_000.0, 4_025_000.0, 60.0])
START_YAW = 2.0
SECONDS, SPEED = 12, 7.0  # of start_and_go
COUNTS_PER_M = 4096 / (np.pi * 0.623)


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
        whole=np.ones(len(speed) // STEPS, bool),
    )


def start_and_go():
    """Four seconds of standing, then a bend at constant speed."""
    going = np.arange(100 * SECONDS) >= 400
    return make_drive(SPEED * going, 0.1 * going)


def expected_end(drive):
    """The pose at the end of the drive by its windows, one after the other."""
    rotation, way = odometry_motion(drive.odometry)
    attitude, position = drive.attitude[0], drive.position[0]
    for k in range(len(drive)):
        position = position + attitude.apply(way[k])
        attitude = attitude * rotation[k]
    return attitude, position


def write_kaist(drive, folder):
    """Writes a drive in the layout of KAIST Urban."""
    (folder / "sensor_data").mkdir(parents=True)
    (folder / "calibration").mkdir()
    stamps = drive.start_ns + 10_000_000 * np.arange(len(drive) * STEPS + 1)
    odometry, inertial = drive.odometry.reshape(-1, 3), drive.inertial.reshape(-1, 6)
    counts = np.round(np.concatenate([np.zeros((1, 2)), np.cumsum(odometry[:, :2], axis=0)]) * COUNTS_PER_M)
    matrices = drive.attitude.as_matrix()

    def write(name, rows):
        lines = (",".join([str(stamp), *(f"{x:.9f}" for x in row)]) for stamp, row in zip(stamps, rows))
        (folder / name).write_text("\n".join(lines) + "\n")

    imu = np.zeros((len(stamps), 16))
    imu[1:, 7:13], imu[0, 7:13] = inertial, inertial[0]
    write("sensor_data/xsens_imu.csv", imu)
    write("sensor_data/encoder.csv", counts)
    write("sensor_data/fog.csv", np.pad(odometry[:, 2:], ((1, 0), (2, 0))))
    write("global_pose.csv", np.concatenate([matrices, drive.position[..., None]], axis=2).reshape(-1, 12))
    diameters = "Encoder left wheel diameter: 0.623\nEncoder right wheel diameter: 0.623\n"
    (folder / "calibration" / "EncoderParameter.txt").write_text(f"Encoder resolution: 4096\n{diameters}")

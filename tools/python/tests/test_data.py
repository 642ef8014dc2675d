"""Logs of other people's tools (GYRONET_DATA/logs), imported or refused for a reason; a drive imported again."""

import os
import shutil
import tomllib
import unittest
from pathlib import Path

import numpy as np

import made

DATA = Path(os.environ.get("GYRONET_DATA", "/nonexistent")) / "logs"
OUT = ["--out", "out.csv"]


@unittest.skipUnless(DATA.is_dir(), "no GYRONET_DATA")
class Logs(made.Case):
    def test_a_robot(self):
        drive = self.imports(DATA / "jackal.bag", *OUT, says=["imu: /imu/data, m/s^2, rad/s, 50.0 Hz, 0.00 to 61.20 s"])
        self.assertEqual(len(drive["t_s"]), 6_121)
        self.assertGreater(np.isfinite(drive["wheel2_rate"]).sum(), 6_000)

    def test_two_imus_and_two_odometries(self):
        bag = DATA / "xsens_wheels_stereo.bag"
        self.refuses(bag, *OUT, says=["several channels fit as imu"])
        self.refuses(bag, "--imu", "/imu", *OUT, says=["/imu"])
        drive = self.imports(bag, "--imu", "/xsens/imu_data", "--odometry", "/wheel_odometry", *OUT)
        self.assertTrue(13_200 < len(drive["t_s"]) < 13_300)

    def test_an_aircraft_that_stands(self):
        drive = self.imports(DATA / "px4_sample_log_small.ulg", *OUT)
        self.assertTrue(600 <= len(drive["t_s"]) <= 655)
        self.assertTrue(9.5 < drive["acc_z"].mean() < 10.1)

    def test_bus_logs_without_an_imu(self):
        for name in ["logfile.asc", "test_CanMessage.blf", "test_CanMessage_V2_1.trc"]:
            self.refuses(DATA / name, *OUT, says=["no IMU"])


class Again(made.Case):
    def test_a_part_of_a_drive_keeps_the_time_of_day_and_the_rates(self):
        t = made.times()
        made.mcap(self.folder / "d.mcap", made.imu_messages(t, made.imu(t)))
        self.assertEqual(made.run(self.folder, "import", "d.mcap", "--out", "first.csv")[0], 0)
        self.imports("first.csv", "--from", "2", *OUT)
        said = [tomllib.loads((self.folder / name).read_text())["recording"] for name in ("first.toml", "out.toml")]
        self.assertEqual([recording["rates"]["imu"] for recording in said], [50.0, 50.0])
        starts = [recording["start"] for recording in said]
        np.testing.assert_allclose(starts, [made.START, made.START + 2], atol=2e-6)
        # Another drive's file says nothing about this one.
        shutil.copy(self.folder / "first.csv", self.folder / "other.csv")
        self.imports("other.csv", "--vehicle", "first.toml", "--imu", "imu", *OUT)
        said = tomllib.loads((self.folder / "out.toml").read_text())["recording"]
        self.assertEqual((said.get("start"), said["rates"]["imu"]), (None, 100.0))

    def test_a_mounting_that_is_edited_counts(self):
        t = made.times()
        made.mcap(self.folder / "d.mcap", made.imu_messages(t, made.imu(t)))
        (self.folder / "d.toml").write_text("[mounting]\nroll_deg = 10.0\nyaw_deg = 90.0\n")
        first = self.imports("d.mcap", *OUT)
        beside = self.folder / "out.toml"
        text = beside.read_text()
        self.assertEqual(tomllib.loads(text)["mounting"]["yaw_deg"], 0.0)
        beside.write_text(text.replace("yaw_deg = 0.0", "yaw_deg = -90.0", 1))
        self.assertEqual(made.run(self.folder, "import", "out.csv", "--out", "again.csv")[0], 0)
        again = made.drive(self.folder, "again.csv")
        np.testing.assert_allclose(again["acc_x"], first["acc_y"], atol=2e-7)
        whole = tomllib.loads((self.folder / "again.toml").read_text())["recording"]["mounting"]
        # For another log of the vehicle, both turns in one; so also from the files of older imports.
        (self.folder / "old.toml").write_text("[mounting]\napplied = true\n" + "".join(f"{key} = {value}\n" for key, value in whole.items()))
        for vehicle in ("again.toml", "old.toml"):
            self.assertEqual(made.run(self.folder, "import", "d.mcap", "--vehicle", vehicle, "--imu", "/imu", "--out", "both.csv")[0], 0)
            np.testing.assert_allclose(made.drive(self.folder, "both.csv")["acc_x"], again["acc_x"], atol=3e-7)

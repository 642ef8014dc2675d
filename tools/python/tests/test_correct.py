"""Corrected bags: the board's rates in the IMU's messages, its quality beside them, and nothing else changed."""

import shutil
import unittest

import numpy as np
from rosbags.highlevel import AnyReader

import made

try:
    from gyronet import Coprocessor, bags
    from gyronet.vehicle import Vehicle
except ImportError:
    raise unittest.SkipTest("the board's extension is not built: pip install ./tools/python with Rust") from None

KINDS = ["one.bag", "lite", "cap", "zst", "d.mcap"]
MOUNTING = "[mounting]\nroll_deg = 10.0\npitch_deg = -20.0\nyaw_deg = 90.0\n"


class Correct(made.Case):
    def setUp(self):
        super().setUp()
        self.t = made.times(20.0, 100.0)
        self.rows = made.imu(self.t)

    def make(self, name, fixes=(), **more):
        store = made.STORE1 if name == "one.bag" else made.STORE
        messages = [*made.imu_messages(self.t, self.rows, store, **more), *made.odometry_messages(made.times(20.0, 10.0), store), *fixes]
        path = self.folder / name
        if name == "one.bag":
            made.bag1(path, messages)
        elif name == "d.mcap":
            made.mcap(path, messages)
        else:
            made.bag2(path, messages, "mcap" if name == "cap" else "sqlite3", "FILE" if name == "zst" else None)
        return path

    def correct(self, *arguments):
        status, text = made.run(self.folder, "correct", *arguments)
        self.assertEqual(status, 0, text)
        return text

    def read(self, path):
        """Topic, time and bytes of every message, and the messages of the two topics that correct writes."""
        with AnyReader([path], default_typestore=made.STORE) as reader:
            raw, found = [], {"/imu": [], bags.TOPIC: []}
            for connection, recorded, data in reader.messages():
                raw.append((connection.topic, recorded, bytes(data)))
                if connection.topic in found:
                    found[connection.topic].append(reader.deserialize(data, connection.msgtype))
        return raw, found["/imu"], found[bags.TOPIC]

    def rates(self, messages):
        return np.array([[getattr(m.angular_velocity, axis) for axis in "xyz"] for m in messages])

    def board(self, name, *flags):
        """The board's results on the drive that import writes."""
        self.assertEqual(made.run(self.folder, "import", name, *flags, "--out", "drive.csv")[0], 0)
        drive = made.drive(self.folder, "drive.csv")
        wheels = np.column_stack([drive.get(f"wheel{k}_rate", np.full(len(drive["t_s"]), np.nan)) for k in range(1, 5)])
        imu = np.column_stack([drive[f"{kind}_{axis}"] for kind in ("acc", "gyr") for axis in "xyz"])
        gnss = [drive.get(name, np.full(len(drive["t_s"]), np.nan)) for name in ("course", "course_sigma", "gnss_speed", "gnss_lat", "gnss_lon")]
        gnss = np.column_stack(gnss) if "gnss_lat" in drive else None
        return Coprocessor(wheels=np.isfinite(wheels).any(axis=0)).run(drive["t_s"], imu, wheels, gnss=gnss)

    def test_every_kind_of_bag_has_the_rates_of_its_drive(self):
        for name in KINDS:
            with self.subTest(name):
                path, out = self.make(name), self.folder / f"out_{name}"
                self.assertIn("1700 messages of /imu corrected, 300 left", self.correct(name, "--out", out.name))
                (before, old, _), (after, new, quality) = self.read(path), self.read(out)
                others = [[m for m in raw if m[0] not in ("/imu", bags.TOPIC)] for raw in (before, after)]
                self.assertEqual(others[0], others[1])
                self.assertEqual([m[:2] for m in before], [m[:2] for m in after if m[0] != bags.TOPIC])
                for a, b in zip(old, new):
                    self.assertEqual(*[(str(m.header), str(m.linear_acceleration), str(m.orientation)) for m in (a, b)])
                steps, rates = self.board(name), self.rates(new)
                rate = np.where(np.isfinite(steps["delayed"]), steps["delayed"], steps["live"])
                sigma = np.where(np.isfinite(steps["delayed"]), steps["delayed_sigma"], steps["live_sigma"])
                np.testing.assert_allclose(rates[300:, 2], rate[300:], atol=2e-7)
                np.testing.assert_allclose(rates[300:, 0], steps["roll_rate"][300:], atol=2e-7)
                np.testing.assert_array_equal(rates[:300], self.rates(old)[:300])
                variance = [m.angular_velocity_covariance[[0, 4, 8]] for m in new[300:]]
                np.testing.assert_allclose(variance, np.repeat(sigma[300:, None] ** 2, 3, axis=1), rtol=1e-5)
                self.assertTrue(20 <= len(quality) <= 40)
                said = [(m.status[0].level, {v.key: v.value for v in m.status[0].values}["status"]) for m in quality]
                self.assertEqual(said[0], (1, "initialising"))
                self.assertEqual(said[-1], (0, "ready"))

    def test_a_turned_sensor_keeps_its_axes_and_its_covariance_across(self):
        t, old = self.t, np.diag([4e-6, 5e-6, 6e-6])
        (self.folder / "v.toml").write_text(MOUNTING)
        turn = Vehicle.read(self.folder / "v.toml").turn(np.eye(3))
        self.rows = np.hstack([self.rows[:, :3] @ turn.T, self.rows[:, 3:] @ turn.T])
        self.make("d.mcap", angular_velocity_covariance=old.ravel())
        self.correct("d.mcap", "--vehicle", "v.toml", "--out", "out.mcap")
        steps, (_, new, _) = self.board("d.mcap", "--vehicle", "v.toml"), self.read(self.folder / "out.mcap")
        vehicle = self.rates(new) @ turn
        np.testing.assert_allclose(vehicle[300:-8, 2], steps["delayed"][300:-8], atol=3e-7)
        found = turn.T @ new[1000].angular_velocity_covariance.reshape(3, 3) @ turn
        np.testing.assert_allclose(found[2, 2], steps["delayed_sigma"][1000] ** 2, rtol=1e-5)
        np.testing.assert_allclose(found[:2, :2], (turn.T @ old @ turn)[:2, :2], rtol=1e-9)

    def test_positions_correct_a_bias_that_changes_after_the_start(self):
        self.t = made.times(120.0, 100.0)
        self.rows = made.imu(self.t) + np.outer(self.t > 4, [0, 0, 0, 0, 0, 0.003])
        self.make("d.mcap", made.fix_messages(made.times(120.0, 5.0)))
        late, error = self.t > 90, {}
        for position in ("/fix", "none"):
            self.correct("d.mcap", "--odometry", "none", "--position", position, "--out", f"{position[-3:]}.mcap")
            _, new, _ = self.read(self.folder / f"{position[-3:]}.mcap")
            error[position] = abs(np.mean(self.rates(new)[late, 2] - made.turn(self.t[late])))
            steps = self.board("d.mcap", "--odometry", "none", "--position", position)
            np.testing.assert_allclose(self.rates(new)[300:-8, 2], steps["delayed"][300:-8], atol=2e-7)
        self.assertLess(error["/fix"], 1e-3, error)
        self.assertGreater(error["none"], 2e-3, error)

    def test_other_rates_and_units(self):
        for hz, unit, scale in ((50.0, None, 1.0), (400.0, None, 1.0), (100.0, "/imu=deg/s", np.degrees(1.0))):
            self.t = made.times(20.0, hz)
            self.rows = made.imu(self.t, rate=scale) + np.array([0, 0, 0, 0, 0, 0.01 * scale])
            shutil.rmtree(self.folder / "lite", ignore_errors=True)
            self.make("lite")
            self.correct("lite", *(["--unit", unit] if unit else []), "--out", f"out{hz}{unit and 'deg' or ''}")
            _, new, _ = self.read(self.folder / f"out{hz}{unit and 'deg' or ''}")
            late = self.t > 5
            error = np.mean(self.rates(new)[late, 2] / scale - made.turn(self.t[late]))
            self.assertLess(abs(error), 2e-3, (hz, unit))  # of a bias of 0.01

    def test_refused_and_nothing_left_behind(self):
        self.make("d.mcap")
        whole = (self.folder / "d.mcap").read_bytes()
        (self.folder / "cut.mcap").write_bytes(whole[: len(whole) // 2])
        self.rows[:, 5] += 0.002 * np.arange(len(self.t))
        self.make("lite")
        made.table(self.folder / "t.csv", self.t, self.rows)
        self.correct("d.mcap", "--out", "once.mcap")
        shutil.copy(next((self.folder / "lite").glob("*.db3")), self.folder / "lone.db3")
        before = sorted(self.folder.rglob("*"))
        for arguments, words in (("d.mcap --out d.mcap", "exists already"), ("t.csv --out o", "not a ROS bag"), ("none --out o", "No such file"),
                                 ("cut.mcap --out o", "cannot be copied"), ("lone.db3 --out o", "ros2 bag reindex FOLDER, and correct FOLDER"), ("lite --out o", "--from SECONDS"), ("once.mcap --out o", "corrected already"),
                                 ("d.mcap --out no/o.mcap", "No such file"), ("d.mcap --weights none.blob --out o", "none.blob")):
            status, text = made.run(self.folder, "correct", *arguments.split())
            self.assertEqual((status, text.count("\n"), text[:7]), (1, 1, "error: "), (arguments, text))
            self.assertIn(words, text)
            self.assertEqual(sorted(self.folder.rglob("*")), before, arguments)

"""Equality with the reference libraries: what lies in a channel is what they read from the same file."""

import os
import random
from pathlib import Path

import asammdf
import can
import cantools
import numpy as np
from pyulog import ULog
from rosbags.highlevel import AnyReader

from gyronet.logs import opened
from gyronet.logs.can import Bus
from gyronet.logs.opened import Request
import made

DATA = Path(os.environ.get("GYRONET_DATA", "/nonexistent")) / "logs"


def channels(path, bus=None):
    return opened.read(Path(path), Request([path]), bus or Bus(None, []), False).channels


class Equal(made.Case):
    def test_random_dbc_files_as_cantools(self):
        rng = random.Random(36)
        for _ in range(300):
            path, at, names, multiplexed = self.folder / "car.dbc", 8, [], rng.random() < 0.4
            signals = [f' SG_ Page {"M " * multiplexed}: 0|2@1+ (1,0) [0|3] "" E']
            while at < 56:
                bits, intel = rng.randint(1, min(20, 64 - at)), rng.randint(0, 1)
                place, sign = rng.randint(0, -bits % 8), rng.choice("+-") if bits > 1 else "+"
                names.append(f"S{len(names)}")
                page = f" m{rng.randrange(3)}" if multiplexed and rng.random() < 0.7 else ""
                factor, offset = rng.choice([1, 0.01, -0.5, 3e-3]), rng.choice([0, -40, 12.5])
                signals.append(f' SG_ {names[-1]}{page} : {at + place if intel else at + 7 - place}|{bits}@{intel}{sign} ({factor},{offset}) [0|0] "m" E')
                at += 8 * -(-bits // 8)
            extended = rng.random() < 0.3
            identifier = rng.randrange(0x800, 1 << 29) | 1 << 31 if extended else rng.randrange(0x800)
            made.dbc(path, identifier, name="M", signals=signals)
            bus, reference = Bus(str(path), [f"M.{name}" for name in names]), cantools.database.load_file(path, strict=False)
            for k in range(20):
                data, log = rng.randbytes(8), opened.Log("x")
                try:
                    expected = reference.get_message_by_name("M").decode(data, decode_choices=False)
                except cantools.database.errors.DecodeError:  # a page without signals
                    expected = {}
                bus.add(log, float(k + 1), "", identifier & (1 << 29) - 1, extended, data)
                log.close()
                found = {name.removeprefix("M."): float(channel.rows()[0, 1]) for name, channel in log.channels.items()}
                self.assertEqual(found, {name: value for name, value in expected.items() if name in names}, path.read_text())

    def test_can_logs_as_python_can(self):
        files = sorted(DATA.glob("*.blf")) + sorted(DATA.glob("*.asc")) + sorted(DATA.glob("*.trc"))
        for suffix in (".blf", ".log", ".asc", ".mf4"):
            path = self.folder / f"made{suffix}"
            made.bus(path, made.frames(2.0))
            files.append(path)

        class Seen(Bus):
            def add(self, log, seconds, bus, identifier, extended, data):
                self.frames.append((seconds, identifier, extended, data))

        for path in files:
            bus = Seen(None, [])
            bus.frames = []
            opened.read(path, Request([path]), bus, False)
            with can.LogReader(path) as reader:
                frames = [(m.timestamp, m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in reader
                          if not (m.is_error_frame or m.is_remote_frame)]
            self.assertEqual(bus.frames, frames, path)
            self.assertTrue(frames, path)

    def test_bags_as_rosbags(self):
        t = made.times()
        made.bag2(self.folder / "lite", made.imu_messages(t, made.imu(t)))
        made.bag2(self.folder / "cap", made.imu_messages(t, made.imu(t)), "mcap")
        made.bag1(self.folder / "one.bag", made.imu_messages(t, made.imu(t), made.STORE1))
        for path in [*(self.folder / name for name in ("lite", "lite/lite.db3", "cap", "cap/cap.mcap", "one.bag")), *sorted(DATA.glob("*.bag"))]:
            expected = {}
            with AnyReader([path], default_typestore=made.STORE) as reader:
                for connection, _, data in reader.messages([c for c in reader.connections if c.msgtype == "sensor_msgs/msg/Imu"]):
                    m = reader.deserialize(data, connection.msgtype)
                    f, w, s = m.linear_acceleration, m.angular_velocity, m.header.stamp
                    expected.setdefault(connection.topic, []).append((s.sec + 1e-9 * s.nanosec, f.x, f.y, f.z, w.x, w.y, w.z))
            found = channels(path)
            for topic, rows in expected.items():
                rows = np.array(rows)
                rises = np.append(True, rows[1:, 0] > np.maximum.accumulate(rows[:-1, 0]))
                np.testing.assert_array_equal(found[topic].rows(), rows[rises])
            self.assertTrue(expected)

    def test_ulogs_as_pyulog(self):
        for path in sorted(DATA.glob("*.ulg")):
            found = channels(path)["sensor_combined"].rows()
            data = ULog(str(path), ["sensor_combined"]).get_dataset("sensor_combined").data
            rows = np.column_stack([1e-6 * data["timestamp"], *(data[f"accelerometer_m_s2[{k}]"] for k in range(3)), *(data[f"gyro_rad[{k}]"] for k in range(3))])
            np.testing.assert_array_equal(found, rows * [1, 1, -1, -1, 1, -1, -1])

    def test_mdf_as_asammdf_also_unfinished(self):
        path, t, rows = self.folder / "d.mf4", made.times(), made.imu(made.times())
        names = ["acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"]
        mdf = asammdf.MDF()
        mdf.append([asammdf.Signal(rows[:, k], t, name=name, unit="m/s^2" if k < 3 else "deg/s") for k, name in enumerate(names)])
        mdf.save(path, overwrite=True)
        for begins in (b"MDF     ", b"UnFinMF "):
            path.write_bytes(begins + path.read_bytes()[8:])
            found = channels(path)
            np.testing.assert_allclose(found["gyro"].rows()[:, 1:], np.radians(rows[:, 3:]), rtol=1e-12)
            np.testing.assert_array_equal(found["accel"].rows()[:, 1:], rows[:, :3])
        self.assertEqual(made.run(self.folder, "import", "d.mf4")[0], 0)
        mdf = asammdf.MDF()
        mdf.append([asammdf.Signal(rows[:, k], 1000 * t, name=name, unit="m/s^2" if k < 3 else "rad/s") for k, name in enumerate(names)])
        mdf.append([asammdf.Signal(np.array([b"fast"] * len(t)), t, name="W.L", encoding="utf-8")])
        mdf.save(self.folder / "ms.mf4", overwrite=True)
        self.assertIn("--unit t_s=ms", made.run(self.folder, "import", "ms.mf4")[1])
        self.assertEqual(made.run(self.folder, "import", "ms.mf4", "--unit", "t_s=ms")[0], 0)
        (self.folder / "v.toml").write_text("[wheels]\nrear_left = 'W.L'\n")
        status, text = made.run(self.folder, "import", "ms.mf4", "--unit", "t_s=ms", "--vehicle", "v.toml")
        self.assertEqual((status, text), (1, "error: ms.mf4: W.L: texts, not numbers\n"))
        path.write_bytes(path.read_bytes()[:600])
        status, text = made.run(self.folder, "import", "d.mf4", "--out", "out.csv")
        self.assertEqual((status, text.count("\n")), (1, 1), text)
        self.assertIn("asammdf cannot read this MDF file", text)

"""Bad input: one clear line each, and nothing left behind."""

import os
import random
import subprocess
import sys
import tomllib
import unittest

import made

TEXTS = {
    "pointer.bag": (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n", "git lfs pull"),
    "page.mcap": (b"<!DOCTYPE html><html>not found</html>", "a web page, not a log"),
    "empty.log": (b"", "is empty"),
    "zip.ulg": (b"PK\x03\x04" + bytes(50), "unpack it, or save the sheet as CSV"),
    "packed.bag": (b"\x1f\x8b" + bytes(50), "gunzip FILE"),
    "wide.csv": ("t_s,acc_x\n1,2\n".encode("utf-16"), "UTF-16 text; save it as UTF-8"),
    "old.bag": (b"#ROSBAG V1.2\n" + bytes(99), "rosbag fix"),
    "cut.bag": (b"#ROSBAG V2.0\n" + bytes(50), "the bag cannot be read"),
    "noise.bin": (bytes(range(256)) * 20, "unknown format"),
    "prose.txt": (b"dear reader,\nthis is a letter, not a log,\nyours\n", "none of its first 3 lines is a row of numbers"),
    "cut.mcap": (b"\x89MCAP0\r\n\x01\xff\xff", "mcap recover"),
    "cut.ulg": (b"ULog\x01\x12\x35\x01" + bytes(3), "not a readable ULog"),
    "cut.blf": (b"LOGG" + bytes(20), "no frame of this blf log can be read"),
    "cut.log": (b"(1.0) can0 1#zz\n", "no frame of this candump log can be read"),
    "bare.csv": (b"a,b,c\n1,2,3\n4,5,6\n", "no time column"),
    "noimu.csv": (b"t_s,speed\n" + b"".join(b"%d,3\n" % k for k in range(9)), "no IMU in the files; there are speed"),
}
ARGUMENTS = [
    (["d.csv", "--out", "d.csv"], "--out would overwrite it"),
    (["d.csv", "--out", "none/o.csv"], "none/"),
    (["d.csv", "--out", "d.csv/o.csv"], "Not a directory"),
    (["absent.csv"], "no such file"),
    (["d.csv", "d.csv"], "given twice"),
    (["others"], "neither metadata.yaml"),
    (["tables"], "tables: a folder of text tables: name those of one drive: tables/a.csv"),
    (["d.csv", "--from", "11"], "a drive is 3 s to a day long"),
    (["d.csv", "--from", "5", "--to", "4"], "--from below --to"),
    (["d.csv", "--unit", "acc_x"], "write NAME=UNIT"),
    (["d.csv", "--unit", "acc_x=furlong"], "unknown unit"),
    (["d.csv", "--offset", "imu=soon"], "write NAME=SECONDS"),
    (["d.csv", "--offset", "odom=1"], "no such channel; there are imu"),
    (["d.csv", "--vehicle", "bad.toml"], "unknown key wheels.radius"),
    (["d.csv", "--vehicle", "long.toml"], "0.01 to 10 m"),
    (["d.csv", "--dbc", "d.csv"], "not a valid DBC file"),
    (["slow.csv"], "10 Hz by the median period"),
]


class Bad(made.Case):
    def setUp(self):
        super().setUp()
        t = made.times()
        made.table(self.folder / "d.csv", t, made.imu(t))
        made.table(self.folder / "slow.csv", 5 * t, made.imu(t))
        (self.folder / "others").mkdir()
        (self.folder / "others" / "photo.jpg").write_bytes(b"\xff\xd8")
        (self.folder / "tables").mkdir()
        (self.folder / "tables" / "a.csv").touch()
        (self.folder / "bad.toml").write_text("[wheels]\nradius = 0.3\n")
        (self.folder / "long.toml").write_text("[wheels]\nradius_m = 30\n")

    def test_files_that_are_no_logs(self):
        for name, (content, words) in TEXTS.items():
            with self.subTest(name):
                (self.folder / name).write_bytes(content)
                self.refuses(name, "--out", "out.csv", says=[words])

    def test_arguments(self):
        for arguments, words in ARGUMENTS:
            with self.subTest(arguments):
                self.refuses(*arguments, *([] if "--out" in arguments else ["--out", "out.csv"]), says=[words])

    def test_damaged_bytes_never_end_in_a_traceback(self):
        t, rng = made.times(5.0), random.Random(36)
        made.mcap(self.folder / "d.mcap", made.imu_messages(t, made.imu(t)))
        made.bag1(self.folder / "d.bag", made.imu_messages(t, made.imu(t), made.STORE1))
        made.bus(self.folder / "d.blf", made.frames(5.0))
        for name in ["d.mcap", "d.bag", "d.blf", "d.csv"]:
            whole = (self.folder / name).read_bytes()
            for _ in range(60):
                damaged = bytearray(whole[: rng.randrange(1, 2 * len(whole))])
                for _ in range(rng.randrange(8)):
                    damaged[rng.randrange(len(damaged))] = rng.randrange(256)
                (self.folder / name).write_bytes(damaged)
                status, text = made.run(self.folder, "import", name)
                self.assertTrue(status == 0 or text.count("\n") == 1, (name, text))

    def test_a_wrong_suffix_does_not_matter(self):
        made.mcap(self.folder / "d.log", made.imu_messages(made.times(), made.imu(made.times())))
        self.assertEqual(made.run(self.folder, "import", "d.log")[0], 0)

    def test_either_byte_order_but_not_a_wrong_one(self):
        t, path = made.times(), self.folder / "d.mcap"
        made.mcap(path, made.imu_messages(t, made.imu(t)), made.CompressionType.NONE, little_endian=False)
        self.assertEqual(made.run(self.folder, "import", "d.mcap", "--out", "out.csv")[0], 0)
        drive = made.drive(self.folder)
        self.assertLess(abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
        stamp = int(made.START).to_bytes(4)[:3]
        path.write_bytes(path.read_bytes().replace(bytes(4) + stamp, b"\x00\x01\x00\x00" + stamp))
        self.refuses("d.mcap", "--out", "wrong.csv", says=["no IMU in the files"])

    def test_a_cut_mcap_gives_what_is_there(self):
        t = made.times()
        path = self.folder / "d.mcap"
        made.mcap(path, made.imu_messages(t, made.imu(t)))
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        status, text = made.run(self.folder, "import", "d.mcap")
        self.assertEqual(status, 0, text)
        self.assertIn("the file ends within a record", text)

    def test_the_drive_and_its_vehicle_file_are_read_again(self):
        (self.folder / "d.toml").write_text("[mounting]\nyaw_deg = 90.0\n[wheels]\nradius_m = 0.31\n")
        self.assertEqual(made.run(self.folder, "import", "d.csv", "--unit", "acc_x=m/s^2", "--out", "o.csv")[0], 0)
        text = (self.folder / "o.toml").read_text()
        written = tomllib.loads(text)
        self.assertEqual((written["mounting"]["yaw_deg"], written["recording"]["mounting"]["yaw_deg"], written["wheels"]["radius_m"]), (0.0, 90.0, 0.31))
        self.assertEqual(written["columns"], {"acc_x": {"unit": "m/s^2"}})
        self.assertEqual((written["recording"]["units"], written["recording"]["dropped"]), ({"imu": "m/s^2, rad/s"}, {}))
        self.assertEqual(made.run(self.folder, "import", "o.csv", "--out", "p.csv")[0], 0)
        self.assertEqual((self.folder / "p.csv").read_text(), (self.folder / "o.csv").read_text())

    @unittest.skipUnless(sys.platform == "linux", "reads the peak of the memory from /proc")
    def test_memory_is_bounded(self):
        """A quarter of an hour at 400 Hz, 50 MB of text, in a process of its own: little more than an import of 12 s."""
        line = "%.4f,0.1,0.2,9.81,0.0" + "0" * 40 + "1,0.0" + "0" * 40 + "2,0.001\n"
        with open(self.folder / "quarter.csv", "w") as file:
            file.write("t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z\n")
            file.writelines(line % (k / 400) for k in range(400 * 900))
        peak = []
        for name in ("d.csv", "quarter.csv"):
            code = ("import sys; from gyronet.__main__ import main; status = main(['import', sys.argv[1], '--out', 'out.csv']); "
                    "print('VmHWM', open('/proc/self/status').read().split('VmHWM:')[1].split()[0]); sys.exit(status)")
            done = subprocess.run([sys.executable, "-c", code, name], cwd=self.folder, capture_output=True, text=True, check=True,
                                  env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)})
            peak.append(int(done.stdout.split("VmHWM ")[1]) // 1024)
        self.assertLess(peak[1] - peak[0], 100, peak)

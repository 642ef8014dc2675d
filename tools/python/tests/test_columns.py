"""Tables of one's own by the vehicle file's [columns], and what the report says of them."""

import tomllib
from datetime import datetime, timezone

import asammdf
import numpy as np

import made
from made import imu, table, times

HEAD = ["ms", "ax", "ay", "az", "wx", "wy", "wz", "Yaw", "lat", "lon", "VR", "VL", "speed"]
IMU = "\n".join(f'{ours} = {{ name = "{name}", unit = "{unit}" }}' for ours, name, unit in zip(
    ["t_s", "acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z"], HEAD, ["ms"] + 3 * ["g"] + 3 * ["deg/s"])) + "\n"
REST = 'ref_gyr_z = { name = "Yaw", unit = "deg/s" }\ngnss_lat = "lat"\ngnss_lon = { name = "d.csv:lon" }\n'
WHEELS = 'wheel1_rate = { name = "VR", unit = "km/h" }\nwheel3_rate = { name = "VL", unit = "km/h" }\n'
NAMED = '[wheels]\nfront_right = "VR"\nfront_left = "VL"\n[signals]\nposition = "position"\nreference_rate = "Yaw"\n[columns]\n'
UNITS = 'gnss_lat = "lat"\ngnss_lon = "lon"\nYaw = { unit = "deg/s" }\nVR = { unit = "km/h" }\nVL = { name = "VL", unit = "km/h" }\n'
REFUSED = [
    ('gnss_latt = "lat"', "unknown key columns.gnss_latt; known are t_s, acc_x"),
    ('latitude = { name = "lat" }', "unknown key columns.latitude"),
    ('VRR = { unit = "km/h" }', "v.toml: the unit km/h of columns.VRR: no channel or column of that name"),
    ('imu = { unit = "km/h" }', "v.toml: the unit km/h of columns.imu"),
    ('VR = { unit = "furlong" }', "columns.VR: unknown unit furlong; known are s, ms"),
    ('ref_gyr_z = "RefYaw"', "d.csv: no column RefYaw, which v.toml names for ref_gyr_z; the columns are ms, ax"),
    ('temp_c = "T"', "no column T, which v.toml names for temp_c"),
    ('gnss_lat = "lat"', "v.toml names gnss_lat, but gnss_lon is missing"),
    ("gnss_lat = 3", 'columns.gnss_lat: write "NAME" or'),
    ("[signals]\nposition = 'position'", "no channel position for the position; in a table it is the columns gnss_lat and gnss_lon"),
    ("[wheels]\nfront_right = 'VR'\nfront_left = 'VL'\n[columns]\n" + IMU, "--unit VR=km/h; VL: a wheel speed without a unit"),
]


class Columns(made.Case):
    def setUp(self):
        super().setUp()
        t = times()
        rows = imu(t, rate=np.degrees(1), force=1 / 9.80665)
        fixes = [(m.latitude, m.longitude) for *_, m in made.fix_messages(t)]
        v = 3.6 * made.speed(t)
        more = np.column_stack([np.degrees(made.turn(t)), fixes, v, v, v])
        table(self.path("d.csv"), 1000 * (made.START + t), np.hstack([rows, more]), ",".join(HEAD), form="%.8f")

    def vehicle(self, text):
        self.path("v.toml").write_text(text if text.startswith("[wheels]") else "[columns]\n" + IMU + text + "\n")
        return ["d.csv", "--vehicle", "v.toml"]

    def test_every_column_of_a_drive_is_a_key(self):
        for text in (REST + WHEELS, NAMED + IMU + UNITS):
            says = ["d.csv: columns that are left out: speed\n", "radius 0.289 m is assumed (paths do not depend on it"]
            drive = self.imports(*self.vehicle(text), "--out", "out.csv", says=says)
            t = drive["t_s"]
            for name, truth in (("gyr_z", made.turn(t)), ("ref_gyr_z", made.turn(t)), ("wheel1_rate", made.speed(t) / 0.289), ("wheel3_rate", made.speed(t) / 0.289)):
                self.assertLess(np.nanmax(np.abs(drive[name] - truth)), 0.06, name)
            self.assertTrue(np.isfinite(drive["gnss_lat"]).any() and np.isfinite(drive["ref_yaw"]).any())
            # The copy beside the drive does for the log again, and the drive for itself, also if it is named.
            for log, vehicle in (("d.csv", "out.toml"), ("out.csv", "out.toml")):
                self.imports(log, "--vehicle", vehicle, "--out", "again.csv")
                for name, values in made.drive(self.folder, "again.csv").items():
                    np.testing.assert_allclose(values, drive[name], atol=2e-6, err_msg=name)
        mdf = asammdf.MDF()
        mdf.start_time = datetime.fromtimestamp(made.START, timezone.utc)
        with open(self.path("d.csv")) as file:
            rows = np.loadtxt(file, delimiter=",", skiprows=1)
        mdf.append([asammdf.Signal(rows[:, k], rows[:, 0] / 1000, name=name) for k, name in enumerate(HEAD) if k])
        mdf.save(self.path("d.mf4"))
        again = self.imports("d.mf4", *self.vehicle((REST + WHEELS).replace("d.csv:", ""))[1:], "--unit", "t_s=s", "--out", "out.csv")
        for name, values in drive.items():
            np.testing.assert_allclose(again[name], values, atol=1e-3, err_msg=name)

    def test_what_does_not_fit_is_refused_by_name(self):
        for text, words in REFUSED:
            with self.subTest(text):
                self.refuses(*self.vehicle(text), says=[words])
        self.path("other.csv").write_bytes(self.path("d.csv").read_bytes().replace(b"Yaw", b"Gier"))
        self.refuses("other.csv", *self.vehicle('ref_gyr_z = "other.csv:Yaw"'), says=["no file has a column other.csv:Yaw, which it names for ref_gyr_z"])

    def test_units_of_channels_by_flag_and_by_file(self):
        rows = imu(times(), rate=np.degrees(1), force=1 / 9.80665)
        made.mcap(self.path("d.mcap"), made.imu_messages(times(), rows))
        self.imports("d.mcap", "--unit", "/imu=g", "--unit", "/imu=deg/s", "--out", "first.csv")
        self.assertEqual(tomllib.loads(self.path("first.toml").read_text())["columns"], {"/imu": {"unit": "g, deg/s"}})
        drive = self.imports("d.mcap", "--vehicle", "first.toml", "--out", "out.csv")
        self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
        self.assertIn("[columns] is for text tables", self.imports("d.mcap", *self.vehicle(REST)[1:], "--unit", "/imu=g"))

    def test_the_report(self):
        rates = WHEELS.replace("km/h", "rad/s")
        self.imports(*self.vehicle(rates), says=["radius 0.289 m is assumed (speeds and paths scale with it)", "columns that are left out: Yaw, lat, lon, speed",
                                                 "no GNSS position (sensor_msgs/NavSatFix, columns gnss_lat and gnss_lon) and no reference"])
        said = self.imports(*self.vehicle(REST), "--from", "5", "--to", "9", says=["imu: imu, m/s^2, rad/s, 50.0 Hz, 0.00 to 4.00 s"])
        self.assertNotIn("radius", said)
        said = self.imports(*self.vehicle('gnss_lat = "lat"\ngnss_lon = "lon"'), "--to", "4", says=["no course: it stands", "no course and no reference"])
        self.assertNotIn("no GNSS", said)
        self.refuses(*self.vehicle(REST), "--from", "500", says=["--from 500 is after the end, 12.0 s"])

    def test_channels_that_are_not_chosen(self):
        twice = np.where(np.arange(600) % 10 == 5, times() - 0.02, times())
        both = [*made.imu_messages(times(), imu(times())), *made.imu_messages(twice, imu(times()), topic="/imu2"), *made.odometry_messages(times(hz=10.0))]
        made.mcap(self.path("d.mcap"), [*both, *((("/odom2"), *message[1:]) for message in made.odometry_messages(times(hz=10.0)))])
        self.refuses("d.mcap", says=["several channels fit as imu", "; several channels fit as odometry", "/odom2"])
        self.imports("d.mcap", "--imu", "/imu", "--odometry", "/odom", says=[" 0 records dropped\n", "60 records that this drive does not need: /imu2: stamps"])

    def test_files_that_would_be_overwritten(self):
        arguments = self.vehicle(REST)
        self.refuses(*arguments, "--out", "v.csv", says=["v.toml: --out v.csv would overwrite this vehicle file"])
        self.path("own.toml").write_text("[wheels]\nradius_m = 0.3\n")
        self.refuses(*arguments, "--out", "own.csv", says=["own.toml: --out own.csv would overwrite this vehicle file"])
        self.refuses(*arguments, "--out", "d.csv", says=["d.csv: --out would overwrite it, a log of this import"])
        for _ in range(2):
            self.imports(*arguments, "--out", "out.csv")

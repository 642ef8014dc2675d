"""What people met elsewhere, by the numbers of the cases: imported right, or refused with the reason and the remedy."""

import gzip
import math
from datetime import datetime, timezone

import can
import numpy as np

import made
from made import START, VEHICLE, Case, bus, dbc, frames, imu, table, times

SAME = ["--same-clock", "--vehicle", "v.toml", "--out", "out.csv"]


class OfADrive(Case):
    def test_courses_references_and_temperature_stay(self):
        t = times(hz=100.0)
        rows = imu(t, rate=180 / math.pi)
        known = np.arange(len(t)) % 100 == 0
        course = np.degrees(np.mod(-0.3 * t, 2 * math.pi))
        more = {"course": course, "course_sigma": 0 * t + 2.0, "gnss_speed": made.speed(t), "ref_yaw": 0.3 * t, "temp_c": 20 + t}
        lines = [",".join(["t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z", *more])]
        for k, has in enumerate(known):
            rest = [f"{values[k]:.6f}" if has else "" for values in more.values()]
            lines.append(",".join([f"{t[k]:.2f}", *(f"{value:.6f}" for value in rows[k]), *rest]))
        self.path("deg.csv").write_text("\n".join(lines) + "\n")
        drive = self.imports("deg.csv", "--unit", "imu=deg/s", "--unit", "course=deg", "--unit", "course_sigma=deg", "--from", "2", "--out", "out.csv",
                             says=["columns that stay as they are: ref_yaw, gnss_speed, course, course_sigma, temp_c"])
        for name, truth in more.items():
            found, scale = np.flatnonzero(np.isfinite(drive[name])), math.pi / 180 if name.startswith("course") else 1.0
            self.assertEqual(found.tolist(), list(range(0, 1000, 100)), name)
            np.testing.assert_allclose(drive[name][found], scale * truth[200::100], atol=2e-6, err_msg=name)
        self.assertLess(np.abs(drive["gyr_z"] - made.turn(t[200:])).max(), 0.02)


class OnTheBus(Case):
    def setUp(self):
        super().setUp()
        t = times()
        table(self.path("imu.csv"), START + t, imu(t))
        self.path("v.toml").write_text(VEHICLE)
        dbc(self.path("car.dbc"))

    def reference(self, unit, *more):
        dbc(self.path("car.dbc"), 0x101, name="ESP", signals=[f' SG_ Gierrate : 0|16@1- (0.01,0) [-300|300] "{unit}" ESP'])
        self.path("v.toml").write_text("[signals]\nreference_rate = 'ESP.Gierrate'\n[bus]\ndbc = 'car.dbc'\n")
        bus(self.path("bus.log"), frames(identifier=0x101, data=lambda t: int(round(100 * math.degrees(made.turn(t)))).to_bytes(8, "little", signed=True)))
        return ["imu.csv", "bus.log", *SAME, *more]

    def test_01_units_of_a_yaw_rate(self):
        for unit in ("Unit_DegreOfArcPerSecon", "Unit_DegreePerSecond", "Grad/sec", "deg/s", "°/s"):
            drive = self.imports(*self.reference(unit))
            self.assertLess(np.nanmax(np.abs(drive["ref_gyr_z"] - made.turn(drive["t_s"]))), 5e-3, unit)
        self.refuses(*self.reference("Furlong"), says=['ESP.Gierrate: the unit "Furlong" is not known', "--unit ESP.Gierrate=deg/s"])
        self.refuses(*self.reference(""), says=["without a unit; give it: --unit ESP.Gierrate="])
        drive = self.imports(*self.reference("Furlong", "--unit", "ESP.Gierrate=deg/s"))
        self.assertLess(np.nanmax(np.abs(drive["ref_gyr_z"] - made.turn(drive["t_s"]))), 5e-3)
        self.refuses(*self.reference("deg/s", "--unit", "ESP.Gier=deg/s"), says=["no channel or column of that name"])

    def test_03_units_of_a_wheel(self):
        bus(self.path("bus.log"), frames())
        for unit in ("km^h", "Unit_KiloMeterPerHour", "kph"):
            dbc(self.path("car.dbc"), unit=unit)
            self.has_wheels(self.imports("imu.csv", "bus.log", *SAME))
        dbc(self.path("car.dbc"), unit="knots")
        self.refuses("imu.csv", "bus.log", *SAME, says=['the unit "knots"', "--unit WHEELS.FR=km/h"])
        flags = [f for wheel in made.WHEELS for f in ("--unit", f"WHEELS.{wheel}=km/h")]
        self.has_wheels(self.imports("imu.csv", "bus.log", *SAME, *flags))

    def test_05_a_second_level_of_multiplexers(self):
        signals = [" SG_ Group M : 0|4@1+ (1,0) [0|15] \"\" ESP", " SG_ Page m2M : 4|4@1+ (1,0) [0|15] \"\" ESP",
                   ' SG_ RL m1 : 8|16@1+ (0.01,0) [0|655] "km/h" ESP', ' SG_ RR m1 : 24|16@1+ (0.01,0) [0|655] "km/h" ESP',
                   ' SG_ Trip m3 : 8|32@1+ (1,0) [0|0] "m" ESP']
        extra = ("SG_MUL_VAL_ 1200 Page Group 2-2;\nSG_MUL_VAL_ 1200 RL Page 1-1;\nSG_MUL_VAL_ 1200 RR Page 1-1;\n"
                 "SG_MUL_VAL_ 1200 Trip Group 1-1, 3-3;\n")
        dbc(self.path("car.dbc"), signals=signals, extra=extra)
        page = frames(data=lambda t: b"\x12" + made.wheel_data(t)[:4] + b"\0\0\0")
        trip = frames(start=START + 0.005, data=lambda t: b"\x01\x40\xe2\x01\0\0\0\0")
        bus(self.path("bus.log"), sorted(page + trip, key=lambda message: message.timestamp))
        self.path("v.toml").write_text("[wheels]\nradius_m = 0.3\nrear_left = 'WHEELS.RL'\nrear_right = 'WHEELS.RR'\n[bus]\ndbc = 'car.dbc'\n")
        self.assertLess(np.nanmax(self.imports("imu.csv", "bus.log", *SAME)["wheel4_rate"]), 40)

    def test_07_08_identifiers(self):
        for identifier, sent, extra in ((0x10630040, 0x10630040, ""), (0x98FE6EFE, 0x18FE6E0B, "")):
            dbc(self.path("car.dbc"), identifier, extra=extra)
            bus(self.path("bus.log"), frames(identifier=sent, extended=True))
            self.has_wheels(self.imports("imu.csv", "bus.log", *SAME))
        dbc(self.path("car.dbc"), 0x98FE6E01, extra='BA_DEF_ "ProtocolType" STRING ;\nBA_DEF_DEF_ "ProtocolType" "";\nBA_ "ProtocolType" "J1939";\n')
        self.has_wheels(self.imports("imu.csv", "bus.log", *SAME))
        dbc(self.path("car.dbc"), 0x98FE6E01)
        self.refuses("imu.csv", "bus.log", *SAME, says=["no frame 18FE6E01 of WHEELS", "passed over: 18FE6E0B (300)"])

    def test_10_error_codes_are_no_speed(self):
        extra = "".join(f'VAL_ 1200 {wheel} 65533 "Unterspannung" 65534 "Init" 65535 "Fehler" 0 "Stillstand" ;\n' for wheel in made.WHEELS)
        dbc(self.path("car.dbc"), extra=extra)
        bus(self.path("bus.log"), frames(data=lambda t: b"\xfe\xff" * 4 if t < 1 else b"\xff" * 8 if 6 < t < 7 else made.wheel_data(t)))
        drive = self.imports("imu.csv", "bus.log", *SAME, says=["WHEELS.FL: marked as no value (Init)", "(Fehler)"])
        self.assertLess(np.nanmax(drive["wheel1_rate"]), 40)
        self.assertTrue(np.isnan(drive["wheel1_rate"][630:690]).all() and drive["wheel1_rate"][200] == 0)

    def test_13_long_names(self):
        long = ["Vehicle_Dynamics_Wheel_Speed_Sensor_Rear_Left", "Vehicle_Dynamics_Wheel_Speed_Sensor_Rear_Right"]
        signals = [f' SG_ {name[:27]}_{k:04} : {16 * k}|16@1+ (0.01,0) [0|655] "km/h" ESP' for k, name in enumerate(long)]
        extra = 'BA_DEF_ SG_ "SystemSignalLongSymbol" STRING ;\nBA_DEF_DEF_ "SystemSignalLongSymbol" "";\n' + "".join(
            f'BA_ "SystemSignalLongSymbol" SG_ 1200 {name[:27]}_{k:04} "{name}";\n' for k, name in enumerate(long))
        dbc(self.path("car.dbc"), signals=signals, extra=extra)
        bus(self.path("bus.log"), frames())
        self.path("v.toml").write_text(f"[wheels]\nradius_m = 0.3\nrear_left = 'WHEELS.{long[0]}'\nrear_right = 'WHEELS.{long[1]}'\n[bus]\ndbc = 'car.dbc'\n")
        self.assertIn("wheel4_rate", self.imports("imu.csv", "bus.log", *SAME))

    def test_14_the_second_interface_is_apart(self):
        other = frames(start=START + 0.004, channel="can1", data=lambda t: bytes([0x10, 0x27] * 4))
        bus(self.path("bus.log"), sorted(frames(channel="can0") + other, key=lambda message: message.timestamp))
        self.has_wheels(self.imports("imu.csv", "bus.log", *SAME))
        self.path("v.toml").write_text(VEHICLE.replace("WHEELS.RL", "WHEELS.RL@can1"))
        self.assertAlmostEqual(self.imports("imu.csv", "bus.log", *SAME)["wheel4_rate"][800], 100 / 3.6 / 0.3, 3)

    def test_15_18_19_20_21_lines_of_other_tools(self):
        def hex_(message):
            return " ".join(f"{byte:02X}" for byte in message.data)
        lines = {
            "bus.log": [f" (2023-11-14 22:13:{20 + t:09.6f})  can0  4B0   [8]  {hex_(m)}" for m, t in zip(frames(), times(hz=25.0))],
            "bus.asc": ["date Thu Sep 2 09:37:49 am 2021", "base hex timestamps absolute", "internal events logged"]
                       + [f"   {m.timestamp:.6f} 1  4B0          Rx   d 8 {hex_(m)}" for m in frames()],
            "bus.trc": [";####", ";   CAN activities imported from drive.blf", ";   Start time: 18.12.2021 14:28:07.062", ";   PCAN-Net: N/A",
                        ";    |       +time offset of message (ms)", ";----+-   ---+---  ----+---  +  -+ -- -- ..."]
                       + [f"{k + 1:6}) {1000 * t:9.0f}      04B0  8  {hex_(m)} " for k, (m, t) in enumerate(zip(frames(), times(hz=25.0)))]}
        for name, text in lines.items():
            self.path(name).write_text("\n".join(text) + "\n")
            t = times()
            table(self.path("imu.csv"), t if name.endswith("trc") else START + t, imu(t))
            self.has_wheels(self.imports("imu.csv", name, *SAME))
            self.path("packed.gz").write_bytes(gzip.compress(self.path(name).read_bytes()))
            self.refuses("imu.csv", "packed.gz", *SAME, says=["compressed by gzip; unpack it first: gunzip FILE"])
        self.path("bus.asc").write_text(self.path("bus.asc").read_text().replace(" 4B0 ", " WHEELS "))
        self.refuses("imu.csv", "bus.asc", *SAME, says=["no frame of this asc log", "names of messages in place of identifiers", "export them as numbers"])

    def test_the_formats_of_python_can(self):
        table(self.path("imu.csv"), START + times(), imu(times()))
        for name in ("bus.blf", "bus.log", "bus.mf4"):
            bus(self.path(name), frames())
            self.has_wheels(self.imports("imu.csv", name, *SAME))
        fd = [can.Message(m.timestamp, 0x4B0, False, is_fd=True, channel=0, data=m.data + bytes(56)) for m in frames()]
        bus(self.path("fd.blf"), fd)
        self.has_wheels(self.imports("imu.csv", "fd.blf", *SAME))

    def test_62_two_clocks_are_laid_on_each_other(self):
        t = times(80.0)
        table(self.path("imu.csv"), 5000 + t, imu(t))
        bus(self.path("bus.log"), frames(80.0))
        drive = self.imports("imu.csv", "bus.log", "--vehicle", "v.toml", "--out", "out.csv", says=["clock moved by -16999"])
        start = float(self.path("out.toml").read_text().split("start = ")[1].split()[0])
        self.assertLess(abs(start - START), 0.005)
        truth = (made.speed(drive["t_s"]) + 0.75 * made.turn(drive["t_s"])) / 0.3
        self.assertLess(np.nanmax(np.abs(drive["wheel1_rate"] - truth)[500:7500]), 0.2)
        self.refuses("imu.csv", "bus.log", *SAME, says=["does not overlap", "imu spans 5000.00"])


class InBags(Case):
    def test_24_frames_in_a_bag(self):
        dbc(self.path("car.dbc"))
        self.path("v.toml").write_text(VEHICLE)
        sent = [("/can0", "can_msgs/msg/Frame", m.timestamp, made.build(made.STORE, "can_msgs/msg/Frame", m.timestamp, id=0x4B0, dlc=8,
                 data=np.frombuffer(bytes(m.data), np.uint8))) for m in frames()]
        made.mcap(self.path("d.mcap"), [*made.imu_messages(times(), imu(times())), *sent])
        self.has_wheels(self.imports("d.mcap", "--vehicle", "v.toml", "--out", "out.csv"))

    def test_25_57_split_bags_and_the_start(self):
        t = times()
        for k in range(3):
            made.mcap(self.path(f"drive_{k}.mcap"), made.imu_messages(t[200 * k : 200 * k + 200], imu(t)[200 * k : 200 * k + 200]))
        for files in (["drive_2.mcap", "drive_0.mcap", "drive_1.mcap"], ["."]):
            drive = self.imports(*files, "--out", "out.csv", says=["start = 1700000000.0", "goes on where"])
            self.assertEqual(len(drive["t_s"]), 1199)
        self.assertIn("start = 1700000000.0", self.path("out.toml").read_text())

    def test_27_35_stamps(self):
        t, recorded = times(), START + times()
        odometry = list(made.odometry_messages(times(hz=10.0)))
        made.mcap(self.path("up.mcap"), [*made.imu_messages(t, imu(t), start=5000.25, recorded=recorded), *odometry])
        self.refuses("up.mcap", "--out", "out.csv", says=["/odom does not overlap with /imu", "5000.25", "--odometry none", "--stamps recorded"])
        self.assertIn("wheel2_rate", self.imports("up.mcap", "--stamps", "recorded", "--out", "out.csv"))
        back = np.where(t < 6, t, t - 60)
        twice = np.where(np.arange(len(t)) == 100, t[99], t)
        made.mcap(self.path("twice.mcap"), made.imu_messages(twice, imu(t), recorded=recorded))
        self.imports("twice.mcap", says=["dropped 1: twice.mcap: /imu: stamps that stand still, first at 1.98 s"])
        made.mcap(self.path("back.mcap"), made.imu_messages(back, imu(t), recorded=recorded))
        self.refuses("back.mcap", "--out", "out.csv", says=["step back by", "at 5.98 s", "300 of 600 samples are lost", "--to 5.98"])
        self.assertEqual(len(self.imports("back.mcap", "--to", "5.9", "--out", "out.csv")["t_s"]), 591)
        self.assertEqual(len(self.imports("back.mcap", "--stamps", "recorded", "--from", "2", "--out", "out.csv")["t_s"]), 999)

    def test_29_30_what_the_sources_say_of_each_other(self):
        t = times(80.0)
        made.mcap(self.path("gps.mcap"), [*made.imu_messages(t, imu(t)), *made.fix_messages(times(80.0, 5.0), START + 18)])
        text = self.imports("gps.mcap", says=["GPS time against UTC?"])
        self.assertRegex(text, r"--offset /fix=-1[78]\.")
        self.assertNotIn("warning", self.imports("gps.mcap", "--offset", "/fix=-18"))
        made.mcap(self.path("deg.mcap"), [*made.imu_messages(t, imu(t, rate=57.2958)), *made.odometry_messages(times(80.0, 10.0))])
        self.refuses("deg.mcap", "--out", "out.csv", says=["degrees per second? --unit /imu=deg/s"])
        drive = self.imports("deg.mcap", "--unit", "/imu=deg/s", "--out", "out.csv")
        self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
        made.mcap(self.path("g.mcap"), made.imu_messages(t, imu(t, force=1 / 9.80665)))
        self.refuses("g.mcap", says=["the specific force is 1.00", "--unit /imu=g"])
        self.refuses("g.mcap", "--unit", "/imu=g", "--unit", "/imu=km/h", says=["--unit /imu=km/h: no channel", "with such a unit"])
        made.mcap(self.path("kmh.mcap"), [*made.imu_messages(t, imu(t)), *made.odometry_messages(times(80.0, 10.0))])
        wheels = [self.imports("kmh.mcap", *flags, "--out", "out.csv")["wheel2_rate"] for flags in ([], ["--unit", "/odom=km/h"])]
        np.testing.assert_allclose(3.6 * wheels[1], wheels[0], atol=3e-6)

    def test_31_33_halves_of_an_imu(self):
        t, rows = times(), imu(times())
        gyro, accel = rows * [0, 0, 0, 1, 1, 1], rows * [1, 1, 1, 0, 0, 0]
        made.mcap(self.path("two.mcap"), [*made.imu_messages(t, gyro, topic="/gyro"), *made.imu_messages(t + 0.003, accel, topic="/accel")])
        drive = self.imports("two.mcap", "--out", "out.csv")
        self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
        self.assertLess(np.abs(drive["acc_z"] - 9.81).max(), 0.03)
        self.imports("two.mcap", "--imu", "/gyro+/accel", "--out", "out.csv")
        self.refuses("two.mcap", "--imu", "/gyro", says=["/gyro has no accelerometer", "/accel", "--imu GYRO+ACCEL"])
        made.mcap(self.path("none.mcap"), made.imu_messages(t, rows, angular_velocity_covariance=np.array([-1.0] + [0.0] * 8)))
        self.refuses("none.mcap", says=["no gyro in the files", "600 sensor_msgs/msg/Imu of /imu without angular rate (covariance -1)"])

    def test_32_bursts(self):
        t = times(hz=100.0)
        burst = np.floor(t * 10) / 10 + 0.1 + 1e-4 * (np.arange(len(t)) % 10)
        made.mcap(self.path("b.mcap"), made.imu_messages(burst, imu(t)))
        drive = self.imports("b.mcap", "--out", "out.csv", says=["bursts of 10 every 0.100 s from 0.00 s on"])
        self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
        self.assertIn("100.0 Hz, 0.00 to 11.99 s", self.imports("b.mcap"))

    def test_37_joints_without_velocity(self):
        angle = np.cumsum(made.speed(times()) / 0.3) / 50
        self.path("v.toml").write_text("[wheels]\nradius_m = 0.3\nrear_left = '/joints/rl'\nrear_right = '/joints/rr'\n")
        for field, values in (("velocity", made.speed(times()) / 0.3), ("position", angle)):
            joints = [("/joints", "sensor_msgs/msg/JointState", START + s, made.build(made.STORE, "sensor_msgs/msg/JointState", START + s,
                       name=["rl", "rr"], **{field: np.array([v, v])})) for s, v in zip(times(), values)]
            made.mcap(self.path(f"{field}.mcap"), [*made.imu_messages(times(), imu(times())), *joints])
        drive = self.imports("velocity.mcap", "--vehicle", "v.toml", "--out", "out.csv")
        self.assertLess(np.nanmax(np.abs(drive["wheel4_rate"] - made.speed(drive["t_s"]) / 0.3)), 0.2)
        self.refuses("position.mcap", "--vehicle", "v.toml", says=["no channel /joints/rr", "positions only (record velocities"])

    def test_the_bags_of_rosbags(self):
        for name, write in (("one.bag", made.bag1), ("lite", made.bag2), ("cap", lambda p, m: made.bag2(p, m, "mcap")),
                            ("zst", lambda p, m: made.bag2(p, m, compress="FILE")), ("msg", lambda p, m: made.bag2(p, m, compress="MESSAGE"))):
            store = made.STORE1 if name == "one.bag" else made.STORE
            write(self.path(name), [*made.imu_messages(times(), imu(times()), store), *made.odometry_messages(times(hz=10.0), store)])
            drive = self.imports(name, "--out", "out.csv")
            self.assertEqual(len(drive["t_s"]), 1199)
            self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
        # 38: without metadata.yaml the file itself still is a database.
        lone = next(self.path("lite").glob("*.db3"))
        lone.rename(self.path("lone.db3"))
        self.assertEqual(len(self.imports("lone.db3", "--out", "out.csv")["t_s"]), 1199)
        self.path("lone.db3").write_bytes(b"SQLite format 3\0" + bytes(100))
        self.refuses("lone.db3", says=["ros2 bag reindex FOLDER"])


class InULogs(Case):
    # Down and to the right, as PX4 has it; gyro first.
    COMBINED = (["float[3] gyro_rad", "float[3] accelerometer_m_s2"], times(8.0, 100.0),
                np.roll(imu(times(8.0, 100.0)), 3, axis=1) * np.array([1, -1, -1, 1, -1, -1]))
    FIX = ["int32_t lat", "int32_t lon", "float eph", "uint8_t fix_type"]

    def test_39_40_old_and_damaged(self):
        for more in ({"version": 0}, {"rubbish_at": 400}):
            made.ulog(self.path("l.ulg"), {"sensor_combined": self.COMBINED}, **more)
            drive = self.imports("l.ulg", "--out", "out.csv", says=["damaged"] if "rubbish_at" in more else [])
            self.assertGreater(len(drive["t_s"]), 740)
            self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
        made.ulog(self.path("l.ulg"), {"sensor_combined": self.COMBINED}, rubbish_at=400, rubbish=b"\xff" * 37)
        self.assertEqual(len(self.imports("l.ulg", "--out", "out.csv", says=["damaged or truncated: the last record, at byte"])["t_s"]), 401)

    def test_41_gyro_and_accelerometer(self):
        fields, t, rows = self.COMBINED
        three = ["float x", "float y", "float z"]
        made.ulog(self.path("l.ulg"), {"sensor_gyro": (three, t, rows[:, :3]), "sensor_accel": (three, t, rows[:, 3:])})
        self.assertLess(np.abs(self.imports("l.ulg", "--out", "out.csv")["acc_z"] - 9.81).max(), 0.03)

    def test_64_two_positions(self):
        fix = (self.FIX, times(8.0, 5.0), [(500_000_000, 80_000_000, 1.0, 3)] * 40)
        made.ulog(self.path("l.ulg"), {"sensor_combined": self.COMBINED, "sensor_gps": fix, "vehicle_gps_position": fix})
        self.imports("l.ulg", says=["vehicle_gps_position is taken, not sensor_gps"])


class InTables(Case):
    def test_42_43_50_headers_and_numbers(self):
        t, rows = times(), imu(times())
        axes = "".join(f",w_RS_S_{a} [rad s^-1]" for a in "xyz") + "".join(f",a_RS_S_{a} [m s^-2]" for a in "xyz")
        euroc = "#timestamp [ns]" + axes + "\n" + "".join(
            f"{1403636579758555392 + round(s * 1e9)}," + ",".join("%.5f" % v for v in np.roll(row, 3)) + "\n" for s, row in zip(t, rows))
        self.path("data.csv").write_text(euroc)
        self.path("v.toml").write_text("[columns]\nt_s = { name = '#timestamp [ns]' }\n" + "".join(
            f"gyr_{a} = {{ name = 'w_RS_S_{a} [rad s^-1]' }}\nacc_{a} = {{ name = 'a_RS_S_{a}' }}\n" for a in "xyz"))
        comma = self.path("comma.csv")
        table(comma, t, rows, "t_s;acc_x;acc_y;acc_z;gyr_x;gyr_y;gyr_z", ";")
        comma.write_text(comma.read_text().replace(".", ","))
        self.path("d.gcsv").write_text("GYROFLOW IMU LOG\nversion,1.3\ntscale,0.001\ngscale,0.001\nascale,0.001\nt,gx,gy,gz,ax,ay,az\n0,0,0,0,0,0,1000\n")
        self.refuses("d.gcsv", says=["a Gyroflow log", "write a table in SI, headed t_s,acc_x"])
        for arguments, says in ((["data.csv", "--vehicle", "v.toml"], "start = 1403636579.758"), (["comma.csv"], "imu: imu")):
            drive = self.imports(*arguments, "--out", "out.csv", says=[says])
            self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
            self.assertLess(np.abs(drive["acc_z"] - 9.81).max(), 0.05)

    def test_stamps_that_are_dates(self):
        t = times()
        table(self.path("d.csv"), t, imu(t))
        lines = self.path("d.csv").read_text().splitlines()
        for zone, first in (("Z", START), ("+02:00", START - 7200), ("", START)):
            dates = [datetime.fromtimestamp(START + s, timezone.utc).replace(tzinfo=None).isoformat() + zone for s in t]
            self.path("d.csv").write_text("\n".join([lines[0], *(f"{date},{line.partition(',')[2]}" for date, line in zip(dates, lines[1:]))]) + "\n")
            drive = self.imports("d.csv", "--out", "out.csv", says=[f"start = {first:.6f}"])
            self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)

    def test_rows_that_do_not_fit(self):
        t = times()
        table(self.path("d.csv"), t, imu(t))
        lines = self.path("d.csv").read_text().splitlines()
        for at, row in ((100, lines[100] + ",7,8"), (200, lines[200] + ","), (300, lines[300] + ",9"), (400, lines[400].rsplit(",", 2)[0]),
                        (500, "nan" + lines[500][8:]), (510, ""), (520, "dear reader,hello")):
            lines[at] = row
        self.path("d.csv").write_text("\n".join(lines) + "\n")
        drive = self.imports("d.csv", "--out", "out.csv", says=["dropped 2: d.csv: rows without a time", "dropped 2: d.csv: rows that are longer than the header",
                                                              "dropped 1: d.csv: imu: not a finite number"])
        self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)

    def test_45_54_tables_that_are_refused(self):
        t = times()
        table(self.path("bare.csv"), t, imu(t))
        self.path("bare.csv").write_text(self.path("bare.csv").read_text().partition("\n")[2])
        self.refuses("bare.csv", says=["no header: line 1 has numbers"])
        table(self.path("lat.csv"), t, np.column_stack([imu(t), 5e8 + 0 * t, 8e7 + 0 * t]), "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,latitude,longitude")
        self.refuses("lat.csv", says=["latitude 5e+08", "--unit latitude=1e-7deg"])
        self.imports("lat.csv", "--unit", "latitude=1e-7deg", "--unit", "longitude=1e-7deg", says=["no course"])

    def test_46_two_files_with_the_same_columns(self):
        t = times()
        for name, part in (("Gyroscope.csv", slice(3, 6)), ("Accelerometer.csv", slice(0, 3))):
            table(self.path(name), t, imu(t)[:, part][:, ::-1], "seconds_elapsed,z,y,x")
        head = "[columns]\nt_s = { name = 'seconds_elapsed' }\n"
        self.path("v.toml").write_text(head + "".join(f"gyr_{a} = {{ name = '{a}' }}\n" for a in "xyz"))
        both = ["Gyroscope.csv", "Accelerometer.csv", "--same-clock", "--vehicle", "v.toml"]
        self.refuses(*both, says=['acc_x = { name = "Accelerometer.csv:x" }'])
        self.path("v.toml").write_text(head + "".join(
            f"gyr_{a} = {{ name = 'Gyroscope.csv:{a}' }}\nacc_{a} = {{ name = 'Accelerometer.csv:{a}' }}\n" for a in "xyz"))
        drive = self.imports(*both, "--out", "out.csv")
        self.assertLess(np.abs(drive["acc_z"] - 9.81).max(), 0.03)
        self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)

    def test_47_49_counters_without_a_rate(self):
        head = "// General information:\n//  MT Manager version: 2022.2.0\nPacketCounter\tSampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z"
        lines = [f"{(65_300 + k) % 65_536}\tNaN\t" + "\t".join("%.5f" % v for v in row) for k, row in enumerate(imu(times(hz=100.0)))]
        self.path("MT.txt").write_text("\n".join([head, *lines]) + "\n")
        self.refuses("MT.txt", says=["PacketCounter counts samples", "--rate HZ"])
        drive = self.imports("MT.txt", "--rate", "100", "--out", "out.csv")
        self.assertLess(np.abs(drive["gyr_z"] - made.turn(drive["t_s"])).max(), 0.03)
        self.path("v.toml").write_text("[columns]\nt_s = { name = 'PacketCounter', unit = 'ms' }\n")
        self.refuses("MT.txt", "--vehicle", "v.toml", says=["counts samples and is no time"])

"""The channels of a drive: by kind where one fits, by name where several do."""

from pathlib import Path

from gyronet.vehicle import WHEEL_COLUMNS, WHEELS
from gyronet.refused import Refused, listed

# Of these two only the first is a drive's: every PX4 log since 1.13 has both.
PREFERRED = ("vehicle_gps_position", "sensor_gps")


class Files:
    def __init__(self, logs, bus):
        self.logs, self.bus = logs, bus
        self.notes = []
        self.all = [(file, channel) for file, log in enumerate(logs) for channel in log.channels.values()]

    def of(self, *kinds):
        return [(file, channel) for file, channel in self.all if channel.kind in kinds]

    def label(self, file, channel):
        same = sum(other.name == channel.name for _, other in self.all) > 1
        return f"{Path(self.logs[file].path).name}:{channel.name}" if same else channel.name

    def listed(self, channels):
        return listed([f"{self.label(file, channel)} {str(channel)[len(channel.name):].strip()}" for file, channel in channels])

    def passed(self):
        """What was passed over and dropped, for an error."""
        passed = [f"{count} {kind}" for log in self.logs for kind, count in log.passed.most_common(6) if count]
        dropped = [f"{count} {reason}" for log in self.logs for reason, count in log.dropped.most_common(3)]
        return listed(passed, "; passed over: ", 6) + listed(dropped, "; dropped: ", 6)

    def named(self, role, name, kinds):
        """The channel of a name, NAME or FILE:NAME."""
        found = [(file, channel) for file, channel in self.of(*kinds)
                 if name in (channel.name, f"{Path(self.logs[file].path).name}:{channel.name}")]
        if len(found) > 1:
            raise Refused(f"several files have {name}: write FILE:{name}" + self.listed(found))
        if found:
            return found[0]
        why = self.bus.missing(name.partition(":")[2] or name) if self.bus.path else ""
        if kinds == ("position",) and any(log.columns for log in self.logs):
            why += "; in a table it is the columns gnss_lat and gnss_lon, which [columns] of a vehicle file can name"
        others = self.of(*kinds)
        seen = sorted(set(self.bus.candidates())) if kinds != ("imu",) and self.bus.path else []
        raise Refused(f"no channel {name} for {role}{why}" + (self.listed(others) or listed(seen)) + ("" if why else self.passed()))

    def one(self, kind, name):
        """The only channel of a kind, or the one of a name."""
        if name:
            return None if name == "none" else self.named(f"the {kind}", name, (kind,))
        found = self.of(kind)
        names = [channel.name for _, channel in found]
        if len(found) == 2 and sorted(names) == sorted(PREFERRED):
            self.notes.append(f"{kind}: {PREFERRED[0]} is taken, not {PREFERRED[1]} (--{kind} {PREFERRED[1]} takes the other)")
            found = [entry for entry in found if entry[1].name == PREFERRED[0]]
        if len(found) > 1:
            raise Refused(f"several channels fit as {kind}: name one in the vehicle file or with --{kind}" + self.listed(found))
        return found[0] if found else None

    def imu(self, name):
        """Gyro and accelerometer: the same channel twice, or one of each, as --imu GYRO+ACCEL names them."""
        if name and "+" in name:
            gyro, accel = (part.strip() for part in name.split("+", 1))
            return self.named("the gyro", gyro, ("gyro", "imu")), self.named("the accelerometer", accel, ("accel", "imu"))
        if name:
            found = self.named("imu", name, ("imu", "gyro", "accel"))
            if found[1].kind != "imu":
                other = "accel" if found[1].kind == "gyro" else "gyro"
                raise Refused(f"{name} has no {'accelerometer' if other == 'accel' else 'gyro'} (it is zero or absent throughout): "
                              f"--imu GYRO+ACCEL joins two channels" + self.listed(self.of(other, "imu")))
            return found, found
        found = self.one("imu", None)
        if found:
            return found, found
        gyros, accels = self.of("gyro"), self.of("accel")
        if len(gyros) == 1 and len(accels) == 1:
            return gyros[0], accels[0]
        if gyros and accels:
            raise Refused("several gyros or accelerometers: name two with --imu GYRO+ACCEL; the columns of two tables are named apart as "
                          "FILE:COLUMN in the vehicle file" + self.listed(gyros + accels))
        if len(gyros) > 1 or len(accels) > 1:
            raise Refused("no gyro and accelerometer apart; name the columns of each file in the vehicle file, such as "
                          '[columns] acc_x = { name = "Accelerometer.csv:x" }' + self.listed(gyros + accels))
        lacks = "no gyro in the files" if accels else "no accelerometer in the files" if gyros else "no IMU in the files"
        raise Refused(lacks + self.listed(self.all) + self.passed())

    def wheels(self, vehicle):
        names, have = [vehicle.wheels[wheel] for wheel in WHEELS], {channel.name for _, channel in self.of("number")}
        named = [column for column in WHEEL_COLUMNS if vehicle.column(column) or not any(names)]
        names = [name or (column if column in have and column in named else None) for name, column in zip(names, WHEEL_COLUMNS)]
        return [self.named("a wheel", name, ("number",)) if name else None for name in names]

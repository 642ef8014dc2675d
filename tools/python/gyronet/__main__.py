"""The command `gyronet-logs`: import, correct, and wheels from-dbc. Exit status 1: refused, with the reason on standard error."""

import argparse
import json
import logging
import os
import sys
from pathlib import Path

from gyronet.refused import Refused


def parser():
    top = argparse.ArgumentParser(
        prog=os.environ.get("GYRONET_COMMAND", "gyronet-logs"),
        description="Make a drive for gyronet of logs of other tools, and wheel settings of a DBC file.",
    )
    commands = top.add_subparsers(dest="command", required=True)
    log = commands.add_parser(
        "import",
        help="convert logs to one drive",
        description=(
            "Convert logs to one drive, a CSV file at 100 Hz: ROS 1 and 2 bags (folders, SQLite, MCAP, split,"
            " compressed), PX4 ULog, MDF, candump, Vector ASC and BLF, PEAK TRC, Xsens MT text, EuRoC, CSV. A vehicle"
            " file holds what a log does not contain; a copy is written beside the drive."
        ),
    )
    log.add_argument("--out", metavar="FILE.csv", help="write the drive to this file")
    add_log_arguments(log)
    bag = commands.add_parser(
        "correct",
        help="copy a bag with the yaw rate that the board computes",
        description=(
            "Copy a ROS 1 or 2 bag or an MCAP file. In the gyro's topic the angular velocity and its covariance are those"
            " of the board; stamps, frame_id and all other messages stay as they are. The board's quality is added as"
            " diagnostic_msgs in /gyronet/quality. Messages without a corrected rate (initialising, gaps) stay as they are."
            " Further logs give wheels and references."
        ),
    )
    bag.add_argument("--out", metavar="LOG2", required=True, help="write the corrected bag to this file or folder")
    bag.add_argument("--weights", metavar="FILE.blob", help="weight file [default: the library's model]")
    bag.add_argument("--calibration", metavar="FILE.json", help="calibration file of `gyronet calibrate`")
    add_log_arguments(bag)
    wheels = commands.add_parser("wheels", help="wheel settings of a vehicle").add_subparsers(dest="action", required=True)
    dbc = wheels.add_parser(
        "from-dbc",
        help="create wheel settings from a DBC file",
        description=(
            "Create the settings of wheel frames from a DBC file and the names of its signals, SIGNAL or"
            " MESSAGE.SIGNAL. Without names it lists the signals that could be wheel speeds and writes nothing."
        ),
    )
    dbc.add_argument("file", metavar="FILE.dbc")
    for wheel in ("front-left", "front-right", "rear-left", "rear-right"):
        dbc.add_argument(f"--{wheel}", metavar="SIGNAL")
    dbc.add_argument("--unit", action="append", default=[], metavar="SIGNAL=UNIT", help="unit of a signal, such as RL=km/h")
    dbc.add_argument("--out", metavar="FILE.toml", help="write to this file instead of standard output")
    dbc.add_argument("--json", action="store_true", help="print settings and remarks as JSON")
    dbc.add_argument("--quiet", "-q", action="store_true", help="no remarks")
    return top


def add_log_arguments(log):
    log.add_argument("files", nargs="+", metavar="FILE", help="logs of one drive, or bag folders")
    log.add_argument(
        "--vehicle",
        metavar="FILE.toml",
        help="vehicle file [default: the first log's name with .toml, or vehicle.toml beside it]",
    )
    log.add_argument("--dbc", metavar="FILE.dbc", help="DBC file of the CAN frames")
    log.add_argument("--imu", metavar="CHANNEL", help="channel of gyro and accelerometer, or GYRO+ACCEL")
    log.add_argument("--odometry", metavar="CHANNEL", help="channel whose speed replaces the wheels; none for no odometry")
    log.add_argument("--position", metavar="CHANNEL", help="channel of the GNSS position; none for no position")
    log.add_argument("--unit", action="append", default=[], metavar="NAME=UNIT", help="unit of a channel or column, such as WHEELS.FL=km/h")
    log.add_argument("--offset", action="append", default=[], metavar="NAME=SECONDS", help="time to add to the stamps of a channel")
    log.add_argument("--rate", type=float, metavar="HZ", help="samples per second of a table that counts samples")
    log.add_argument("--stamps", choices=["header", "recorded"], default="header", help="which times of a bag's messages are used")
    log.add_argument("--same-clock", action="store_true", help="use the stamps as they are: the files have one clock")
    log.add_argument("--from", dest="start", type=float, default=0.0, metavar="SECONDS", help="skip this much after the first sample")
    log.add_argument("--to", type=float, metavar="SECONDS", help="end this long after the first sample")
    log.add_argument("--json", action="store_true", help="print the report as JSON")
    log.add_argument("--quiet", "-q", action="store_true", help="no progress")


def vehicle_of(args):
    """The vehicle file's content, in which arguments replace what the file gives."""
    from gyronet.vehicle import Vehicle

    first = Path(args.files[0]).resolve()
    own, shared = first.with_suffix(".toml"), first.with_name("vehicle.toml")
    own = own if own.is_file() and (not args.vehicle or own == Path(args.vehicle).resolve()) else None
    path = own or args.vehicle or (shared if shared.is_file() else None)
    vehicle = Vehicle.read(path) if path else Vehicle()
    # A drive's own file: its rows are turned already, and its names are those of the original logs.
    if own and vehicle.turned:
        vehicle.forget_names()
    else:
        vehicle.of_log()
    if args.command == "import" and args.out:
        out, beside = Path(args.out), Path(args.out).with_suffix(".toml")
        if out.suffix == ".toml":
            raise Refused(f"{out}: the drive is a CSV file; its vehicle file has that suffix")
        for read in args.files:
            if Path(read).resolve() in (out.resolve(), beside.resolve()):
                raise Refused(f"{read}: --out would overwrite it, a log of this import; give the drive another name")
        if beside.is_file() and (vehicle.path and beside.samefile(vehicle.path) or "[recording" not in beside.read_text(errors="replace")):
            raise Refused(f"{beside}: --out {out} would overwrite this vehicle file by the drive's own; give the drive another name")
    if dbc := args.dbc or vehicle.bus["dbc"]:
        vehicle.bus["dbc"] = os.path.abspath(dbc)
    for name in ("imu", "odometry", "position"):
        vehicle.signals[name] = getattr(args, name) or vehicle.signals[name]
    return vehicle


def drive_of(args):
    from gyronet import progress
    from gyronet.logs import Drive, Request
    from gyronet.units import Flags
    from gyronet.vehicle import COLUMNS

    progress.QUIET = args.quiet
    if not 0 <= args.start < 1e6 or args.to is not None and not args.start < args.to:
        raise Refused("--from and --to are seconds after the first sample, --from below --to")
    if args.rate is not None and not 0 < args.rate < 1e5:
        raise Refused("--rate must be a number of samples per second")
    offsets = {}
    for flag in args.offset:
        name, equals, seconds = flag.rpartition("=")
        try:
            offsets[name] = float(seconds)
        except ValueError:
            equals = ""
        if not equals:
            raise Refused(f"--offset {flag}: write NAME=SECONDS")
    vehicle = vehicle_of(args)
    flags = Flags(args.unit)
    for name in [name for name in flags if isinstance(name, str)]:
        given = ", ".join(unit for key, unit in flags.items() if isinstance(key, tuple) and key[0] == name)
        vehicle.columns[name] = {**vehicle.columns.get(name, {}), "unit": given}
    for name in set(vehicle.columns) - set(COLUMNS):
        flags.add(name, vehicle.columns[name]["unit"], vehicle.path)
    return Drive(Request(args.files, vehicle, args.same_clock, args.stamps == "recorded", args.start, args.to, flags, offsets, args.rate))


def run_logs(args):
    if args.command == "correct":
        try:
            from gyronet import bags, correct
        except ImportError as error:
            raise Refused(str(error)) from None
        bags.copier_of(Path(args.files[0]), Path(args.out))
    drive = drive_of(args)
    report, start, dropped = drive.report, drive.start_time, sum(drive.dropped.values())
    if args.out:
        if args.command == "correct":
            report.append(correct.correct(drive, args.files[0], args.out, args.weights, args.calibration))
        else:
            beside = drive.write(args.out)
            report.append(f"{args.out}: {drive.rows} rows; {beside} beside it")
    else:
        report.append("nothing is written without --out")
    if args.json:
        print(json.dumps({"seconds": round(drive.seconds, 2), "rows": drive.rows, "dropped": dropped, "start": start, "report": report,
                          "warnings": drive.warnings, "dropped_by_reason": drive.dropped}))
        return
    print(f"{drive.seconds:.2f} s, {drive.rows} rows, {dropped} records dropped")
    for line in [drive.start_line(), *(f"dropped {count}: {reason}" for reason, count in drive.dropped.items()), *report]:
        print(f"  {line}")
    for warning in drive.warnings:
        print(f"  warning: {warning}")


def main(arguments=None):
    args = parser().parse_args(arguments)
    logging.disable(logging.CRITICAL)  # the libraries' own remarks; ours are in the report
    sys.unraisablehook = lambda _: None  # a reader that could not be opened complains again when it is thrown away
    try:
        if args.command == "wheels":
            from gyronet.wheels import run
            run(args)
        else:
            run_logs(args)
    except Refused as error:
        print("error:", " ".join(str(error).split()), file=sys.stderr)
        return 1
    except ModuleNotFoundError as error:
        print(f"error: {sys.executable} has no {error.name}: {sys.executable} -m pip install -r tools/requirements.txt", file=sys.stderr)
        return 1
    except BrokenPipeError:  # a pager that was left
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())

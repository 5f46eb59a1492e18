"""`tauperp calibrate`: thresholds, sensor offsets and friction of one arm from recordings that nobody touches."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import can

from tauperp.bus import SOCKETCAN, add_bus_arguments, open_bus
from tauperp.config import Configuration, load_configuration, preset_names
from tauperp.errors import InputError
from tauperp.files import write_atomically
from tauperp.robot.load import shipped
from tauperp.robot.options import add_robot_arguments, chain_of, say_warnings

if TYPE_CHECKING:
    from tauperp.calibrate.sources import Motion

HELP = """Compute thresholds for a wanted rate of false alarms from recordings in which nobody touches the arm: tables,
bus logs, or a live bus (--record-for). It checks sign, order and unit of every joint against the model and finds the
offsets and friction of the sensors. It judges the result on data that it did not use, and lists motion that the data do
not contain."""

LARGEST_SHARE, SMALLEST_SHARE = 0.9, 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "recordings", nargs="*", metavar="RECORDING", help="tables or bus logs; labelled touches are removed"
    )
    parser.add_argument("--config", metavar="FILE", help="TOML file or preset to calibrate (default: default)")
    add_robot_arguments(parser, "the configuration's")
    parser.add_argument("--map", metavar="FILE", help="TOML file of the tables' columns, units and signs")
    parser.add_argument(
        "--offsets", metavar="FILE", help="recording of the arm at rest without a load, for the offsets"
    )
    parser.add_argument(
        "--alarms-per-hour", type=float, default=1.0, metavar="RATE", help="wanted rate of false alarms per task (1)"
    )
    parser.add_argument(
        "--held-out",
        type=float,
        default=0.33,
        metavar="SHARE",
        help="part of each recording that only judges the result (0.33)",
    )
    parser.add_argument(
        "--limits", action="store_true", help="also write the proposed limits of what the tasks explain"
    )
    parser.add_argument("--record-for", type=float, metavar="S", help="record a bus for S seconds")
    parser.add_argument("-o", "--output", metavar="OUT", help="TOML file to write (calibration.toml in --out)")
    parser.add_argument(
        "--out", metavar="DIR", default="out/calibrate", help="folder for page, figure and JSON (out/calibrate)"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    add_bus_arguments(parser)
    parser.set_defaults(interface=None, channel=None, bitrate=None, data_bitrate=None)


def run(args: argparse.Namespace) -> int:
    from tauperp.calibrate import output
    from tauperp.calibrate.calibration import calibrate
    from tauperp.calibrate.sources import read_motion
    from tauperp.view.calibration_figure import calibration_figure
    from tauperp.view.summary import shown_progress

    if bool(args.recordings) == (args.record_for is not None):
        raise InputError("calibrate: name either recordings or, with --record-for, a bus to listen to")
    if not 0 < args.alarms_per_hour <= 3600:
        raise InputError(f"--alarms-per-hour: {args.alarms_per_hour:g} is not in 0 to 3600")
    if not SMALLEST_SHARE <= args.held_out <= LARGEST_SHARE:
        raise InputError(f"--held-out: {args.held_out:g} is not in {SMALLEST_SHARE} to {LARGEST_SHARE}")
    source = args.config or "default"
    configuration = load_configuration(source, robot=args.robot, chain=chain_of(args))
    say_warnings(configuration.robot)
    joints = configuration.robot.n
    names = [joint.name for joint in configuration.robot.joints]
    with shown_progress("calibrate") as progress:
        if args.record_for is not None:
            motions = [_listen(args, joints, lambda share: progress(share, "listening"))]
        else:
            motions = [read_motion(path, joints, args.map, names=names) for path in args.recordings]
        rest = None if args.offsets is None else read_motion(args.offsets, joints, args.map, names=names)
        result = calibrate(
            motions,
            configuration,
            alarms_per_hour=args.alarms_per_hour,
            held_out=args.held_out,
            rest=rest,
            limits=args.limits,
            progress=progress,
        )
    out = Path(args.out)
    target = Path(args.output) if args.output else out / "calibration.toml"
    model, chain = _robot_of(configuration, args)
    preset = source if source in preset_names() else configuration.settings.preset
    png = calibration_figure(result)
    content = output.report(result)
    files: dict[Path, str | bytes] = {
        out / "calibration.json": json.dumps(content, indent=2) + "\n",
        out / "calibration.png": png,
        out / "calibration.html": output.html(result, png),
        target: output.toml(result, model, preset, chain),
    }
    for path, text in files.items():  # not before every one is complete
        write_atomically(path, text)
    if args.json:
        print(json.dumps(content, indent=2))
    else:
        print("\n".join(output.lines(result)))
        print(f"{target}; calibration.html, .png and .json in {out}")
    return 0


def _robot_of(configuration: Configuration, args: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """The robot that was calibrated, by its shipped name or whole path, and which part of the file is the arm."""
    choice, file = configuration.settings.robot, configuration.robot.source
    model = args.robot or (configuration.robot.name if choice is None else choice.model)
    if model not in shipped() and file is not None:
        model = str(file.path.resolve())
    own = {} if args.robot or choice is None else choice.model_dump(exclude={"model"}, exclude_defaults=True)
    return model, {**own, **chain_of(args)}


def _listen(args: argparse.Namespace, joints: int, report: Callable[[float], None]) -> "Motion":
    """Record from the bus that the arguments name. Raises InputError if the bus disappears."""
    from tauperp.calibrate.sources import record_motion

    if not 0 < args.record_for < float("inf"):
        raise InputError(f"--record-for: {args.record_for:g} is not a positive number")
    options = {"fd": True} if args.interface == SOCKETCAN else {}
    with open_bus(args, **options) as bus:
        try:
            return record_motion(bus, args.record_for, joints, report)
        except can.CanError as error:
            raise InputError(f"CAN bus {args.interface} {args.channel}: {' '.join(str(error).split())}") from error

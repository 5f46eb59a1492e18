"""Command-line arguments of a simulated robot: the bus, the guard, and the time."""

import argparse
from collections.abc import Callable
from typing import Literal

import can

from tauperp.bus import DEFAULT_INTERFACE, add_bus_arguments, open_bus, refuse_bit_rates
from tauperp.errors import InputError
from tauperp.experiment import Setup
from tauperp.run.pace import Patience
from tauperp.sim.sensors import SENSOR_PRESETS

GUARD_HELP = """On a named bus the guard is the node that answers (exit code 2 if none does). Without a bus, or on
python-can's virtual bus, the guard is the firmware's library in this process."""
LONGEST_PATIENCE_S = 3600.0


def _seconds(text: str) -> float:
    value = float(text)
    if not 0 < value <= LONGEST_PATIENCE_S:
        raise ValueError
    return value


_seconds.__name__ = "number of seconds"  # as argparse calls it


def add_installation_arguments(parser: argparse.ArgumentParser) -> None:
    """The guard's configuration and the robot's sensors."""
    parser.add_argument(
        "--config", metavar="NAME", help="preset or TOML file of the guard's configuration, instead of the scenario's"
    )
    parser.add_argument(
        "--sensors",
        choices=tuple(SENSOR_PRESETS),
        help="simulated joint sensors, instead of the scenario's (paper: less noise than real ones)",
    )


def add_playing_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--guard",
        choices=("library", "bus"),
        help="the firmware's library in this process, or a guard on the bus (default: bus if --interface or --channel "
        "name a bus that is not virtual)",
    )
    parser.add_argument(
        "--channels", type=int, choices=(1, 2), help="of the library's guard: 1, or 2 that must agree (default: 1)"
    )
    parser.add_argument(
        "--real-time",
        action="store_true",
        help="start each cycle by the clock, and count late cycles and permissions. Without it each cycle waits for "
        "the guard's answer",
    )
    parser.add_argument(
        "--start-timeout",
        type=_seconds,
        default=Patience.start_s,
        metavar="S",
        help=f"real time to wait for the guard's first answer ({Patience.start_s:g})",
    )
    parser.add_argument(
        "--answer-timeout",
        type=_seconds,
        default=Patience.answer_s,
        metavar="S",
        help="real time to wait for the answer to a cycle. Without one the robot stops and the run ends "
        f"({Patience.answer_s:g})",
    )
    add_bus_arguments(parser)


def setup_of(args: argparse.Namespace, *, fd: bool) -> Setup:
    """The setup that the arguments describe. Raises InputError for an unnamed bus, or an option without effect."""
    refuse_bit_rates(args)
    named = bool({"interface", "channel"} & {name for name, value in vars(args).items() if value is not None})
    virtual = getattr(args, "interface", None) == DEFAULT_INTERFACE
    guard: Literal["library", "bus"] = args.guard or ("bus" if named and not virtual else "library")
    if guard == "bus" and not named:
        raise InputError("--guard bus: name the bus by --interface and --channel")
    if guard == "bus" and args.channels:
        raise InputError(
            "--channels is for the library's guard; the guard on the bus has the number with which it was started"
        )
    bus: Callable[[], can.BusABC] | None = (lambda: open_bus(args, fd=fd)) if named else None
    return Setup(bus, guard, args.real_time, Patience(args.start_timeout, args.answer_timeout), args.channels or 1)

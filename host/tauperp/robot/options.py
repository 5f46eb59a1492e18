"""The command-line options that select a robot, the same for every command."""

import argparse
import sys
from collections.abc import Mapping
from typing import Any

from tauperp.robot.model import Robot


def add_robot_arguments(parser: argparse.ArgumentParser, instead_of: str) -> None:
    """--robot, and the part of it that is the arm. instead_of: the source of the robot that it replaces, for the
    help."""
    parser.add_argument("--robot", metavar="NAME", help=f"shipped robot, URDF or MJCF file, instead of {instead_of}")
    add_chain_arguments(parser)


def add_chain_arguments(parser: argparse.ArgumentParser) -> None:
    """--base, --tip, --tool and --accept-inertia."""
    parser.add_argument("--base", metavar="LINK", help="first link of the arm (default: the root)")
    parser.add_argument("--tip", metavar="LINK", help="last link of the arm; needed if the robot branches")
    parser.add_argument(
        "--tool", nargs=3, type=float, metavar=("X", "Y", "Z"), help="end-effector point in the tip's frame, m"
    )
    parser.add_argument(
        "--accept-inertia", action="store_true", help="correct inertias that no body can have, and show the change"
    )


def chain_of(args: argparse.Namespace) -> Mapping[str, Any]:
    """The options that were given, as keywords of tauperp.robot.load."""
    named = {name: getattr(args, name) for name in ("base", "tip", "tool")}
    given = {name: value for name, value in named.items() if value is not None}
    return {**given, "accept_inertia": True} if args.accept_inertia else given


def say_warnings(robot: Robot) -> None:
    """Prints the changes and omissions of the robot's reader on stderr."""
    for warning in robot.warnings:
        print(f"tauperp: warning: {warning}", file=sys.stderr)

"""`tauperp robot`: a robot's table for the firmware, written only if other readers get the same numbers."""

import argparse
import json
import sys
from dataclasses import replace
from typing import Any

from tauperp.files import write_atomically
from tauperp.robot import load, shipped
from tauperp.robot.check import QUANTITIES, Comparison, check
from tauperp.robot.emit import c_source, identifier
from tauperp.robot.model import Robot
from tauperp.robot.options import add_chain_arguments, chain_of

HELP = f"""Make the firmware's robot table from a URDF or MJCF file. Check momentum, C^T qd, gravity torque and Jacobian
against Pinocchio, and against the file as Pinocchio (URDF) or MuJoCo (MJCF) reads it. Joints outside the
chain are locked and their links merged. Shipped robots: {", ".join(shipped())}."""

_DEFAULT = "*"  # mark after a limit that the file does not have


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="URDF or MJCF file, or a shipped robot's name")
    parser.add_argument("--name", metavar="N", help="name of the robot (default: the file's)")
    add_chain_arguments(parser)
    parser.add_argument(
        "--base-rpy",
        nargs=3,
        type=float,
        metavar=("R", "P", "Y"),
        help="orientation of the file's root in the cell, rad (as in URDF)",
    )
    parser.add_argument("-o", "--output", metavar="OUT.c", help="write the table as C source")
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def run(args: argparse.Namespace) -> int:
    robot = load(args.file, base_rpy=args.base_rpy, **chain_of(args))
    robot = replace(robot, name=identifier(args.name or robot.name))
    comparisons = check(robot)
    good = all(comparison.good for comparison in comparisons)
    print(json.dumps(_summary(robot, comparisons), indent=2) if args.json else _table(robot, comparisons))
    if not good:
        print("tauperp: the readers differ: no table is written", file=sys.stderr)
        return 1
    if args.output:
        write_atomically(args.output, c_source(robot))
    return 0


def _summary(robot: Robot, comparisons: list[Comparison]) -> dict[str, Any]:
    return {
        "robot": robot.name,
        "source": robot.note,
        "mass_kg": robot.mass,
        "reach_m": robot.reach,
        "gravity_m_s2": robot.gravity.tolist(),
        "tip_m": robot.tip.tolist(),
        "warnings": list(robot.warnings),
        "joints": [
            {
                "name": joint.name,
                "axis": joint.axis.tolist(),
                "position_rad": [joint.position_min, joint.position_max],
                "velocity_rad_s": joint.velocity_max,
                "torque_nm": joint.torque_max,
                "defaults": sorted(joint.defaults),
                "mass_kg": joint.mass,
            }
            for joint in robot.joints
        ],
        "checks": [
            {
                "reader": comparison.reader,
                "states": comparison.states,
                "good": comparison.good,
                "largest_difference": comparison.difference,
                "allowed": comparison.allowed,
            }
            for comparison in comparisons
        ],
    }


def _table(robot: Robot, comparisons: list[Comparison]) -> str:
    width = max(7, *(len(joint.name) for joint in robot.joints)) + 2
    gravity = ", ".join(f"{value:.4g}" for value in robot.gravity)
    lines = [
        f"{robot.name}: {robot.n} joints, {robot.mass:.2f} kg moving, {robot.reach:.3f} m from joint 2 to the tip, "
        f"gravity ({gravity}) m/s2 in the base frame",
        robot.note,
        f"{'joint':<{width}}{'axis':<20}{'position rad':<18}{'rad/s':>7}{'Nm':>8}{'kg':>7}",
    ]
    for joint in robot.joints:
        axis = " ".join(f"{value + 0.0:.3g}" for value in joint.axis.round(6))
        mark = {what: _DEFAULT if what in joint.defaults else " " for what in ("position", "velocity", "torque")}
        position = f"{joint.position_min:.3f}..{joint.position_max:.3f}{mark['position']}"
        lines.append(
            f"{joint.name:<{width}}{axis:<20}{position:<18}{joint.velocity_max:>6.2f}{mark['velocity']}"
            f"{joint.torque_max:>7.1f}{mark['torque']}{joint.mass:>7.2f}"
        )
    if any(joint.defaults for joint in robot.joints):
        lines.append(f"{_DEFAULT} not in the file: a default")
    lines += [f"warning: {warning}" for warning in robot.warnings]
    for comparison in comparisons:
        differences = ", ".join(f"{name} {comparison.difference[name]:.0e} {unit}" for name, unit in QUANTITIES.items())
        verdict = "agrees" if comparison.good else "DIFFERS"
        lines.append(f"{verdict} with {comparison.reader} on {comparison.states} states: {differences}")
    return "\n".join(lines)

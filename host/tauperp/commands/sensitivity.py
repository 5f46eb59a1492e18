"""`tauperp sensitivity`: the smallest force on each link that the guard detects."""

import argparse
import json
from pathlib import Path

import numpy as np

from tauperp.config import TASKS, load_configuration
from tauperp.errors import InputError
from tauperp.files import write_atomically
from tauperp.robot.options import add_robot_arguments, chain_of, say_warnings

HELP = """Compute the smallest static force and the smallest push of 50 ms on each link that the guard detects in each
task, the directions that it cannot detect, and which limits of ISO/TS 15066 this covers. For one posture, a recorded
trajectory, or the whole workspace. Measured with the compiled firmware, drawn on the arm."""

MOST_POSTURES = 2000
FROM_TRAJECTORY = 40


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--config", metavar="FILE", help="TOML file or preset (default: default)")
    add_robot_arguments(parser, "the configuration's")
    parser.add_argument("--task", choices=list(TASKS), action="append", help="only this task (may be repeated)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--pose", metavar="Q", help="one posture: Q1,Q2,... rad")
    where.add_argument("--trajectory", metavar="FILE", help="postures of a recording (table or bus log)")
    where.add_argument("--workspace", type=int, metavar="N", help="N postures of the whole range (default: 60)")
    parser.add_argument("--map", metavar="FILE", help="TOML file of the table's columns, units and signs")
    parser.add_argument(
        "--out", metavar="DIR", default="out/sensitivity", help="folder for page, figure and JSON (out/sensitivity)"
    )
    parser.add_argument("--view", action="store_true", help="show the first task on the arm in MuJoCo's viewer")
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def run(args: argparse.Namespace) -> int:
    from tauperp.sensitivity import output
    from tauperp.sensitivity.analysis import analyse, workspace
    from tauperp.sim.dynamics import Dynamics
    from tauperp.sim.posture import home
    from tauperp.view.sensitivity_figure import sensitivity_figure
    from tauperp.view.summary import shown_progress

    if args.view:
        from tauperp.view.window import viewer

        viewer()  # reports a missing display before the work
    configuration = load_configuration(args.config or "default", robot=args.robot, chain=chain_of(args))
    say_warnings(configuration.robot)
    robot = configuration.robot
    tasks = [task for task in TASKS if configuration.settings.task[task].index != "off"]
    for task in args.task or ():
        if task not in tasks:
            raise InputError(f"--task: {task!r} is off for {robot.name} in {configuration.source}")
    tasks = [task for task in tasks if not args.task or task in args.task]
    if args.pose is not None:
        postures, where = _pose(args.pose, [(j.position_min, j.position_max) for j in robot.joints]), "one posture"
    elif args.trajectory is not None:
        from tauperp.calibrate.sources import read_motion

        names = [joint.name for joint in robot.joints]
        motion = read_motion(args.trajectory, robot.n, args.map, names=names)
        rows = np.linspace(0, len(motion.q) - 1, min(FROM_TRAJECTORY, len(motion.q))).astype(int)
        postures, where = motion.q[rows], f"{len(rows)} postures of {motion.name}"
    else:
        count = 60 if args.workspace is None else args.workspace
        if not 1 <= count <= MOST_POSTURES:
            raise InputError(f"--workspace: {count} is not in 1 to {MOST_POSTURES}")
        postures = np.concatenate([home(robot, Dynamics(robot))[None], workspace(robot, count)])
        where = f"home and {len(postures) - 1} postures of the whole range"
    with shown_progress("sensitivity") as progress:
        forces = analyse(configuration, postures, tasks, progress)
    content = output.report(configuration, where, len(postures), forces)
    png = sensitivity_figure(robot, postures[0], forces, content)
    out = Path(args.out)
    write_atomically(out / "sensitivity.json", json.dumps(content, indent=2) + "\n")
    write_atomically(out / "sensitivity.png", png)
    write_atomically(out / "sensitivity.html", output.html(content, png))
    if args.json:
        print(json.dumps(content, indent=2))
    else:
        print("\n".join(output.lines(content)))
        print(f"sensitivity.html, .png and .json in {out}")
    if args.view:
        from tauperp.view.sensitivity_window import show

        show(robot, postures[0], forces[0])
    return 0


def _pose(text: str, ranges: list[tuple[float, float]]) -> np.ndarray:
    """One posture (1, n). Raises InputError for other than n numbers within the joints' ranges."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"--pose: {text!r} is not a list of numbers") from None
    if len(values) != len(ranges):
        raise InputError(f"--pose: {len(values)} numbers for {len(ranges)} joints")
    for joint, (value, (low, high)) in enumerate(zip(values, ranges, strict=True)):
        if not low <= value <= high:
            raise InputError(f"--pose: joint {joint + 1} at {value:g} rad is outside {low:.3g} to {high:.3g}")
    return np.array([values])

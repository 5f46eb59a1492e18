"""`tauperp score`: recordings of a real arm through the firmware."""

import argparse
import json
import sys
from pathlib import Path

from tauperp.calibrate.joints import check_joints
from tauperp.calibrate.sources import Motion
from tauperp.cli import BAD_INPUT
from tauperp.config import TASKS, Configuration, TaskName, load_configuration, preset_names
from tauperp.errors import InputError
from tauperp.files import write_atomically
from tauperp.recording import Recording, play, read_recording, score
from tauperp.recording.offsets import CHOICES
from tauperp.recording.report import Scored, lines, report
from tauperp.recording.score import FOUND_GOAL, TESTED_GOAL
from tauperp.recording.stamps import check_rate
from tauperp.recording.timeline import BRIDGE_MS
from tauperp.robot.options import add_robot_arguments, chain_of, say_warnings
from tauperp.sim.moment import Watch
from tauperp.view.watching import add_watch_arguments, watching

HELP = f"""Send recordings of a real arm to the firmware as bus frames at their own rate, and compare its stops with the
labels. A table has the columns time, q0.., dq0.., tau_J0.. and label (set while touched), or those that --map names.
Draws each recording and writes score.json. Exit code 0 if {FOUND_GOAL:.0%} of the touches are found, nothing
else stops, and the guard permitted motion for {TESTED_GOAL:.0%} of the untouched time of each file; 1 if not; 2 if a
file was refused."""

FEWEST_ROWS = 50  # before the first touch, for a check against the model


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("tables", nargs="+", metavar="TABLE", help="recordings: .csv, .csv.gz, .npz, .parquet, .mcap")
    add_robot_arguments(parser, "the configuration's")
    parser.add_argument("--config", metavar="FILE", help="TOML file or preset (default: replay_NAME if shipped)")
    add_score_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    add_watch_arguments(parser)


def add_score_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments that `replay --csv` has too."""
    parser.add_argument("--map", metavar="FILE", help="TOML file of the recordings' columns, units and signs")
    parser.add_argument("--task", choices=list(TASKS), help="task that the robot commands (default: none)")
    parser.add_argument(
        "--offsets",
        metavar="FROM",
        help=f"torque offsets from: {', '.join(CHOICES)}, or a file (default: calibration, else rest, else zero)",
    )
    parser.add_argument(
        "--bridge",
        type=float,
        metavar="MS",
        help=f"longest gap that is bridged; a longer one splits the recording ({BRIDGE_MS:g})",
    )
    parser.add_argument("--out", metavar="DIR", help="folder for figures and score.json (out/score)")


def run(args: argparse.Namespace) -> int:
    if len(args.tables) > 1 and (args.view or args.rerun is not None):
        raise InputError(f"{args.command}: --view and --rerun show one recording; each begins at its own time 0")
    if args.bridge is not None and not 0 <= args.bridge <= 1000:
        raise InputError(f"--bridge: {args.bridge:g} is not in 0 to 1000 ms")
    out = args.out or "out/score"
    task: TaskName = args.task or "none"
    source = args.config or _preset_for(args.command, args.robot)
    configuration = load_configuration(source, robot=args.robot, chain=chain_of(args))
    say_warnings(configuration.robot)
    with watching(args) as watch:
        scored, refused = _score_all(args, configuration, task, watch)
    if not scored:
        return _say(list(refused.values()))
    content = report(configuration, task, scored, refused)
    _write(Path(out), scored, json.dumps(content, indent=2) + "\n")
    print(json.dumps(content, indent=2) if args.json else "\n".join(lines(content, out)))
    damages = [one.playback.recording.damage for one in scored if one.playback.recording.damage is not None]
    if refused or damages:
        return _say([*refused.values(), *damages])
    return 1 if content["faults"] else 0


def _score_all(
    args: argparse.Namespace, configuration: Configuration, task: TaskName, watch: Watch | None
) -> tuple[list[Scored], dict[str, str]]:
    """Every file that can be scored, and why the others cannot."""
    joints = [joint.name for joint in configuration.robot.joints]
    scored: list[Scored] = []
    refused: dict[str, str] = {}
    names: dict[str, Path] = {}
    for path in args.tables:
        try:
            recording = read_recording(path, configuration.robot.n, args.map, names=joints)
            for note in recording.notes:
                print(f"tauperp: {path}: {note}", file=sys.stderr)
            other = names.setdefault(recording.name, recording.path)
            if other != recording.path:
                raise InputError(f"{path}: results would overwrite those of {other}, of the same name")
            check_rate(recording)
            checks = _check(recording, configuration)
            playback = play(
                recording,
                configuration,
                task=task,
                offsets=args.offsets,
                bridge_ms=BRIDGE_MS if args.bridge is None else args.bridge,
                watch=watch,
            )
            scored.append(Scored(playback, score(playback), checks))
        except InputError as error:
            refused[str(path)] = str(error)
    return scored, refused


def _check(recording: Recording, configuration: Configuration) -> list[str]:
    """Sign, order and unit of the columns against the model, in the part before the first touch."""
    first = recording.touches[0].first if recording.touches else len(recording.time_s)
    if first < FEWEST_ROWS:
        return ["not checked: touched from the beginning"]
    rows = slice(0, first)
    motion = Motion(
        str(recording.path), recording.time_s[rows], recording.q[rows], recording.qd[rows], recording.tau[rows], False
    )
    return check_joints([motion], configuration.robot)


def _say(faults: list[str]) -> int:
    """What could be read has been reported: the rest is bad input."""
    sys.stdout.flush()
    for fault in faults:
        print(f"tauperp: {' '.join(fault.split())}", file=sys.stderr)
    return BAD_INPUT


def _preset_for(command: str, robot: str | None) -> str:
    if robot is None:
        raise InputError(f"{command}: name the arm with --robot, or an installation with --config")
    special = f"replay_{robot}"
    return special if special in preset_names() else "default"


def _write(out: Path, scored: list[Scored], content: str) -> None:
    from tauperp.view.replay_figure import (
        replay_figure,
    )  # matplotlib is slow to import: only after the input was checked

    for one in scored:
        write_atomically(out / f"{one.name}.png", replay_figure(one.playback, one.score))
    write_atomically(out / "score.json", content)

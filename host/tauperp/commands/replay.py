"""`tauperp replay`: bus logs through the firmware; with --csv, the same as `tauperp score`."""

import argparse
import json
import sys
from pathlib import Path

from tauperp.cli import BAD_INPUT
from tauperp.commands import score
from tauperp.errors import InputError
from tauperp.files import write_atomically
from tauperp.replay import log_report
from tauperp.robot.options import add_robot_arguments, chain_of
from tauperp.view.watching import add_watch_arguments, watching

HELP = """Send the robot's frames of a bus log to the firmware, compare its answers bit for bit with the guard's frames
in the log, and draw the log in out/replay. Exit code 0 if all answers are equal. --csv TABLE... is the same as `tauperp
score TABLE...`."""

_OF_RECORDINGS = ("map", "task", "offsets", "bridge")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "log", nargs="?", metavar="LOG", help="bus log: .blf, .asc, .log or another format that python-can reads"
    )
    parser.add_argument("--csv", nargs="+", metavar="FILE", help="recordings: .csv, .csv.gz, .npz, .parquet, .mcap")
    add_robot_arguments(parser, "the configuration's")
    parser.add_argument(
        "--config", metavar="FILE", help="TOML file or preset (default: the log's or replay_NAME if shipped)"
    )
    parser.add_argument("--scenario", metavar="NAME", help="use the configuration of this scenario")
    parser.add_argument(
        "--log-channel", metavar="NAME", help="use only this channel of the log (needed if several have a guard)"
    )
    score.add_score_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    add_watch_arguments(parser)


def run(args: argparse.Namespace) -> int:
    if (args.log is None) == (args.csv is None):
        raise InputError("replay: name either one bus log or, with --csv, recordings")
    _refuse_foreign_options(args)
    if args.csv is None:
        return _replay_log(args)
    args.tables = args.csv
    return score.run(args)


def _refuse_foreign_options(args: argparse.Namespace) -> None:
    """An option that would have no effect is an error of the user."""
    foreign = ("scenario", "log_channel") if args.log is None else _OF_RECORDINGS
    for name in foreign:
        if getattr(args, name) is not None:
            kind = "bus logs" if args.log is None else "recordings (--csv)"
            raise InputError(f"replay: --{name.replace('_', '-')} is only for {kind}")
    if args.scenario is not None and args.config is not None:
        raise InputError("replay: name either --config or --scenario")


def _replay_log(args: argparse.Namespace) -> int:
    from tauperp.view.replay_figure import LogTimeline  # slow to import: only after the arguments were checked

    drawn = LogTimeline()
    with watching(args, drawn.watch) as watch:
        replay = log_report.replay_log(
            args.log,
            config=args.config,
            robot=args.robot,
            scenario=args.scenario,
            chain=chain_of(args),
            channel=args.log_channel,
            watch=watch,
        )
    figure = drawn.figure(replay)
    picture = Path(args.out or "out/replay") / f"{replay.path.stem}.png"
    if figure is not None:
        write_atomically(picture, figure)
    if args.json:
        print(json.dumps(log_report.report(replay), indent=2))
    else:
        print("\n".join(log_report.lines(replay)))
        if figure is not None:
            print(f"written: {picture}")
    if replay.damage is not None:
        sys.stdout.flush()
        print(f"tauperp: {replay.damage}", file=sys.stderr)
        return BAD_INPUT
    return 0 if replay.equal else 1

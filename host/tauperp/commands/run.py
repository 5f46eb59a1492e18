"""`tauperp run SCENARIO.toml`: any scenario against the compiled firmware."""

import argparse
import json
from pathlib import Path

from tauperp.experiment import run_scenario
from tauperp.playing import GUARD_HELP, add_installation_arguments, add_playing_arguments, setup_of
from tauperp.replay.recorder import bus_recorder
from tauperp.robot.options import add_robot_arguments, chain_of, say_warnings
from tauperp.run.scenario import load_scenario, shipped
from tauperp.view.results import Results, add_result_arguments
from tauperp.view.summary import print_outcomes, shown_progress
from tauperp.view.watching import add_watch_arguments, watching

HELP = f"""Simulate a scenario with the compiled firmware as guard. The scenario is a TOML file or a shipped name.
It states robot, tasks, payloads, motion, contacts and sensor faults. Writes NAME.json and NAME.png. Exit code 0 if
every collision and fault happened while the robot moved, every collision stopped it, and nothing else stopped it except
a sensor fault. {GUARD_HELP}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", metavar="SCENARIO", help="TOML file, or the name of a shipped scenario")
    add_robot_arguments(parser, "the scenario's")
    add_installation_arguments(parser)
    parser.add_argument(
        "--seed", type=int, metavar="N", help="random seed of sensors and model errors, instead of the scenario's"
    )
    parser.add_argument(
        "--record",
        metavar="FILE",
        help="record all frames to a new file: .blf, .asc, .log or another format that python-can writes",
    )
    add_result_arguments(parser, "run")
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    add_watch_arguments(parser)
    add_playing_arguments(parser)


def run(args: argparse.Namespace) -> int:
    path = args.scenario if Path(args.scenario).suffix == ".toml" else shipped(args.scenario)
    scenario = load_scenario(
        path, robot=args.robot, seed=args.seed, chain=chain_of(args), config=args.config, sensors=args.sensors
    )
    say_warnings(scenario.robot)
    fd = scenario.configuration.settings.wire.format == "fd"
    setup = setup_of(args, fd=fd)
    results = Results(args)
    with (
        watching(args, results.watch) as watch,
        bus_recorder(args.record, fd=fd) as listener,
        shown_progress(Path(path).stem) as progress,
    ):
        outcome = run_scenario(scenario, setup, listener=listener, progress=progress, watch=watch)
    written = results.write(outcome, Path(path).stem)
    if args.json:
        print(json.dumps(outcome.report, indent=2))
    else:
        print_outcomes([outcome], written)
    return 0 if outcome.passed else 1

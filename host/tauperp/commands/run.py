"""`tauperp run SCENARIO.toml`: any scenario against the compiled firmware."""

import argparse
import json
from pathlib import Path

from tauperp.experiment import run_scenario
from tauperp.playing import GUARD_HELP, add_playing_arguments, setup_of
from tauperp.replay.recorder import bus_recorder
from tauperp.robot.options import add_robot_arguments, chain_of, say_warnings
from tauperp.run.scenario import load_scenario, shipped
from tauperp.view.results import Results, add_result_arguments
from tauperp.view.summary import print_outcomes, shown_progress
from tauperp.view.watching import add_watch_arguments, watching

HELP = f"""Run a scenario, a TOML file or the name of a shipped one, against the compiled firmware: robot, task,
payload, motion, contacts, sensor faults. Writes NAME.json and NAME.png. Exit code 0 if every collision and fault met a
moving robot, every collision stopped it, and nothing else but a sensor's fault did. {GUARD_HELP}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", metavar="SCENARIO", help="TOML file, or the name of a shipped scenario")
    add_robot_arguments(parser, "the scenario's")
    parser.add_argument("--seed", type=int, metavar="N", help="of sensors and model errors, instead of the scenario's")
    parser.add_argument(
        "--record", metavar="FILE", help="new file for every frame: .blf, .asc, .log, whatever python-can writes"
    )
    add_result_arguments(parser, "run")
    parser.add_argument("--json", action="store_true", help="print JSON instead of the table")
    add_watch_arguments(parser)
    add_playing_arguments(parser)


def run(args: argparse.Namespace) -> int:
    path = args.scenario if Path(args.scenario).suffix == ".toml" else shipped(args.scenario)
    scenario = load_scenario(path, robot=args.robot, seed=args.seed, chain=chain_of(args))
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

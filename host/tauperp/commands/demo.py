"""`tauperp demo`: both experiments of the paper, one table."""

import argparse
import json

from tauperp.experiment import EXPERIMENTS, load_experiment, run_experiment
from tauperp.playing import add_installation_arguments
from tauperp.view.results import Results, add_result_arguments
from tauperp.view.summary import print_outcomes, shown_progress

HELP = """Simulate both experiments of the paper, with the compiled firmware as guard on a CAN bus. Writes JSON and
figures, and prints one table. Exit code 0 if every collision stopped the robot and nothing else did."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_result_arguments(parser, "demo")
    add_installation_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def run(args: argparse.Namespace) -> int:
    outcomes = []
    for name in EXPERIMENTS:
        results = Results(args)
        with shown_progress(name) as progress:
            scenario = load_experiment(name, config=args.config, sensors=args.sensors)
            outcomes.append(run_experiment(name, scenario, progress=progress, watch=results.watch))
        results.write(outcomes[-1], name)
    if args.json:
        print(json.dumps({one.judgement.name: one.report for one in outcomes}, indent=2))
    else:
        print_outcomes(outcomes, args.out)
    return 0 if all(outcome.passed for outcome in outcomes) else 1

"""`tauperp experiment payload|contact`: one of the paper's two experiments."""

import argparse
import json

from tauperp.experiment import EXPERIMENTS, load_experiment, run_experiment
from tauperp.playing import GUARD_HELP, add_installation_arguments, add_playing_arguments, setup_of
from tauperp.robot.options import add_robot_arguments, chain_of, say_warnings
from tauperp.view.results import Results, add_result_arguments
from tauperp.view.summary import print_outcomes, shown_progress

HELP = f"""Simulate one of the paper's two experiments in MuJoCo, with the compiled firmware as guard on a CAN bus.
`payload` moves payloads that the guard does not know (Fig. 7); `contact` guides the arm by hand (Fig. 9). Both have
collisions. For another arm the experiment is adapted, the guard's preset and the sensors are `paper`, and the changes
are listed. Writes NAME.json and NAME.png. Exit code 0 if every collision stopped the robot, nothing else did, and the
index stayed below 0.5 Nm otherwise.
{GUARD_HELP}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", choices=EXPERIMENTS, help="the experiment")
    add_result_arguments(parser, "experiment")
    add_robot_arguments(parser, "ku_dex")
    add_installation_arguments(parser)
    parser.add_argument("--seed", type=int, metavar="N", help="random seed of sensors and model errors")
    parser.add_argument(
        "--rate", type=int, choices=(500, 1000), help="cycles per second: 500 on classic CAN, 1000 on CAN FD"
    )
    parser.add_argument(
        "--mass", type=float, metavar="KG", help="mass of the heaviest payload; the others scale with it"
    )
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")
    add_playing_arguments(parser)


def run(args: argparse.Namespace) -> int:
    scenario = load_experiment(
        args.name,
        robot=args.robot,
        seed=args.seed,
        rate_hz=args.rate,
        mass_kg=args.mass,
        chain=chain_of(args),
        config=args.config,
        sensors=args.sensors,
    )
    say_warnings(scenario.robot)
    setup = setup_of(args, fd=scenario.configuration.settings.wire.format == "fd")
    results = Results(args)
    with shown_progress(args.name) as progress:
        outcome = run_experiment(args.name, scenario, setup, progress=progress, watch=results.watch)
    written = results.write(outcome, args.name)
    if args.json:
        print(json.dumps(outcome.report, indent=2))
    else:
        print_outcomes([outcome], written)
    return 0 if outcome.passed else 1

"""`tauperp campaign`: thousands of simulated collisions with the compiled firmware in the loop."""

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tauperp.errors import InputError

if TYPE_CHECKING:
    from tauperp.campaign.plan import Plan

HELP = """Simulate many random collisions. The PLAN states how payload, motion, link, force, sensors and model error are
drawn. Every run passes the compiled firmware frame by frame. Reports detection rates, latencies and false stops with
confidence intervals, and those of simpler detectors on the same signals. Results are kept in --out: an interrupted
campaign continues there."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("plan", metavar="PLAN", help="TOML file (see docs/campaign.md)")
    parser.add_argument("--out", metavar="DIR", help="folder for the results (out/campaign/NAME)")
    parser.add_argument("--jobs", type=int, metavar="N", help="number of threads (default: one per core)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="run on a Dask cluster, for example tcp://host:8786")
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def run(args: argparse.Namespace) -> int:
    from tauperp.campaign.execute import Campaign
    from tauperp.campaign.plan import read_plan
    from tauperp.campaign.report import folder_of, write_report
    from tauperp.campaign.store import Store
    from tauperp.campaign.work import comparison
    from tauperp.view.summary import shown_progress

    if args.jobs is not None and args.jobs < 1:
        raise InputError(f"--jobs: {args.jobs} is not a number of threads")
    if args.jobs is not None and args.scheduler is not None:
        raise InputError("--jobs: the cluster's workers decide how many threads there are")
    plan = read_plan(args.plan)
    if plan.file.recording is not None:
        return _inject(args, plan)
    names: dict[str, list[str]] = {
        task: [one.name for one in comparison(plan, task, {}).detectors] for task in plan.file.tasks
    }
    store = Store(folder_of(args.out, plan), plan, names)
    campaign = Campaign(plan, store)
    with shown_progress("campaign") as report_progress:
        thresholds = campaign.run(report_progress, jobs=args.jobs, scheduler=args.scheduler)
    return _print(args, write_report(plan, store, thresholds, campaign.effort), store.folder)


def _inject(args: argparse.Namespace, plan: "Plan") -> int:
    from tauperp.campaign.injection import inject
    from tauperp.campaign.report import folder_of, write_injection_report
    from tauperp.view.summary import shown_progress

    if args.scheduler is not None:
        raise InputError("--scheduler: pushes into recordings take seconds; they run here")
    with shown_progress("campaign") as report_progress:
        injected = inject(plan, report_progress)
    folder = folder_of(args.out, plan)
    return _print(args, write_injection_report(plan, folder, injected), folder)


def _print(args: argparse.Namespace, report: dict[str, Any], folder: Path) -> int:
    from tauperp.campaign.report import lines

    if args.json:
        print(json.dumps(report, indent=2))
    else:
        print("\n".join(lines(report)))
        print(f"report.html, report.png and report.json in {folder}")
    return 0

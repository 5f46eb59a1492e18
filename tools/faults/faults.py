#!/usr/bin/env python3
"""Injects seeded faults into the guard and counts their outcomes (`make faults`).

    faults.py [--seed 1] [--count 1000000] [--g4 2000] [--jobs 2] [--channels 2] [--out out/faults]

On the library (faults.c): bits of the state and the block of each channel, the clock, the ticks. On the
stm32g4 image in its emulator (g4_faults.py): bits of registers, stack, data, code and block, at any instruction. Both
experiments of the paper are the recorded runs. Results are kept in chunks, so that an interrupted run can
continue. Prints a table and writes report.json. Exit code 1: with two channels, a fault was undetected and wrong.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from record import as_file, record

from tauperp.files import repository_root

ROOT = repository_root()
PROGRAM = ROOT / "build" / "faults"
EXPERIMENTS = ("contact", "payload")
SHARES = {"state": 0.75, "table": 0.15, "time": 0.1}
OUTCOMES = ("none", "detected", "needless", "late", "wrong")
CHUNK = 10_000
Job = tuple[str, Path | None, Any, tuple[Any, ...]]  # target, the chunk's file, its function and arguments
Rows = dict[str, dict[str, list[int]]]  # part, outcome: faults, sum and worst of the cycles to the reaction


def library_chunk(recording: Path, seed: int, first: int, count: int, part: str) -> dict[str, Any]:
    command = [str(PROGRAM), str(recording), str(seed), str(first), str(count), part]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    rows = [line.split() for line in lines]
    return {
        "reaction_cycles": int(rows[0][1]),
        "rows": [[row[1], row[3], *map(int, row[4:7])] for row in rows if row[0] == "count"],
        "wrong": [line for line in lines if line.startswith("wrong ")],
    }


def g4_part(folder: Path, experiment: str, channels: int, seed: int, count: int) -> dict[str, Any]:
    """All chunks of one experiment: g4_run.py writes those that are missing, after one run without a fault."""
    program = str(Path(__file__).with_name("g4_run.py"))
    command = [sys.executable, program, experiment, str(channels), str(seed), str(count), str(folder)]
    names = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.split()
    results = [json.loads(Path(name).read_text()) for name in names]
    return {
        "reaction_cycles": results[0]["reaction_cycles"],
        "rows": [row for result in results for row in result["rows"]],
        "wrong": [line for result in results for line in result["wrong"]],
    }


def kept(path: Path | None, make: Any, *arguments: Any) -> dict[str, Any]:
    """A chunk's result, from its file if the chunk was run before. path: None if `make` keeps its chunks itself."""
    if path is None:
        return dict(make(*arguments))
    if path.is_file():
        return dict(json.loads(path.read_text()))
    result: dict[str, Any] = make(*arguments)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.with_suffix(".new").write_text(json.dumps(result))
    path.with_suffix(".new").rename(path)
    return result


def jobs_of(arguments: argparse.Namespace, folder: Path) -> list[Job]:
    jobs: list[Job] = []
    key = hashlib.sha256(PROGRAM.read_bytes())
    for source in [*sorted((ROOT / "tools" / "faults").glob("*.py")), *sorted((ROOT / "tools" / "g4").glob("*.py"))]:
        key.update(source.read_bytes())
    for experiment in EXPERIMENTS:
        recording = folder / f"{experiment}.rec"
        recording.write_bytes(as_file(record(experiment, arguments.channels)))
        key.update(recording.read_bytes())
    chunks = folder / "chunks" / f"{key.hexdigest()[:16]}-{arguments.seed}"
    for part, share in SHARES.items():
        wanted = round(arguments.count * share / len(EXPERIMENTS))
        for experiment in EXPERIMENTS:
            for first in range(0, wanted, CHUNK):
                count = min(CHUNK, wanted - first)
                name = chunks / f"{experiment}-{part}-{first}-{count}.json"
                jobs.append(
                    ("library", name, library_chunk, (folder / f"{experiment}.rec", arguments.seed, first, count, part))
                )
    for experiment in EXPERIMENTS if arguments.g4 else ():
        count = -(-arguments.g4 // len(EXPERIMENTS))
        rest = (chunks, experiment, arguments.channels, arguments.seed, count)
        jobs.append(("stm32g4", None, g4_part, rest))
    return jobs


def gather(results: list[tuple[str, dict[str, Any]]]) -> dict[str, Any]:
    """All chunks as one report."""
    targets: dict[str, Rows] = defaultdict(lambda: defaultdict(dict))
    wrong: list[str] = []
    for target, result in results:
        wrong += [f"{target}: {line}" for line in result["wrong"]]
        for part, outcome, faults, total, worst in result["rows"]:
            row = targets[target][part].setdefault(outcome, [0, 0, 0])
            row[0], row[1], row[2] = row[0] + faults, row[1] + total, max(row[2], worst)
    totals = {
        target: {
            outcome: {
                "faults": sum(rows[outcome][0] for rows in parts.values() if outcome in rows),
                "worst_cycles": max((rows[outcome][2] for rows in parts.values() if outcome in rows), default=0),
            }
            for outcome in OUTCOMES
        }
        for target, parts in targets.items()
    }
    return {"totals": totals, "parts": targets, "wrong": wrong}


def show(report: dict[str, Any]) -> None:
    for target, totals in report["totals"].items():
        faults = sum(row["faults"] for row in totals.values())
        print(f"{target}, {report['channels']} channel(s), seed {report['seed']}: {faults:,} faults")
        for outcome, row in totals.items():
            print(f"  {outcome:10} {row['faults']:>9,}   reaction at most {row['worst_cycles']} cycles")
    for line in report["wrong"][:20]:
        print(line)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1_000_000, help="faults in the library")
    parser.add_argument("--g4", type=int, default=2000, help="faults in the stm32g4 image")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--channels", type=int, choices=[1, 2], default=2, help="channels of the guard under test")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "faults")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    jobs = jobs_of(arguments, arguments.out)
    with ThreadPoolExecutor(arguments.jobs) as pool:
        done = [(target, pool.submit(kept, name, make, *rest)) for target, name, make, rest in jobs]
        results = [(target, future.result()) for target, future in done]
    report = {
        "seed": arguments.seed,
        "channels": arguments.channels,
        "reaction_cycles": results[0][1]["reaction_cycles"],
        **gather(results),
    }
    (arguments.out / "report.json").write_text(json.dumps(report, indent=1))
    show(report)
    return 1 if arguments.channels == 2 and report["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())

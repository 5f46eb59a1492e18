"""`tauperp replay`: recordings of a real robot through the firmware."""

import argparse
import json
from pathlib import Path
from typing import Any

from tauperp.config import TASKS, Configuration, load_configuration, preset_names
from tauperp.errors import InputError
from tauperp.files import write_atomically
from tauperp.firmware import load_library
from tauperp.provenance import provenance, provenance_line
from tauperp.replay import Playback, Recording, Score, play, read_csv, score
from tauperp.replay.score import FOUND_GOAL, is_good, median_latency_ms
from tauperp.view.watching import add_watch_arguments, watching

HELP = f"""Turn recordings of a real arm (CSV: time, q0.., dq0.., tau_J0.., label while touched) into bus frames at
their own rate, run them through the firmware's guard, and compare its stops with the labels. Draws each recording
and writes replay.json. Exit code 0 if {FOUND_GOAL:.0%} of the touches are found and nothing else stops."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--csv", nargs="+", required=True, metavar="FILE", help="recordings, plain or gzipped")
    parser.add_argument("--robot", metavar="NAME", help="shipped robot, URDF or MJCF, instead of the configuration's")
    parser.add_argument(
        "--config", metavar="FILE", help="TOML file or preset (default: replay_NAME if shipped, else default)"
    )
    parser.add_argument("--task", choices=list(TASKS), default="none", help="task that is sent (default: none)")
    parser.add_argument("--out", default="out/replay", metavar="DIR", help="folder of figures and JSON (out/replay)")
    parser.add_argument("--json", action="store_true", help="print the JSON instead of the table")
    add_watch_arguments(parser)


def run(args: argparse.Namespace) -> int:
    source = args.config or _preset_for(args.robot)
    configuration = load_configuration(source, robot=args.robot)
    recordings = [read_csv(path, configuration.robot.n) for path in args.csv]
    _check_names(recordings)
    if len(recordings) > 1 and (args.view or args.rerun):
        raise InputError("replay: --view and --rerun take one recording at a time")
    with watching(args) as watch:
        playbacks = [play(recording, configuration, task=args.task, watch=watch) for recording in recordings]
    scores = [score(playback) for playback in playbacks]
    report = _report(configuration, playbacks, scores)
    _write(Path(args.out), playbacks, scores, report)
    print(json.dumps(report, indent=2) if args.json else _table(playbacks, scores, report, args.out))
    return 0 if is_good(scores) else 1


def _preset_for(robot: str | None) -> str:
    if robot is None:
        raise InputError("replay: name the arm with --robot, or an installation with --config")
    special = f"replay_{robot}"
    return special if special in preset_names() else "default"


def _check_names(recordings: list[Recording]) -> None:
    """Results are named after the recordings: two of one name would overwrite each other."""
    seen: dict[str, Recording] = {}
    for recording in recordings:
        other = seen.setdefault(recording.name, recording)
        if other is not recording:
            raise InputError(f"{recording.path}: results would overwrite those of {other.path}, of the same name")


def _report(configuration: Configuration, playbacks: list[Playback], scores: list[Score]) -> dict[str, Any]:
    first = playbacks[0]
    library = load_library("float32")
    return {
        "robot": configuration.robot.name,
        "task": first.task,
        "threshold_nm": configuration.threshold_nm(first.task).tolist(),
        "touches": sum(one.touches for one in scores),
        "found": sum(len(one.found) for one in scores),
        "missed": sum(len(one.missed) for one in scores),
        "alarms_idle": sum(len(one.alarms) for one in scores),
        "input_stops": sum(len(one.input_stops) for one in scores),
        "idle_s": round(sum(one.idle_s for one in scores), 3),
        "median_latency_ms": median_latency_ms(scores),
        "files": [
            {
                "file": playback.recording.name,
                "rate_hz": playback.configuration.settings.wire.rate_hz,
                "offset_nm": [round(value, 3) for value in playback.offset_nm.tolist()],
                **one.report(),
                "counters": playback.counters,
                "hashes": provenance(library, playback.configuration),
            }
            for playback, one in zip(playbacks, scores, strict=True)
        ],
    }


def _write(out: Path, playbacks: list[Playback], scores: list[Score], report: dict[str, Any]) -> None:
    from tauperp.view.replay_figure import replay_figure  # matplotlib takes its time: not before the input is good

    for playback, one in zip(playbacks, scores, strict=True):
        write_atomically(out / f"{playback.recording.name}.png", replay_figure(playback, one))
    write_atomically(out / "replay.json", json.dumps(report, indent=2) + "\n")


def _table(playbacks: list[Playback], scores: list[Score], report: dict[str, Any], out: str) -> str:
    width = max(9, *(len(playback.recording.name) + 2 for playback in playbacks))
    lines = [f"{'file':<{width}}{'touches':>8}{'found':>7}{'missed':>8}{'idle s':>8}{'alarms':>8}{'median ms':>11}"]
    rows = [(playback.recording.name, one.report()) for playback, one in zip(playbacks, scores, strict=True)]
    for name, row in [*rows, ("all", report)]:
        latency = "-" if row["median_latency_ms"] is None else f"{row['median_latency_ms']:.0f}"
        lines.append(
            f"{name:<{width}}{row['touches']:>8}{row['found']:>7}{row['missed']:>8}{row['idle_s']:>8.1f}"
            f"{row['alarms_idle']:>8}{latency:>11}"
        )
    if report["input_stops"]:
        lines.append(f"stops by an input at fault: {report['input_stops']} (see inputs in replay.json)")
    thresholds = " ".join(f"{value:g}" for value in report["threshold_nm"])
    lines.append(f"task {report['task']}, thresholds {thresholds} Nm; figures and replay.json in {out}")
    lines.append(provenance_line(report["files"][0]["hashes"]))
    return "\n".join(lines)

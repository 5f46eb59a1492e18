"""`tauperp replay`: bus logs, and recordings of a real robot, through the firmware."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from tauperp.cli import BAD_INPUT
from tauperp.config import TASKS, Configuration, TaskName, load_configuration, preset_names
from tauperp.errors import InputError
from tauperp.files import write_atomically
from tauperp.firmware import load_library
from tauperp.provenance import provenance, provenance_line
from tauperp.replay import Playback, Recording, Score, log_report, play, read_recording, score
from tauperp.replay.score import FOUND_GOAL, is_good, median_latency_ms
from tauperp.view.watching import add_watch_arguments, watching

HELP = f"""LOG: push a bus log through the firmware's guard and compare what it sends with the guard's frames in the
log, bit for bit. Exit code 0 if all are equal. --csv: turn recordings of a real arm (time, q0.., dq0.., tau_J0.., label
while touched, or what --map says) into bus frames at their own rate, run them through the guard, and compare its stops
with the labels; draws each recording and writes replay.json. Exit code 0 if {FOUND_GOAL:.0%} of the touches are found
and nothing else stops."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("log", nargs="?", metavar="LOG", help="bus log: .blf, .asc, .log, whatever python-can reads")
    parser.add_argument("--csv", nargs="+", metavar="FILE", help="recordings: .csv, .csv.gz, .npz, .parquet, .mcap")
    parser.add_argument("--map", metavar="FILE", help="TOML file of the recordings' columns, units and signs")
    parser.add_argument("--robot", metavar="NAME", help="shipped robot, URDF or MJCF, instead of the configuration's")
    parser.add_argument(
        "--config", metavar="FILE", help="TOML file or preset (default: the log's or replay_NAME if shipped)"
    )
    parser.add_argument("--scenario", metavar="NAME", help="the log is of this scenario: use its configuration")
    parser.add_argument("--task", choices=list(TASKS), help="task that is sent with recordings (default: none)")
    parser.add_argument("--out", metavar="DIR", help="folder of the recordings' figures and JSON (out/replay)")
    parser.add_argument("--json", action="store_true", help="print the JSON instead of the table")
    add_watch_arguments(parser)


def run(args: argparse.Namespace) -> int:
    if (args.log is None) == (args.csv is None):
        raise InputError("replay: name either one bus log or, with --csv, recordings")
    _refuse_foreign_options(args)
    return _replay_log(args) if args.csv is None else _replay_recordings(args)


def _refuse_foreign_options(args: argparse.Namespace) -> None:
    """An option that would have no effect is a mistake of who gave it."""
    foreign = ("scenario",) if args.log is None else ("map", "task", "out")
    for name in foreign:
        if getattr(args, name) is not None:
            kind = "bus logs" if args.log is None else "recordings (--csv)"
            raise InputError(f"replay: --{name} goes with {kind}")
    if args.csv is not None and len(args.csv) > 1 and (args.view or args.rerun is not None):
        raise InputError("replay: --view and --rerun show one recording; each begins at its own time 0")
    if args.scenario is not None and args.config is not None:
        raise InputError("replay: name either --config or --scenario")


def _replay_log(args: argparse.Namespace) -> int:
    with watching(args) as watch:
        replay = log_report.replay_log(
            args.log, config=args.config, robot=args.robot, scenario=args.scenario, watch=watch
        )
    if args.json:
        print(json.dumps(log_report.report(replay), indent=2))
    else:
        print("\n".join(log_report.lines(replay)))
    if replay.damage is not None:
        return _say_damage([replay.damage])
    return 0 if replay.equal else 1


def _replay_recordings(args: argparse.Namespace) -> int:
    source, out = args.config or _preset_for(args.robot), args.out or "out/replay"
    task: TaskName = args.task or "none"
    configuration = load_configuration(source, robot=args.robot)
    recordings = [read_recording(path, configuration.robot.n, args.map) for path in args.csv]
    _check_names(recordings)
    with watching(args) as watch:
        playbacks = [play(recording, configuration, task=task, watch=watch) for recording in recordings]
    scores = [score(playback) for playback in playbacks]
    report = _report(configuration, playbacks, scores)
    _write(Path(out), playbacks, scores, report)
    print(json.dumps(report, indent=2) if args.json else _table(playbacks, scores, report, out))
    damages = [recording.damage for recording in recordings if recording.damage is not None]
    if damages:
        return _say_damage(damages)
    return 0 if is_good(scores) else 1


def _say_damage(damages: list[str]) -> int:
    """What could be read has been reported: the rest is bad input."""
    sys.stdout.flush()
    for damage in damages:
        print(f"tauperp: {damage}", file=sys.stderr)
    return BAD_INPUT


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
                "damage": playback.recording.damage,
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

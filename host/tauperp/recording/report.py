"""Results of scored recordings: JSON and a table for the terminal."""

import dataclasses
from typing import Any

from tauperp.config import Configuration, TaskName
from tauperp.firmware import load_library
from tauperp.provenance import provenance, provenance_line
from tauperp.recording.playback import Playback
from tauperp.recording.score import Score, faults, median_latency_ms


@dataclasses.dataclass(frozen=True, eq=False)
class Scored:
    """One recording that was played, and the check of its columns."""

    playback: Playback
    score: Score
    checks: list[str]

    @property
    def name(self) -> str:
        return self.playback.recording.name


def report(
    configuration: Configuration, task: TaskName, scored: list[Scored], refused: dict[str, str]
) -> dict[str, Any]:
    """For score.json; `refused` by file, with the reason."""
    scores = [one.score for one in scored]
    library = load_library("float32")
    said = faults(scores)
    return {
        "robot": configuration.robot.name,
        "task": task,
        "index": configuration.settings.task[task].index,
        "threshold_nm": configuration.thresholds_nm(task).tolist(),
        "verdict": "bad" if said else "good",
        "faults": said,
        "touches": sum(one.touches for one in scores),
        "found": sum(len(one.found) for one in scores),
        "missed": sum(len(one.missed) for one in scores),
        "missed_while_stopped": sum(len(one.untested) for one in scores),
        "alarms_idle": sum(len(one.alarms) for one in scores),
        "input_stops": sum(len(one.input_stops) for one in scores),
        "idle_s": round(sum(one.idle_s for one in scores), 3),
        "permitted_share": _share(sum(one.permitted_s for one in scores), sum(one.idle_s for one in scores)),
        "above_threshold_share": _share(sum(one.above_s for one in scores), sum(one.judged_s for one in scores)),
        "median_latency_ms": median_latency_ms(scores),
        "files": [_file(one) for one in scored],
        "refused": [{"file": name, "why": why} for name, why in refused.items()],
        "hashes": provenance(library, configuration),
    }


def _file(one: Scored) -> dict[str, Any]:
    playback = one.playback
    return {
        "file": one.name,
        "damage": playback.recording.damage,
        "notes": list(playback.recording.notes),
        "rate_hz": playback.configuration.settings.wire.rate_hz,
        "offsets": playback.offsets.report(),
        "gaps": playback.timeline.report(),
        **one.score.report(),
        "checks": one.checks,
        "counters": playback.counters,
        "hashes": provenance(load_library("float32"), playback.configuration),
    }


def _share(part: float, whole: float) -> float:
    return round(part / whole, 4) if whole > 0 else 0.0


def lines(content: dict[str, Any], out: str) -> list[str]:
    """For a terminal."""
    width = max(9, *(len(row["file"]) + 2 for row in content["files"]))
    text = [
        f"{'file':<{width}}{'touches':>8}{'found':>7}{'missed':>8}{'idle s':>8}{'permitted':>11}{'above':>8}"
        f"{'alarms':>8}{'median ms':>11}"
    ]
    for row in [*content["files"], {"file": "all", **content}]:
        latency = "-" if row["median_latency_ms"] is None else f"{row['median_latency_ms']:.0f}"
        text.append(
            f"{row['file']:<{width}}{row['touches']:>8}{row['found']:>7}{row['missed']:>8}{row['idle_s']:>8.1f}"
            f"{100 * row['permitted_share']:>9.1f} %{100 * row['above_threshold_share']:>6.1f} %"
            f"{row['alarms_idle']:>8}{latency:>11}"
        )
    for row in content["files"]:
        text.append(f"{row['file']}: offsets {row['offsets']['told']}")
        shares = " ".join(f"{value:.2f}" for value in row["largest_share_of_threshold"])
        text.append(f"{row['file']}: largest index of each joint, of its threshold: {shares}")
        gaps = row["gaps"]
        if gaps["count"]:
            worst = max(gaps["longest"], key=lambda gap: gap["length_ms"])
            text.append(
                f"{row['file']}: {gaps['count']} gaps, {gaps['bridged']} bridged, {gaps['split']} split the recording; "
                f"the longest {worst['length_ms']:g} ms at {worst['start_s']:g} s"
            )
        for one in row["missed_while_stopped_touches"]:
            text.append(
                f"{row['file']}: the touch at {one['start_s']:.2f} s met a guard stopped since "
                f"{one['stopped_since_s']:.2f} s: {one['reason']}"
            )
    text += [f"refused: {one['why']}" for one in content["refused"]]
    thresholds = " | ".join(" ".join(f"{value:g}" for value in row) for row in content["threshold_nm"])
    text.append(f"task {content['task']} ({content['index']}), thresholds {thresholds} Nm; above: share of the")
    text.append(f"untouched time with an index above its threshold; figures and score.json in {out}")
    text.append(f"verdict: {content['verdict']}" + "".join(f"; {fault}" for fault in content["faults"]))
    text.append(provenance_line(content["hashes"]))
    return text

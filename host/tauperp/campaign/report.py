"""The report of a finished campaign: JSON, PNG, one self-contained HTML page, and a table for the terminal."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tauperp import page
from tauperp.campaign.contact import class_rows, contact_line, link_rows
from tauperp.campaign.execute import Effort
from tauperp.campaign.injection import Injected, as_hits
from tauperp.campaign.plan import Plan
from tauperp.campaign.store import BY_JOINT, Store, row_type
from tauperp.campaign.summary import found_in_time, guard_delay, judged, summarise
from tauperp.campaign.work import Comparison, Thresholds, comparison, shards
from tauperp.config import TaskName
from tauperp.files import write_atomically
from tauperp.firmware import load_library
from tauperp.kernel import layout
from tauperp.kernel.bench import Rows
from tauperp.provenance import provenance, provenance_line


def write_report(plan: Plan, store: Store, thresholds: Thresholds, effort: Effort) -> dict[str, Any]:
    """Read all shards, write report.json, report.png and report.html into the folder. Returns the report."""
    outcomes = [
        Outcome(
            task,
            store.read([shard for shard in shards(plan, ("free",)) if shard.task == task]),
            store.read([shard for shard in shards(plan, ("hit",)) if shard.task == task]),
            comparison(plan, task, thresholds),
        )
        for task in plan.file.tasks
    ]
    return _write(plan, store.folder, outcomes, effort)


def write_injection_report(plan: Plan, folder: Path, injected: Sequence[Injected]) -> dict[str, Any]:
    """The same for pushes into recordings."""
    kind = row_type(plan.configuration.robot.n)
    outcomes = []
    for one in injected:
        free = np.zeros(len(one.free), kind)
        for name in set(kind.names or ()) & set(one.free.dtype.names or ()):
            free[name] = one.free[name][:, :, : free[name].shape[2]] if name in BY_JOINT else one.free[name]
        free["status"] = layout.DONE
        outcomes.append(Outcome(one.task, free, as_hits(one, kind), one.compared))
    return _write(plan, folder, outcomes, Effort())


@dataclass(frozen=True, eq=False)
class Outcome:
    """Rows of one task: moves without and with a push, and the detectors that ran in them."""

    task: TaskName
    free: Rows
    hits: Rows
    compared: Comparison


def _write(plan: Plan, folder: Path, outcomes: Sequence[Outcome], effort: Effort) -> dict[str, Any]:
    from tauperp.campaign.figure import campaign_figure

    summaries: list[dict[str, Any]] = []
    delays: dict[str, list[npt.NDArray[np.float64]]] = {}
    for one in outcomes:
        detectors = one.compared.detectors
        limits = [[round(float(value), 3) for value in detector.threshold_nm] for detector in detectors]
        summaries.append(summarise(one.task, one.free, one.hits, [detector.name for detector in detectors], limits))
        if plan.file.recording is not None:  # a push ends at the stop, before the guard identifies it
            summaries[-1]["contact"] = None
        delays[one.task] = [_found_after(judged(one.hits), k) for k in range(len(detectors))]
    library = load_library(plan.file.numeric)
    configuration = outcomes[0].compared.configurations[0]
    recording = plan.file.recording
    report = {
        "plan": str(plan.path),
        "digest": plan.digest,
        "robot": plan.configuration.robot.name,
        "assumed": list(plan.assumed) if recording is None else [],
        "rate_hz": configuration.settings.wire.rate_hz,
        "sensors": str(plan.sensors) if recording is None else "as recorded: " + ", ".join(recording.files),
        "thresholds_from": plan.file.thresholds.source if recording is None else "the first part of each recording",
        "tasks": summaries,
        "effort": effort.as_dict(),
        "hashes": provenance(library, configuration),
    }
    kind = "collisions" if recording is None else "pushes into recordings"
    title = f"{report['robot']}: {sum(s['collisions'] for s in summaries)} {kind}, seed {plan.file.seed}"
    png = campaign_figure(summaries, delays, title)
    write_atomically(folder / "report.json", json.dumps(report, indent=2) + "\n")
    write_atomically(folder / "report.png", png)
    write_atomically(folder / "report.html", _html(title, report, png))
    return report


def _found_after(hits: Rows, number: int) -> npt.NDArray[np.float64]:
    """Seconds from onset to excess of the collisions that a detector found and had not reported before."""
    rows = hits[~np.isfinite(hits["early_s"][:, number])]
    delay = guard_delay(rows) if number == 0 else rows["delay_s"][:, number]
    result: npt.NDArray[np.float64] = delay[found_in_time(rows, delay)]
    return result


def percent(one: dict[str, Any]) -> str:
    """A rate with its interval, for people."""
    if one["rate"] is None:
        return "-"
    return f"{100 * one['rate']:.1f} % ({100 * one['rate_low']:.1f}-{100 * one['rate_high']:.1f})"


def spread(one: dict[str, Any], level: str) -> str:
    """A quantile with its interval."""
    value = one[level]
    return "-" if value is None else f"{value[0]:.0f} ({value[1]:.0f}-{value[2]:.0f})"


def _per_hour(one: dict[str, Any]) -> str:
    if one["per_hour"] is None:
        return "-"
    return f"{one['per_hour']:.1f} ({one['per_hour_low']:.1f}-{one['per_hour_high']:.1f})"


_HEADER = ("found", "n", "median ms", "p95 ms", "force at detection N")


def _cells(one: dict[str, Any]) -> list[str]:
    latency = one["latency_ms"]
    return [
        percent(one),
        str(one["of"]),
        spread(latency, "p50"),
        spread(latency, "p95"),
        spread(one["force_at_detection_n"], "p50"),
    ]


def lines(report: dict[str, Any]) -> list[str]:
    """The result for a terminal, 95 % intervals in brackets."""
    text = [f"{'task':<9}{'found':<24}{'n':>7}  {'median ms':<14}{'p95 ms':<16}{'false stops per hour':<24}"]
    for one in report["tasks"]:
        latency = one["latency_ms"]
        text.append(
            f"{one['task']:<9}{percent(one):<24}{one['of']:>7}  {spread(latency, 'p50'):<14}"
            f"{spread(latency, 'p95'):<16}{_per_hour(one['false_stops']):<24}"
        )
        if one["false_stops"]["input_stops"]:
            text.append(
                f"         stops for an input (missing, frozen, implausible): {one['false_stops']['input_stops']}"
            )
        if one["contact"] is not None:
            text.append("         " + contact_line(one["contact"]))
        others = {name: count for name, count in one["statuses"].items() if name != "done"}
        if others:
            text.append("         not judged: " + ", ".join(f"{name} {count}" for name, count in others.items()))
    effort = report["effort"]
    if effort["times_real_time_per_core"] is not None:
        text.append(
            f"{effort['runs_of_this_process']} runs, {effort['simulated_s']:.0f} s simulated in "
            f"{effort['wall_s']:.0f} s: {effort['times_real_time_per_core']:g} times real time on each core"
        )
    text += report["assumed"]
    text.append(provenance_line(report["hashes"]))
    return text


def _html(title: str, report: dict[str, Any], png: bytes) -> str:
    parts = [
        page.note(
            f"Thresholds from {report['thresholds_from'].replace('_', ' ')}. Rates with Wilson's 95 % interval, "
            "quantiles with that of their order statistics, stops per hour with the exact Poisson interval. "
            "A collision counts as found if the guard stops during the push or within 0.1 s after it."
        ),
        page.figure(png, "ROC, latencies, links and heat map of each task"),
        *(page.note(sentence) for sentence in report["assumed"]),
    ]
    for one in report["tasks"]:
        stops = one["false_stops"]
        parts.append(page.heading(f"Task {one['task']}"))
        parts.append(
            page.note(
                f"{one['collisions']} collisions: "
                + ", ".join(f"{count} {name}" for name, count in one["statuses"].items())
                + f". False stops: {stops['stops']} in {stops['hours']:.2f} h of free motion, {_per_hour(stops)} per "
                + f"hour; {stops['moves_with_a_stop']} of {stops['moves']} judged free moves. "
                + f"Stops for an input that was missing, frozen or implausible: {stops['input_stops']}."
            )
        )
        rows = [["all", *_cells(one)]]
        rows += [[f"link {group['link']}", *_cells(group)] for group in one["by_link"]]
        rows += [[_range(group, "N"), *_cells(group)] for group in one["by_force"]]
        rows += [[_range(group, "kg"), *_cells(group)] for group in one["by_payload"]]
        rows += [[group["kind"], *_cells(group)] for group in one["by_kind"]]
        parts.append(page.table(("", *_HEADER), rows))
        if one["contact"] is not None:
            parts += _contact_parts(one["contact"])
        compared = [
            [
                detector["detector"],
                percent(detector),
                spread(detector["latency_ms"], "p50"),
                spread(detector["latency_ms"], "p95"),
                f"{detector['false_moves']} of {detector['moves']}",
                " ".join(f"{value:g}" for value in detector["threshold_nm"]),
            ]
            for detector in one["detectors"]
        ]
        parts.append(page.table(("detector", "found", "median ms", "p95 ms", "false moves", "thresholds Nm"), compared))
    parts.append(page.note(provenance_line(report["hashes"]) + f"; plan {report['digest']}; {report['sensors']}"))
    return page.page(title, parts)


def _contact_parts(contact: dict[str, Any]) -> list[str]:
    """What the guard said of the contacts."""
    return [
        page.table(("hit", "not known", *(f"reported {link}" for link in contact["links"])), link_rows(contact)),
        page.table(("push", *(name.lower() for name in contact["classes"])), class_rows(contact)),
        page.note(_force_note(contact)),
    ]


def _force_note(contact: dict[str, Any]) -> str:
    angle, ratio = contact["direction_error_deg_p50"], contact["force_over_true_p50"]
    if angle is None:
        return "No force was estimated on the right link."
    return (
        f"Force on the correctly identified links: median error of its direction {angle:g} degrees, median of its size "
        f"over the true one {'-' if ratio is None else f'{ratio:g}'}."
    )


def _range(group: dict[str, Any], unit: str) -> str:
    return (
        f"{group['from']:g} {unit} and more" if group["to"] is None else f"{group['from']:g} to {group['to']:g} {unit}"
    )


def folder_of(out: str | None, plan: Plan) -> Path:
    """Default folder of the results."""
    return Path(out) if out else Path("out") / "campaign" / plan.path.stem

"""From stored rows to the figures of the report: rates with intervals, latencies, comparison, ROC."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from tauperp.campaign.contact import contact_summary
from tauperp.firmware import DETECTION_REASONS, Reason
from tauperp.intervals import poisson, quantile, wilson
from tauperp.kernel import layout
from tauperp.kernel.bench import Rows

LATE_S = 0.1  # after the end of a push a stop no longer counts as found
FORCE_EDGES_N = (0.0, 20.0, 40.0, 60.0, 80.0, 100.0, math.inf)
PAYLOAD_EDGES_KG = (0.0, 0.5, 1.0, 2.0, 3.0, math.inf)
ROC_POINTS = 200

BoolArray = npt.NDArray[np.bool_]


def judged(hits: Rows) -> Rows:
    """The collisions that can be judged: the guard permitted motion until something touched the arm."""
    return hits[hits["status"] == layout.DONE]


def found_in_time(rows: Rows, delay_s: npt.NDArray[np.float64]) -> BoolArray:
    """Whether a detector's first excess came during the push, or at most LATE_S after it."""
    with np.errstate(invalid="ignore"):
        result: BoolArray = delay_s <= rows["release_s"] - rows["onset_s"] + LATE_S
    return result


def guard_delay(rows: Rows) -> npt.NDArray[np.float64]:
    """From the onset to the stop, s; NaN without one. A stop because of an input finds nothing."""
    found = np.isin(rows["reason"], DETECTION_REASONS)
    result: npt.NDArray[np.float64] = np.where(found, rows["stop_s"] - rows["onset_s"], np.nan)
    return result


def share(found: BoolArray) -> dict[str, Any]:
    """A rate with its interval."""
    low, high = wilson(int(found.sum()), len(found))
    return {
        "found": int(found.sum()),
        "of": len(found),
        "rate": None if len(found) == 0 else round(float(found.mean()), 4),
        "rate_low": round(low, 4),
        "rate_high": round(high, 4),
    }


def _spread(values: npt.NDArray[np.float64], digits: int = 1) -> dict[str, Any]:
    """Median and 95th percentile with intervals; None without samples."""
    if len(values) == 0:
        return {"p50": None, "p95": None}
    return {
        f"p{round(100 * level)}": [round(value, digits) for value in quantile(values, level)] for level in (0.5, 0.95)
    }


def _group(rows: Rows) -> dict[str, Any]:
    delay = guard_delay(rows)
    found = found_in_time(rows, delay)
    return {
        **share(found),
        "latency_ms": _spread(1000 * delay[found]),
        "force_at_detection_n": _spread(rows["force_at_stop_n"][found]),
    }


def _bins(rows: Rows, values: npt.NDArray[np.float64], edges: tuple[float, ...]) -> list[dict[str, Any]]:
    groups = []
    for low, high in pairwise(edges):
        inside = rows[(values >= low) & (values < high)]
        if len(inside):
            groups.append({"from": low, "to": None if math.isinf(high) else high, **_group(inside)})
    return groups


def _false_stops(free: Rows, hits: Rows) -> dict[str, Any]:
    """Stops without a contact: in the judged free moves, and before the onset of the collisions."""
    both = np.concatenate([free, hits])
    both = both[np.isin(both["status"], (layout.DONE, layout.FALSE_STOP, layout.NOT_TOUCHED))]
    stops, hours = int(both["stops"].sum()), float(both["free_s"].sum()) / 3600
    low, high = poisson(stops, hours)
    moves = free[np.isin(free["status"], (layout.DONE, layout.FALSE_STOP))]
    moved = moves["stops"] > 0
    low_share, high_share = wilson(int(moved.sum()), len(moved))
    return {
        "stops": stops,
        "input_stops": int(both["input_stops"].sum()),
        "hours": round(hours, 4),
        "per_hour": None if hours == 0 else round(stops / hours, 2),
        "per_hour_low": round(low, 2),
        "per_hour_high": None if math.isinf(high) else round(high, 2),
        "moves_with_a_stop": int(moved.sum()),
        "moves": len(moved),
        "share_low": round(low_share, 4),
        "share_high": round(high_share, 4),
    }


def _compared(free: Rows, hits: Rows, number: int, name: str, threshold: list[float] | None) -> dict[str, Any]:
    """One detector on the signals of the same runs. Collisions that it reported before the onset are not counted."""
    early = np.isfinite(hits["early_s"][:, number])
    late = hits[~early]
    delay = late["delay_s"][:, number]
    found = found_in_time(late, delay)
    moves = free[np.isin(free["status"], (layout.DONE, layout.FALSE_STOP))]
    false = np.isfinite(moves["early_s"][:, number])
    low, high = wilson(int(false.sum()), len(false))
    return {
        "detector": name,
        "threshold_nm": threshold,
        **share(found),
        "latency_ms": _spread(1000 * delay[found]),
        "false_moves": int(false.sum()),
        "moves": len(false),
        "false_share": round(float(false.mean()), 4) if len(false) else None,
        "false_low": round(low, 4),
        "false_high": round(high, 4),
        "early": int(early.sum()),
    }


def roc(free: Rows, hits: Rows, number: int) -> dict[str, list[float]]:
    """Share of collisions found over share of free moves stopped, for all thresholds scaled by one factor.

    Peaks only, without debounce and latency. A move that the guard stopped counts up to its stop.
    """
    moves = free[np.isin(free["status"], (layout.DONE, layout.FALSE_STOP))]["before"][:, number]
    peaks = hits["during"][:, number]
    if len(moves) == 0 or len(peaks) == 0:
        return {"scale": [], "false": [], "found": []}
    scales = np.unique(np.quantile(np.concatenate([moves, peaks]), np.linspace(0, 1, ROC_POINTS)))
    return {
        "scale": [round(float(value), 4) for value in scales],
        "false": [round(float((moves > scale).mean()), 5) for scale in scales],
        "found": [round(float((peaks > scale).mean()), 5) for scale in scales],
    }


def summarise(task: str, free: Rows, all_hits: Rows, names: list[str], thresholds: list[list[float]]) -> dict[str, Any]:
    """All results of one task."""
    hits = judged(all_hits)
    statuses, reasons = np.bincount(all_hits["status"], minlength=len(layout.STATUSES)), hits["reason"]
    stopped = np.isfinite(hits["stop_s"])
    links = sorted({int(link) + 1 for link in hits["planned_link"]})
    return {
        "task": task,
        "collisions": len(all_hits),
        "statuses": {name: int(count) for name, count in zip(layout.STATUSES, statuses, strict=True) if count},
        "reasons": {
            Reason(int(reason)).name: int((reasons[stopped] == reason).sum()) for reason in np.unique(reasons[stopped])
        },
        **_group(hits),
        "false_stops": _false_stops(free, all_hits),
        "by_link": [{"link": link, **_group(hits[hits["planned_link"] == link - 1])} for link in links],
        "by_force": _bins(hits, hits["force_n"], FORCE_EDGES_N),
        "by_payload": _bins(hits, hits["payload_kg"], PAYLOAD_EDGES_KG) if task == "payload" else [],
        "by_kind": [
            {"kind": kind, **_group(hits[hits["push"] == number])}
            for kind, number in layout.PUSHES.items()
            if (hits["push"] == number).any()
        ],
        "heat_map": _heat_map(hits, links),
        "contact": contact_summary(hits[np.isin(reasons, DETECTION_REASONS) & stopped]),
        "detectors": [
            {**_compared(free, hits, k, name, thresholds[k]), "roc": roc(free, hits, k)} for k, name in enumerate(names)
        ],
    }


def _heat_map(hits: Rows, links: list[int]) -> dict[str, Any]:
    """Detection rate by link (rows) and force (columns)."""
    found = found_in_time(hits, guard_delay(hits))
    edges = [edge for edge in FORCE_EDGES_N if math.isfinite(edge)]
    rate: list[list[float | None]] = []
    count: list[list[int]] = []
    for link in links:
        row: list[float | None] = []
        numbers: list[int] = []
        for low, high in pairwise(FORCE_EDGES_N):
            inside = (hits["planned_link"] == link - 1) & (hits["force_n"] >= low) & (hits["force_n"] < high)
            row.append(round(float(found[inside].mean()), 4) if inside.any() else None)
            numbers.append(int(inside.sum()))
        rate.append(row)
        count.append(numbers)
    return {"links": links, "edges_n": edges, "rate": rate, "count": count}

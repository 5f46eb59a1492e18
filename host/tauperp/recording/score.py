"""The score of a played recording: touches found and missed, alarms while nobody touched the arm, and how much was
tested.

A stopped guard finds nothing and raises no alarm. Every score therefore states the share of time in which the guard
permitted motion, the share in which the index was above its threshold (independent of the latch), and the touches
during which the guard was still stopped. A recording in which nothing was tested is not good.
"""

import dataclasses
import statistics
from typing import Any

import numpy as np
import numpy.typing as npt

from tauperp.firmware import DETECTION_REASONS, Reason
from tauperp.recording.playback import Playback, Trip
from tauperp.recording.recording import FloatArray, Touch

FOUND_GOAL = 0.9  # share of the labelled touches
TESTED_GOAL = 0.5  # share of the untouched time with permission, below which a recording counts as not tested
AFTER_TOUCH_S = 0.2  # in which the index decreases again


@dataclasses.dataclass(frozen=True)
class Untested:
    """A touch during which the guard did not permit motion, and why it did not."""

    touch: Touch
    reason: Reason
    since_s: float  # of the stop, or of the start of the recording


@dataclasses.dataclass(frozen=True, eq=False)
class Score:
    """A touch is found by a trip for a contact while it lasts. Any other trip is an alarm; or an input stop, if an
    input was the cause and not the index. Without labels every trip for a contact is an alarm. Untested touches are
    among the missed ones."""

    found: tuple[tuple[Touch, Trip], ...]
    missed: tuple[Touch, ...]
    untested: tuple[Untested, ...]
    alarms: tuple[Trip, ...]
    input_stops: tuple[Trip, ...]
    idle_s: float  # nobody touches the arm
    permitted_s: float  # of it with permission
    above_s: float  # of it, from AFTER_TOUCH_S after a touch, with an index above its threshold
    judged_s: float  # of it, from AFTER_TOUCH_S after a touch, that every stage evaluated
    largest_index_nm: FloatArray  # (n,) in judged_s
    largest_share: FloatArray  # (n,) of the threshold in force, in judged_s
    waited_for: Reason  # main reason of missing permission in the untouched time; NONE if there was none

    @property
    def touches(self) -> int:
        return len(self.found) + len(self.missed)

    @property
    def permitted_share(self) -> float:
        return self.permitted_s / self.idle_s if self.idle_s > 0 else 0.0

    @property
    def above_share(self) -> float:
        return self.above_s / self.judged_s if self.judged_s > 0 else 0.0

    @property
    def faults(self) -> list[str]:
        """Why the verdict on this recording alone is bad, apart from missed touches; empty if it is good."""
        said = []
        if self.permitted_s == 0:
            said.append(f"nothing was tested: the guard never permitted motion ({self.waited_for.name})")
        elif self.permitted_share < TESTED_GOAL:
            said.append(
                f"tested for {self.permitted_share:.0%} of the untouched time only: the guard was stopped for the rest "
                f"({self.waited_for.name})"
            )
        if self.alarms:
            said.append(f"{len(self.alarms)} alarms")
        if self.input_stops:
            first = self.input_stops[0]
            said.append(f"{len(self.input_stops)} stops by an input ({first.detail or first.reason.name})")
        return said

    def report(self) -> dict[str, Any]:
        """As JSON: counts, and the moments of each touch and alarm, s."""
        return {
            "touches": self.touches,
            "found": len(self.found),
            "missed": len(self.missed),
            "missed_while_stopped": len(self.untested),
            "alarms_idle": len(self.alarms),
            "input_stops": len(self.input_stops),
            "idle_s": round(self.idle_s, 3),
            "permitted_s": round(self.permitted_s, 3),
            "permitted_share": round(self.permitted_share, 4),
            "not_permitted_for": self.waited_for.name,
            "above_threshold_s": round(self.above_s, 3),
            "above_threshold_share": round(self.above_share, 4),
            "largest_index_nm": _rounded(self.largest_index_nm),
            "largest_share_of_threshold": _rounded(self.largest_share),
            "faults": self.faults,
            "median_latency_ms": median_latency_ms([self]),
            "found_touches": [
                {
                    "start_s": touch.start_s,
                    "end_s": touch.end_s,
                    "stop_s": trip.time_s,
                    "latency_ms": round(_latency_ms(touch, trip), 1),
                    "joint": trip.joint,
                    "index_nm": round(trip.index_nm, 3),
                    "threshold_nm": round(trip.threshold_nm, 3),
                }
                for touch, trip in self.found
            ],
            "missed_touches": [{"start_s": touch.start_s, "end_s": touch.end_s} for touch in self.missed],
            "missed_while_stopped_touches": [
                {
                    "start_s": one.touch.start_s,
                    "end_s": one.touch.end_s,
                    "reason": one.reason.name,
                    "stopped_since_s": round(one.since_s, 3),
                }
                for one in self.untested
            ],
            "alarms": [_moment(trip) for trip in self.alarms],
            "inputs": [_moment(trip) for trip in self.input_stops],
        }


def score(playback: Playback) -> Score:
    """Compare the trips with the labels, and measure what was tested."""
    recording = playback.recording
    first: dict[Touch, Trip] = {}
    alarms = []
    for trip in playback.trips:
        if trip.reason not in DETECTION_REASONS:
            continue
        touch = recording.touch_at(trip.row)
        if touch is None:
            alarms.append(trip)
        else:
            first.setdefault(touch, trip)
    missed = tuple(touch for touch in recording.touches if touch not in first)
    lengths = _lengths_s(recording.time_s, recording.period_us)
    idle, judged = _untouched(playback)
    without = idle & ~playback.permitted
    reasons = np.bincount(playback.reason[without], weights=lengths[without], minlength=1)
    above = judged & (np.abs(playback.index) > playback.threshold).any(axis=1)
    share = np.abs(playback.index[judged]) / np.maximum(playback.threshold[judged], 1e-9)
    n = playback.index.shape[1]
    return Score(
        found=tuple(first.items()),
        missed=missed,
        untested=tuple(one for touch in missed if (one := _untested(playback, touch)) is not None),
        alarms=tuple(alarms),
        input_stops=tuple(trip for trip in playback.trips if trip.reason not in DETECTION_REASONS),
        idle_s=float(lengths[idle].sum()),
        permitted_s=float(lengths[idle & playback.permitted].sum()),
        above_s=float(lengths[above].sum()),
        judged_s=float(lengths[judged].sum()),
        largest_index_nm=np.abs(playback.index[judged]).max(axis=0, initial=0.0) if n else np.zeros(0),
        largest_share=share.max(axis=0, initial=0.0),
        waited_for=Reason(int(np.argmax(reasons))) if without.any() else Reason.NONE,
    )


def _lengths_s(time_s: FloatArray, period_us: int) -> FloatArray:
    """The time until the next row; a gap counts as one period."""
    period_s = period_us * 1e-6
    return np.minimum(np.append(np.diff(time_s), period_s), 2 * period_s)


def _untouched(playback: Playback) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Rows in which nobody touches the arm; and those of them in which a correct index must show it."""
    recording = playback.recording
    idle = np.ones(len(recording.time_s), bool) if recording.touched is None else ~recording.touched
    judged = idle & playback.evaluated & (playback.threshold > 0).all(axis=1)
    settling_s = playback.configuration.settling_us * 1e-6
    for start in playback.timeline.starts:  # until the observer of a new guard has forgotten its start
        begin_s = recording.time_s[start]
        judged &= (recording.time_s < begin_s) | (recording.time_s >= begin_s + settling_s)
    for touch in recording.touches:
        judged &= (recording.time_s < touch.end_s) | (recording.time_s >= touch.end_s + AFTER_TOUCH_S)
    return idle, judged


def _untested(playback: Playback, touch: Touch) -> Untested | None:
    """None if the guard permitted motion at the start of the touch or at any time during it."""
    rows = slice(max(0, touch.first - 1), touch.last)
    if playback.permitted[rows].any():
        return None
    before = np.flatnonzero(playback.permitted[: touch.first])
    since = int(before[-1]) + 1 if len(before) else 0
    stopped_by = [trip for trip in playback.trips if trip.row <= touch.first]
    reason = stopped_by[-1].reason if stopped_by and len(before) else Reason(int(playback.reason[touch.first]))
    return Untested(touch, reason, float(playback.recording.time_s[since]))


def median_latency_ms(scores: list[Score]) -> float | None:
    """From the start of the label to the trip, for every touch found; None without any."""
    latencies = [_latency_ms(touch, trip) for one in scores for touch, trip in one.found]
    return round(statistics.median(latencies), 1) if latencies else None


def faults(scores: list[Score]) -> list[str]:
    """Why the verdict on all recordings together is bad; empty if it is good."""
    if not scores:
        return ["nothing was tested"]
    touches, found = (sum(counts) for counts in zip(*((one.touches, len(one.found)) for one in scores), strict=True))
    said = list(dict.fromkeys(fault for one in scores for fault in one.faults))
    if found < FOUND_GOAL * touches:
        stopped = sum(len(one.untested) for one in scores)
        why = f", {stopped} of the others because the guard was still stopped" if stopped else ""
        said.append(f"{found} of {touches} touches found{why}")
    return said


def _latency_ms(touch: Touch, trip: Trip) -> float:
    return 1e3 * (trip.time_s - touch.start_s)


def _rounded(values: FloatArray) -> list[float]:
    return [round(float(value), 3) for value in values]


def _moment(trip: Trip) -> dict[str, Any]:
    return {
        "stop_s": trip.time_s,
        "reason": trip.reason.name,
        "joint": trip.joint,
        "index_nm": round(trip.index_nm, 3),
        "threshold_nm": round(trip.threshold_nm, 3),
        **({"detail": trip.detail} if trip.detail else {}),
    }

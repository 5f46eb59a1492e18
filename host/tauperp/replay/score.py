"""What a played recording says about the guard: touches found and missed, alarms while nobody touched the arm."""

import dataclasses
import statistics
from typing import Any

from tauperp.firmware import Reason
from tauperp.replay.playback import Playback, Trip
from tauperp.replay.recording import Touch

FOUND_GOAL = 0.9  # share of the labelled touches


@dataclasses.dataclass(frozen=True)
class Score:
    """A touch is found by a collision trip while it lasts. Any other trip is an alarm, or, if an input was at fault
    and no index, an input stop. Without labels every collision is an alarm."""

    found: tuple[tuple[Touch, Trip], ...]
    missed: tuple[Touch, ...]
    alarms: tuple[Trip, ...]
    input_stops: tuple[Trip, ...]
    idle_s: float

    @property
    def touches(self) -> int:
        return len(self.found) + len(self.missed)

    def report(self) -> dict[str, Any]:
        """As JSON: counts, and the moments of each touch and alarm, s."""
        return {
            "touches": self.touches,
            "found": len(self.found),
            "missed": len(self.missed),
            "alarms_idle": len(self.alarms),
            "input_stops": len(self.input_stops),
            "idle_s": round(self.idle_s, 3),
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
            "alarms": [_moment(trip) for trip in self.alarms],
            "inputs": [_moment(trip) for trip in self.input_stops],
        }


def score(playback: Playback) -> Score:
    """Compare the trips with the labels."""
    recording = playback.recording
    collisions = [trip for trip in playback.trips if trip.reason == Reason.COLLISION]
    first: dict[Touch, Trip] = {}
    alarms = []
    for trip in collisions:
        touch = recording.touch_at(trip.row)
        if touch is None:
            alarms.append(trip)
        else:
            first.setdefault(touch, trip)
    touched_s = sum(touch.end_s - touch.start_s for touch in recording.touches)
    return Score(
        found=tuple(first.items()),
        missed=tuple(touch for touch in recording.touches if touch not in first),
        alarms=tuple(alarms),
        input_stops=tuple(trip for trip in playback.trips if trip.reason != Reason.COLLISION),
        idle_s=float(recording.time_s[-1]) - touched_s,
    )


def median_latency_ms(scores: list[Score]) -> float | None:
    """From the start of the label to the trip, over every touch found; None if there is none."""
    latencies = [_latency_ms(touch, trip) for one in scores for touch, trip in one.found]
    return round(statistics.median(latencies), 1) if latencies else None


def is_good(scores: list[Score]) -> bool:
    """Enough of all touches found, and nothing alarmed or stopped besides."""
    touches, found = (sum(counts) for counts in zip(*((one.touches, len(one.found)) for one in scores), strict=True))
    return found >= FOUND_GOAL * touches and not any(one.alarms or one.input_stops for one in scores)


def _latency_ms(touch: Touch, trip: Trip) -> float:
    return 1e3 * (trip.time_s - touch.start_s)


def _moment(trip: Trip) -> dict[str, Any]:
    return {
        "stop_s": trip.time_s,
        "reason": trip.reason.name,
        "joint": trip.joint,
        "index_nm": round(trip.index_nm, 3),
        "threshold_nm": round(trip.threshold_nm, 3),
    }

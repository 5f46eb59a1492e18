"""When the permission was lost, why, and for how long."""

import dataclasses
from collections import deque

from tauperp.monitor.snapshot import SILENT_S, Stop, Verdict

KEPT = 100
SILENCE = "Silence"


class History:
    """Follows the StopCommands of one guard. A stop starts with

    - a new trip number, even if the previous trip is still latched;
    - a permission that ends without one, for example after a restart of the guard;
    - silence: no StopCommand for SILENT_S after an earlier one. Consecutive silences are one stop.
    """

    def __init__(self) -> None:
        self._stops: deque[Stop] = deque(maxlen=KEPT)  # newest first
        self._last: Verdict | None = None
        self._heard_s = 0.0
        self._silent_since: float | None = None

    def note(self, verdict: Verdict, time_s: float, silent_s: float = SILENT_S) -> None:
        """Process a valid StopCommand, received at `time_s`."""
        self.look(time_s, silent_s)
        before, self._last, self._heard_s = self._last, verdict, time_s
        newest = self._stops[0] if self._stops else None
        if verdict.permitted:
            if newest is not None and newest.lasted_s is None:
                self._stops[0] = dataclasses.replace(newest, lasted_s=time_s - newest.time_s)
            return
        earlier = before is None
        tripped = verdict.trip_number != (0 if before is None else before.trip_number) and verdict.trip_number != 0
        lost = before is not None and before.permitted
        if not (tripped or lost):
            return
        number = verdict.trip_number if tripped else None
        index = verdict.index_nm if verdict.collided else None
        self._begin(Stop(time_s, number, verdict.reason, verdict.joint, index, earlier=earlier))

    def look(self, time_s: float, silent_s: float = SILENT_S) -> None:
        """Record silence: no StopCommand for `silent_s` at `time_s`."""
        newest = self._stops[0] if self._stops else None
        silent = self._last is not None and time_s - self._heard_s > silent_s
        known = self._silent_since == self._heard_s
        if not silent or known:
            return
        self._silent_since = self._heard_s
        if newest is not None and newest.reason == SILENCE:  # real trips stay visible
            self._stops[0] = dataclasses.replace(newest, time_s=self._heard_s, lasted_s=None, times=newest.times + 1)
        else:
            self._begin(Stop(self._heard_s, None, SILENCE))

    def stops(self) -> tuple[Stop, ...]:
        """Newest first."""
        return tuple(self._stops)

    def _begin(self, stop: Stop) -> None:
        """A stop may follow another without a permission in between. The older one then ends when the newer starts."""
        if self._stops and self._stops[0].lasted_s is None:
            older = self._stops[0]
            self._stops[0] = dataclasses.replace(older, lasted_s=stop.time_s - older.time_s)
        self._stops.appendleft(stop)
